"""What a user chooses for one run, by the names of :mod:`simplifier.option_fields`.

Imports nothing that takes long, so that a request can be refused where nothing is simplified.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

from simplifier.checks import check_kind, settle_numbers
from simplifier.errors import OptionError
from simplifier.lods.options import LodOptions, check_outside, chosen_lods, finest_bound
from simplifier.option_fields import (
    EVALUATE_FIELDS,
    SIMPLIFY_FIELDS,
    TRADEOFF_FIELDS,
    OptionField,
)
from simplifier.options import Axis, Preset, Slicing, Transparent, Trim, Viewers, check_alternatives


@dataclass(frozen=True)
class SimplifyOptions:
    """All that ``occluder simplify`` can be told, with the defaults, limits and meanings of
    :data:`~simplifier.option_fields.SIMPLIFY_FIELDS`.

    ``transparent`` is for who reads the mesh: ``load(path, transparent=options.transparent)``.

    Raises :class:`OptionError` for a value of another kind or out of range, and for two that cannot
    go together.  Only what depends on the mesh is left to be found later: a hole longer than it,
    and an error bound that would take too fine a grid.
    """

    budget: int = 64
    resolution: int | None = None
    error_bound: float | None = None
    lods: int | None = None
    error_bounds: tuple[float, ...] | None = None
    pixel_error: float | None = None
    screen_height: int | None = None
    fov: float | None = None
    up: Axis = "y"
    ground: bool = False
    viewers: Viewers = "all"
    transparent: Transparent = "leave-out"
    smallest_hole: float = 0.0
    conservative: bool = False
    shrink: float = 0.0
    trim: Trim = "gain"
    alpha: float = 0.001
    slicer: Slicing = "cpu"
    preset: Preset = "balanced"
    min_precision: float = 0.995
    moves: int | None = None
    time_limit: float | None = None
    seed: int = 0
    views: int = 256
    image: int = 256
    quads: int = 32_000
    exact: bool = False
    memory_limit: float | None = None

    def __post_init__(self) -> None:
        settle_numbers(self)
        _check_fields(self, SIMPLIFY_FIELDS)
        levels = self.levels
        if levels is not None:
            finest_bound(levels, self.resolution, self.error_bound)
            check_outside(self.conservative or self.shrink > 0.0)
        check_alternatives(self.resolution, self.error_bound, self.moves, self.time_limit)

    @classmethod
    def of(cls, chosen: Mapping[str, Any]) -> Self:
        """From names and values as JSON has them; a list of lengths becomes a tuple.

        Raises :class:`OptionError` as the class does, and for a name that it does not know.
        """
        return cls(**_known(chosen, SIMPLIFY_FIELDS))

    @property
    def levels(self) -> LodOptions | None:
        """Which levels of detail; None for a single occluder."""
        return chosen_lods(
            self.lods, self.error_bounds, self.pixel_error, self.screen_height, self.fov
        )


@dataclass(frozen=True)
class EvaluateOptions:
    """All that ``occluder evaluate`` can be told, as
    :data:`~simplifier.option_fields.EVALUATE_FIELDS` says.

    Raises :class:`OptionError` for a value of another kind or out of range.
    """

    resolution: int | None = None
    up: Axis = "y"
    ground: bool = False
    viewers: Viewers = "all"
    transparent: Transparent = "leave-out"
    smallest_hole: float = 0.0
    seed: int = 0
    views: int = 256
    image: int = 256
    quads: int = 32_000
    exact: bool = False
    memory_limit: float | None = None

    def __post_init__(self) -> None:
        settle_numbers(self)
        _check_fields(self, EVALUATE_FIELDS)

    @classmethod
    def of(cls, chosen: Mapping[str, Any]) -> Self:
        """From names and values as JSON has them.

        Raises :class:`OptionError` as the class does, and for a name that it does not know.
        """
        return cls(**_known(chosen, EVALUATE_FIELDS))


@dataclass(frozen=True)
class TradeoffOptions:
    """All that ``occluder tradeoff`` can be told, as
    :data:`~simplifier.option_fields.TRADEOFF_FIELDS` says.

    Raises :class:`OptionError` for a value of another kind or out of range.
    """

    resolutions: tuple[int, ...] = (32, 64, 128)
    directions: tuple[int, ...] = (16, 32, 128)
    budgets: tuple[int, ...] = (16, 64, 256)
    times: tuple[float, ...] = (0.25, 0.5, 1.0, 2.0, 5.0)
    precision: float = 0.99
    repeats: int = 3
    full: bool = False
    up: Axis = "y"
    ground: bool = False
    transparent: Transparent = "leave-out"
    seed: int = 0
    memory_limit: float | None = None

    def __post_init__(self) -> None:
        settle_numbers(self)
        _check_fields(self, TRADEOFF_FIELDS)

    @classmethod
    def of(cls, chosen: Mapping[str, Any]) -> Self:
        """From names and values as JSON has them; lists become tuples.

        Raises :class:`OptionError` as the class does, and for a name that it does not know.
        """
        return cls(**_known(chosen, TRADEOFF_FIELDS))


def _check_fields(options: object, fields: Sequence[OptionField]) -> None:
    for one in fields:
        one.check(getattr(options, one.name))


def _known(chosen: Mapping[str, Any], fields: Sequence[OptionField]) -> dict[str, Any]:
    """The values by name, lists as tuples."""
    check_kind("options", chosen, Mapping, "an object of names and values")
    names = [one.name for one in fields]
    for name in chosen:
        if name not in names:
            raise OptionError(
                "there is no such option", where=str(name), remedy=f"choose from {', '.join(names)}"
            )
    return {
        name: tuple(value) if isinstance(value, list) else value for name, value in chosen.items()
    }
