"""How figures read in pictures and pages."""

from __future__ import annotations

import math
from collections.abc import Iterable


def percent(share: float, digits: int = 1) -> str:
    """``"83.5 %"`` for 0.8359: rounded down, so that "100 %" means all of it."""
    # A hair is added first: 0.29 * 100 is 28.999999999999996.
    scale = 10.0**digits
    value = math.floor(share * 100.0 * scale + 1e-7) / scale
    return f"{value:.{digits}f} %"


def number(value: float | None, digits: int = 4) -> str:
    """A length or a measure with that many significant digits; None is "no promise"."""
    if value is None:
        return "no promise"
    value += 0.0  # -0.0 would read "-0.000"
    if value != 0.0 and not 1e-4 <= abs(value) < 1e9:
        return f"{value:.{digits - 1}e}"
    before = math.floor(math.log10(abs(value))) if value != 0.0 else 0
    return f"{value:,.{max(0, digits - 1 - before)}f}"


def direction(vector: Iterable[float]) -> str:
    """``"(0.27, -0.80, 0.53)"``."""
    # Adding 0.0 turns -0.0, which would read "-0.00", into 0.0.
    return "(" + ", ".join(f"{round(float(x), 2) + 0.0:.2f}" for x in vector) + ")"


def plain(text: str) -> str:
    """For a picture: file names hold any byte, and matplotlib takes dollar signs for formulas."""
    line = "".join(c if c.isprintable() else "?" for c in text)
    return (line if len(line) <= 48 else f"{line[:45]}...").replace("$", r"\$")
