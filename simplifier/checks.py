"""Values that users type, checked once, when the options that hold them are made.

Each raises :class:`~simplifier.errors.OptionError` with the option's name, its value and what to
choose in its place.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Integral, Real

from simplifier.errors import OptionError

MOST_VALUES = 16
"""Of a list."""


def check_within(name: str, value: float, low: float, high: float) -> None:
    """A number from ``low`` to ``high``, both included."""
    # NaN fails the comparison; a whole number too large for a float must not meet one.
    if not is_number(value) or not low <= value <= high:
        raise OptionError(
            f"{value!r} is out of range", where=name, remedy=f"choose {low:,} to {high:,}"
        )


def check_whole(name: str, value: int, low: int, high: int) -> None:
    """A whole number from ``low`` to ``high``, both included."""
    if not isinstance(value, Integral):
        raise OptionError(
            f"{value!r} is not a whole number", where=name, remedy=f"choose {low:,} to {high:,}"
        )
    check_within(name, value, low, high)


def check_above_zero(name: str, value: float, high: float) -> None:
    """A number above 0 and at most ``high``."""
    if not is_number(value) or not 0.0 < value <= high:
        raise OptionError(
            f"{value!r} is out of range",
            where=name,
            remedy=f"choose more than 0 and at most {high:,}",
        )


def check_positive(name: str, value: float) -> None:
    """A number above 0, however large."""
    if not is_number(value) or not 0.0 < value < math.inf:
        raise OptionError(
            f"{value!r} is out of range", where=name, remedy="choose a number above 0"
        )


def check_length(name: str, value: float) -> None:
    """0 or a positive length."""
    if not is_number(value) or not 0.0 <= value < math.inf:
        raise OptionError(
            f"{value!r} is not a length",
            where=name,
            remedy="give 0 or a positive length in the units of the mesh",
        )


def check_lengths(name: str, values: Sequence[float]) -> None:
    """A list or tuple of positive lengths."""
    if not isinstance(values, (list, tuple)):
        raise OptionError(
            f"{values!r} is no list of lengths", where=name, remedy="give a list of numbers"
        )
    for value in values:
        check_positive(name, value)


def check_several(name: str, values: Sequence[float]) -> None:
    """A list or tuple of 1 to 16 values, no two of them the same; of what kind is not looked at."""
    if not isinstance(values, (list, tuple)):
        raise OptionError(f"{values!r} is no list", where=name, remedy="give a list of numbers")
    if not 1 <= len(values) <= MOST_VALUES:
        raise OptionError(
            f"{len(values)} values are given", where=name, remedy=f"give 1 to {MOST_VALUES}"
        )
    if any(value in values[:place] for place, value in enumerate(values)):
        raise OptionError("a value is given twice", where=name, remedy="give each once")


def check_one_of(name: str, value: str, choices: Sequence[str]) -> None:
    """One of some words."""
    if value not in choices:
        raise OptionError(
            f"{value!r} is not known", where=name, remedy=f"choose one of {', '.join(choices)}"
        )


def check_flag(name: str, value: bool) -> None:
    """Yes or no."""
    if not isinstance(value, bool):
        raise OptionError(f"{value!r} is neither yes nor no", where=name, remedy="give a bool")


def is_number(value: object) -> bool:
    """A whole number or a float, of Python or numpy; a bool is none."""
    # numpy registers its own with these, so that options need not import it.
    return isinstance(value, Real) and not isinstance(value, bool)
