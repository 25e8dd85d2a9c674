"""Values that users type, checked once, when the options that hold them are made.

Each raises :class:`~simplifier.errors.OptionError` with the option's name, its value and what to
choose in its place.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields
from numbers import Integral, Real
from pathlib import Path
from types import UnionType

from simplifier.errors import OptionError

MOST_VALUES = 16
"""Of a list."""

_LONGEST = 60  # characters of a value in a message


def check_within(name: str, value: float, low: float, high: float) -> None:
    """A number from ``low`` to ``high``, both included."""
    # NaN fails the comparison; a whole number too large for a float must not meet one.
    if not is_number(value) or not low <= value <= high:
        raise OptionError(
            f"{value_text(value)} is out of range", where=name, remedy=f"choose {low:,} to {high:,}"
        )


def check_whole(name: str, value: int, low: int, high: int) -> None:
    """A whole number from ``low`` to ``high``, both included."""
    if not isinstance(value, Integral) or isinstance(value, bool):
        raise OptionError(
            f"{value_text(value)} is not a whole number",
            where=name,
            remedy=f"choose {low:,} to {high:,}",
        )
    check_within(name, value, low, high)


def check_above_zero(name: str, value: float, high: float) -> None:
    """A number above 0 and at most ``high``."""
    if not is_number(value) or not 0.0 < value <= high:
        raise OptionError(
            f"{value_text(value)} is out of range",
            where=name,
            remedy=f"choose more than 0 and at most {high:,}",
        )


def check_positive(name: str, value: float) -> None:
    """A number above 0, however large."""
    if not is_finite(value) or not value > 0.0:
        raise OptionError(
            f"{value_text(value)} is out of range", where=name, remedy="choose a number above 0"
        )


def check_length(name: str, value: float) -> None:
    """0 or a positive length."""
    if not is_finite(value) or not value >= 0.0:
        raise OptionError(
            f"{value_text(value)} is not a length",
            where=name,
            remedy="give 0 or a positive length in the units of the mesh",
        )


def check_lengths(name: str, values: Sequence[float], count: int | None = None) -> None:
    """A list or tuple of positive lengths, of so many if there is a ``count``."""
    if not isinstance(values, (list, tuple)):
        raise OptionError(
            f"{value_text(values)} is not a list of lengths",
            where=name,
            remedy="give a list of numbers",
        )
    for value in values:
        check_positive(name, value)
    if count is not None and len(values) != count:
        raise OptionError(f"{len(values)} lengths are given", where=name, remedy=f"give {count}")


def check_several(name: str, values: Sequence[float]) -> None:
    """A list or tuple of 1 to 16 values, no two of them the same; of what kind is not looked at."""
    if not isinstance(values, (list, tuple)):
        raise OptionError(
            f"{value_text(values)} is no list", where=name, remedy="give a list of numbers"
        )
    if not 1 <= len(values) <= MOST_VALUES:
        raise OptionError(
            f"{len(values)} values are given", where=name, remedy=f"give 1 to {MOST_VALUES}"
        )
    if any(value in values[:place] for place, value in enumerate(values)):
        raise OptionError("a value is given twice", where=name, remedy="give each once")


def check_size(name: str, value: object) -> None:
    """Two numbers: columns and rows."""
    if not isinstance(value, tuple) or len(value) != 2:
        raise OptionError(
            f"{value_text(value)} is not a size", where=name, remedy="give columns and rows"
        )


def check_one_of(name: str, value: str, choices: Sequence[str]) -> None:
    """One of some words."""
    # A list's "in" would ask an array for a truth that it does not have.
    if not isinstance(value, str) or value not in choices:
        raise OptionError(
            f"{value_text(value)} is not known",
            where=name,
            remedy=f"choose one of {', '.join(choices)}",
        )


def check_flag(name: str, value: bool) -> None:
    """True or false."""
    if not isinstance(value, bool):
        raise OptionError(
            f"{value_text(value)} is neither true nor false",
            where=name,
            remedy="give true or false",
        )


def check_kind(name: str, value: object, kind: type | UnionType, remedy: str) -> None:
    """An object of one of the library's own kinds; ``remedy`` is what to give."""
    if not isinstance(value, kind):
        raise OptionError(f"{value_text(value)} is no {name}", where=name, remedy=f"give {remedy}")


def as_path(name: str, value: object) -> Path:
    """Text, or what stands for a path, as a path."""
    try:
        return Path(value)  # type: ignore[arg-type]
    except TypeError:
        raise OptionError(
            f"{value_text(value)} is no path", where=name, remedy="give text or a pathlib.Path"
        ) from None


def check_callable(name: str, value: object) -> None:
    """A function."""
    if not callable(value):
        raise OptionError(
            f"{value_text(value)} cannot be called", where=name, remedy="give a function"
        )


def check_cancel(value: object) -> None:
    """What can be asked whether to end a run, or None for nothing."""
    if value is not None and not callable(getattr(value, "is_set", None)):
        raise OptionError(
            f"{value_text(value)} has no method is_set",
            where="cancel",
            remedy="give a threading.Event",
        )


def settle_numbers(options: object) -> None:
    """Turn the numbers of a frozen dataclass, also those in tuples, into Python's own, in place.

    numpy's would overflow in the sums that options enter, and no JSON takes them.
    """
    for one in fields(options):  # type: ignore[arg-type]
        value = getattr(options, one.name)
        # A list would be kept, and changed or hashed in vain.
        plain = tuple(map(_plain, value)) if isinstance(value, (tuple, list)) else _plain(value)
        object.__setattr__(options, one.name, plain)


def _plain(value: object) -> object:
    if isinstance(value, bool):
        return value
    if type(value).__name__ in ("bool", "bool_") and type(value).__module__ == "numpy":
        return bool(value)
    if isinstance(value, Integral):
        return int(value)
    try:
        return float(value) if isinstance(value, Real) else value
    except OverflowError:  # a fraction beyond all floats, which every check refuses
        return value


def value_text(value: object) -> str:
    """A value as a message can hold it."""
    try:
        text = repr(value)
    except ValueError:  # Python writes no whole number of more than 4,300 digits
        text = ""
    return text if 0 < len(text) <= _LONGEST else f"a value of type {type(value).__name__}"


def is_number(value: object) -> bool:
    """A whole number or a float, of Python or numpy; a bool is none."""
    # numpy registers its own with these, so that options need not import it.
    return isinstance(value, Real) and not isinstance(value, bool)


def is_finite(value: object) -> bool:
    """A number, as above, that a float can hold."""
    try:
        return isinstance(value, Real) and is_number(value) and math.isfinite(value)
    except OverflowError:  # a whole number beyond all floats
        return False
