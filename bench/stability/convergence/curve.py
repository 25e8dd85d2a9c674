"""A figure of a mesh against one knob: the error at each of its values, and rows of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from bench.record import Row
from bench.stability.convergence.spread import Spread, fitted_power, least_good


@dataclass(frozen=True)
class Curve:
    """Errors in points against the values of a knob, ascending.

    ``knob``     as a reader names it, ``default`` its value where nothing else is asked for.
    ``figure``   what is in error: recall, precision, ratio.
    ``errors``   over the seeds, at each value, less what the reference says.
    """

    mesh: str
    knob: str
    figure: str
    default: int
    errors: Mapping[int, Spread]

    @property
    def values(self) -> list[int]:
        return sorted(self.errors)

    def rows(self) -> Iterator[Row]:
        """A row a value."""
        for value in self.values:
            error = self.errors[value]
            yield {
                "mesh": self.mesh, "knob": self.knob, "figure": self.figure, "value": value,
                "seeds": error.count, "offset": error.mean, "deviation": error.deviation,
                "offset_error": error.standard_error,
            }  # fmt: skip

    @property
    def summary(self) -> Row:
        """The error at the default, the least value that is good to half a point, the power."""
        errors = [self.errors[value] for value in self.values]
        at_default = self.errors[self.default]
        power = fitted_power(self.values, [error.typical for error in errors])
        least = least_good(self.values, errors)
        return {
            "mesh": self.mesh, "knob": self.knob, "figure": self.figure, "default": self.default,
            "offset": at_default.mean, "deviation": at_default.deviation,
            "good from": f"above {self.values[-1]}" if least is None else least,
            "exponent": "" if power is None else f"{power.exponent:.2f} ± {power.error:.2f}",
        }  # fmt: skip


def curves(
    mesh: str, knob: str, default: int, found: Mapping[str, Mapping[int, Sequence[float]]]
) -> list[Curve]:
    """One for each figure of ``found``: errors of the seeds by value, as shares."""
    return [
        Curve(
            mesh,
            knob,
            figure,
            default,
            {
                value: Spread.of([100.0 * error for error in errors])
                for value, errors in values.items()
            },
        )
        for figure, values in found.items()
    ]
