"""What a run has to say of each asset.

What is demanded of an occluder, and how its figures fall short.

What is known of a finished occluder, in numbers.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Literal

from simplifier.accuracy.verdict import VerdictWord, falls_short
from simplifier.options.fields import OptionSet, option
from simplifier.options.simplify import MOST_TRIANGLES
from simplifier.wording import parts_above, parts_below


class State(StrEnum):
    """How an asset is at the end of a run."""

    CURRENT = "current"
    """As it was made before."""
    BUILT = "built"
    """Made by this run."""
    STALE = "stale"
    """To be made, and it was not: by a check, or because the run was interrupted."""
    FAILED = "failed"
    """It could not be made."""
    GONE = "gone"
    """Its mesh is there no more, and what was made of it is."""


@dataclass(frozen=True)
class Finding:
    """Of one asset.

    ``why``      it was made, is stale or failed; empty for one that is current.
    ``figures``  of the occluder that is there, if one is known.
    ``short``    how it falls short of what is demanded of it.
    ``seconds``  that making took.
    """

    asset: str
    state: State
    why: str = ""
    figures: AssetFigures | None = None
    short: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    seconds: float = 0.0

    @property
    def faults(self) -> tuple[str, ...]:
        """All that makes a run fail, in words."""
        bad = self.state in (State.STALE, State.FAILED, State.GONE)
        return ((f"{self.state}: {self.why}",) if bad else ()) + self.short


@dataclass(frozen=True)
class Requirements(OptionSet):
    """What ``require`` of a manifest demands of an occluder; None demands nothing."""

    min_precision: float | None = option(None, "Least precision.", low=0.0, high=1.0)
    min_recall: float | None = option(None, "Least recall.", low=0.0, high=1.0)
    max_overhang: float | None = option(None, "Most overhang.", low=0.0, high=1.0)
    verdict: Literal["good", "weak"] | None = option(None, "Worst verdict.")
    max_triangles: int | None = option(None, "Most triangles.", low=1, high=MOST_TRIANGLES)
    max_recall_loss: float = option(0.005, "Most recall lost to before.", low=0.0, high=1.0)


def shortfalls(
    demanded: Requirements, found: AssetFigures, before: AssetFigures | None
) -> Iterator[str]:
    """In words, each way in which an occluder is not good enough.

    ``before``  its figures where the change is compared to, if they are known.
    """
    if demanded.min_precision is not None and found.precision < demanded.min_precision:
        yield f"precision {_share(found.precision)} is below {_share(demanded.min_precision)}"
    if demanded.min_recall is not None and found.recall < demanded.min_recall:
        yield f"recall {_share(found.recall)} is below {_share(demanded.min_recall)}"
    most, overhang = demanded.max_overhang, found.overhang
    if most is not None and overhang is not None and overhang > most:
        yield f"overhang {_share(overhang)} is above {_share(most)}"
    if demanded.verdict and found.verdict and falls_short(found.verdict, demanded.verdict):
        yield f"the verdict is {found.verdict}, not {demanded.verdict}"
    if demanded.max_triangles is not None and found.triangles > demanded.max_triangles:
        yield f"{found.triangles:,} triangles are more than {demanded.max_triangles:,}"
    if before is not None and before.recall - found.recall > demanded.max_recall_loss:
        yield f"recall fell from {_share(before.recall)} to {_share(found.recall)}"


def unknown_figure(demanded: Requirements, found: AssetFigures) -> str:
    """A figure that something is demanded of and an old record does not have; or empty."""
    if demanded.max_overhang is not None and found.overhang is None:
        return "overhang"
    return "verdict" if demanded.verdict and found.verdict is None else ""


def _share(value: float) -> str:
    """In full where rounding would hide what is wrong: 79.996 % is not 80 %."""
    return f"{100.0 * value:.4f}".rstrip("0").rstrip(".") + " %"


_PARTS = 10**6  # of a share that are kept


@dataclass(frozen=True)
class AssetFigures:
    """Of the finest level where there are several.

    ``precision``, ``recall``  from 0 to 1, rounded down to six digits, as all that is to be large.
    ``overhang``     in the mean over all views, rounded up; None in records that do not have it.
    ``verdict``      in a word; None likewise.
    ``deviation``    how far it strays from the mesh, in its units, to six significant digits.
    ``error_bound``  how far it may; None where no promise was made.
    """

    triangles: int
    precision: float
    recall: float
    deviation: float
    error_bound: float | None
    overhang: float | None = None
    verdict: VerdictWord | None = None

    @classmethod
    def of(cls, report: Mapping[str, Any]) -> AssetFigures:
        """Of a report as ``docs/report.schema.json`` says."""
        bound, overhang = report["error_bound"], report["overhang"]["share"]
        return cls(
            int(report["triangles"]),
            parts_below(report["precision"], _PARTS) / _PARTS,
            parts_below(report["recall"], _PARTS) / _PARTS,
            _short(report["deviation"]),
            None if bound is None else _short(bound),
            parts_above(overhang, _PARTS) / _PARTS,
            report["verdict"]["word"],
        )


def _short(length: float) -> float:
    return float(f"{length:.6g}")
