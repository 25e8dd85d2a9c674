"""What a user can choose of levels of detail."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from simplifier.checks import check_length, check_whole, check_within, settle_numbers, value_text
from simplifier.errors import OptionError

MOST_LEVELS = 16
"""The most levels of detail of one object."""


@dataclass(frozen=True)
class LodOptions:
    """Which levels of detail, and how they are looked at."""

    lods: int | None = None
    """How many, 1 to 16, from fine to coarse: each further one has half the resolution and half the
    budget.  None with ``error_bounds``."""

    error_bounds: Sequence[float] | None = None
    """In place of a number: the error bound of each, world units, 1 to 16 different lengths in any
    order, kept in rising order; budgets fall in proportion to the resolutions."""

    pixel_error: float = 1.0
    """Pixels that a level's error may have on the screen, 0.01 to 1000.  Raising it lets coarser
    levels come nearer."""

    screen_height: int = 1080
    """Pixels from top to bottom of the screen, 1 to 100,000."""

    fov: float = 60.0
    """Vertical field of view, degrees, 1 to 179."""

    def __post_init__(self) -> None:
        settle_numbers(self)
        if (self.lods is None) == (self.error_bounds is None):
            raise OptionError(
                "give either a number of levels or their error bounds",
                where="lods",
                remedy="choose one of the two",
            )
        if self.lods is not None:
            check_whole("lods", self.lods, 1, MOST_LEVELS)
        if self.error_bounds is not None:
            object.__setattr__(self, "error_bounds", _rising(self.error_bounds))
        check_within("pixel error", self.pixel_error, 0.01, 1000.0)
        check_whole("screen height", self.screen_height, 1, 100_000)
        check_within("fov", self.fov, 1.0, 179.0)


def chosen_lods(
    lods: int | None,
    error_bounds: Sequence[float] | None,
    pixel_error: float | None,
    screen_height: int | None,
    fov: float | None,
) -> LodOptions | None:
    """The levels of detail that were chosen, None for a single occluder.

    What is None has its default.  Raises :class:`~simplifier.errors.OptionError`, also where a
    screen is given for no levels.
    """
    screen = {"pixel error": pixel_error, "screen height": screen_height, "fov": fov}
    if lods is None and error_bounds is None:
        for name, value in screen.items():
            if value is not None:
                remedy = "give lods or error bounds as well"
                raise OptionError("only levels of detail have one", where=name, remedy=remedy)
        return None
    return LodOptions(
        lods,
        error_bounds,
        1.0 if pixel_error is None else pixel_error,
        1080 if screen_height is None else screen_height,
        60.0 if fov is None else fov,
    )


def finest_bound(
    lods: LodOptions, resolution: int | None, error_bound: float | None
) -> float | None:
    """The error bound of the finest level, None where a resolution says how fine it is.

    Raises :class:`~simplifier.errors.OptionError` when ``lods`` has error bounds and one of the
    other two is given as well.
    """
    if lods.error_bounds is None:
        return error_bound
    for name, value in (("a resolution", resolution), ("an error bound", error_bound)):
        if value is not None:
            raise OptionError(
                f"cannot be given together with {name}",
                where="error bounds",
                remedy="choose one of the two",
            )
    return lods.error_bounds[0]


def check_outside(wholly_inside: bool) -> None:
    """Refuse levels of occluders that keep wholly inside: none has an error to be chosen by."""
    if wholly_inside:
        raise OptionError(
            "levels of detail cannot be kept wholly inside: their error bound is 0 at any distance",
            where="lods",
            remedy="leave out conservative and shrink, or make single occluders",
        )


def _rising(bounds: Sequence[float]) -> tuple[float, ...]:
    """The lengths in rising order, if they are lengths, different, and not too many."""
    try:
        given = tuple(bounds)
    except TypeError:
        raise OptionError(
            f"{value_text(bounds)} is no list of lengths",
            where="error bounds",
            remedy="give a list",
        ) from None
    if not 1 <= len(given) <= MOST_LEVELS:
        raise OptionError(
            f"{len(given)} lengths are given",
            where="error bounds",
            remedy=f"give 1 to {MOST_LEVELS}",
        )
    for bound in given:
        check_length("error bounds", bound)
        if bound == 0.0:
            remedy = "give positive lengths in the units of the mesh"
            raise OptionError("no grid has a bound of 0", where="error bounds", remedy=remedy)
    rising = tuple(sorted(map(float, given)))
    for finer, coarser in pairwise(rising):
        if finer == coarser:
            raise OptionError(
                f"{coarser!r} is given twice", where="error bounds", remedy="give each length once"
            )
    return rising
