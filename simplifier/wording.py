"""How figures read: the same one alike in the terminal, on pages, in pictures and in reports.

Shares are rounded down wherever they are percentages, so that what falls short of a bar never reads
as if it reached it.  Differences, times and lengths are rounded to the nearest.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

_ROUNDING = 1e-9  # 0.29 * 100 is 28.999999999999996


def parts_below(share: float, parts: float) -> int:
    """How many of so many parts a share is, rounded down: 830 of 1,000 for 0.83."""
    return math.floor(share * parts + _ROUNDING)


def parts_above(share: float, parts: float) -> int:
    """The same rounded up."""
    return math.ceil(share * parts - _ROUNDING)


def percent(share: float, digits: int = 1) -> str:
    """``"83.5 %"`` for 0.8359: rounded down, so that "100 %" means all of it.

    What is more than nothing never reads as nothing: ``"< 0.1 %"``.
    """
    scale = 10.0**digits
    steps = parts_below(share, 100.0 * scale)
    if steps == 0 and share > 0.0:
        return f"< {1.0 / scale:.{digits}f} %"
    return f"{steps / scale:.{digits}f} %"


def command_line(words: Iterable[str | Path]) -> str:
    """A command to paste into a shell; a file, given as a path, never reads as an option."""
    return shlex.join(
        f"./{word}" if isinstance(word, Path) and str(word).startswith("-") else str(word)
        for word in words
    )


def percent_at_most(share: float) -> str:
    """``"3.48 %"`` for 0.03471: rounded up, of what is to be small, so that no limit seems kept."""
    return f"{parts_above(share, 1e4) / 100.0:.2f} %"


def mean_and_worst(mean: float, worst: float) -> str:
    """``"3.48 %, at worst 4.71 %"``: over all views, of what is to be small."""
    return f"{percent_at_most(mean)}, at worst {percent_at_most(worst)}"


def overhang_words(share: float | None) -> str:
    """As :func:`percent_at_most`; empty where it was not measured."""
    return "" if share is None else percent_at_most(share)


def exact_percent(share: float) -> str:
    """``"99 %"``, ``"99.95 %"``: a bar as it was typed."""
    return f"{100.0 * share:.6g} %"


def small_percent(share: float) -> str:
    """``"0.000093 %"``: two digits of a share that may be tiny."""
    hundred = 100.0 * share
    before = math.floor(math.log10(hundred)) if hundred > 0.0 else 1
    return f"{hundred:.{max(0, 1 - before)}f} %"


def signed_points(difference: float) -> str:
    """``"+3.2"`` for a difference of shares of 0.032: percentage points."""
    rounded = round(difference * 100.0, 1)
    return f"{rounded:+.1f}" if rounded else "0.0"


def points(difference: float) -> str:
    """``"+3.2 points"``, ``"+1.0 point"`` for a difference of shares."""
    one = abs(round(difference * 100.0, 1)) == 1.0
    return f"{signed_points(difference)} {'point' if one else 'points'}"


def median_points(differences: Sequence[float]) -> str:
    """``"+3.2 (-0.1 to +4.0)"``: the median in points, with the range where there is one."""
    import statistics  # whose fractions every command would load

    middle = signed_points(statistics.median(differences))
    low, high = signed_points(min(differences)), signed_points(max(differences))
    return middle if low == high else f"{middle} ({low} to {high})"


def seconds(time: float) -> str:
    """``"500 ms"``, ``"1.25 s"``: milliseconds below a second, hundredths from there on."""
    return f"{time * 1000.0:,.0f} ms" if time < 1.0 else f"{time:,.2f} s"


def short_seconds(time: float) -> str:
    """``"80 ms"``, ``"0.50 s"``, ``"12.5 s"``: three significant digits, for times side by side."""
    if time < 0.0995:
        return f"{time * 1000.0:.0f} ms"
    return f"{time:.2f} s" if time < 9.995 else f"{time:.1f} s" if time < 99.95 else f"{time:.0f} s"


def duration(time: float) -> str:
    """``"28.5 s"``, ``"41 minutes"``, ``"3.7 hours"``, ``"62 days"``: for whoever waits."""
    for least, unit, name in ((172_800.0, 86_400.0, "days"), (7_200.0, 3_600.0, "hours"),
                              (120.0, 60.0, "minutes")):  # fmt: skip
        if time >= least:
            count = time / unit
            return f"{count:.1f} {name}" if count < 9.95 else f"{count:,.0f} {name}"
    return f"{time:.3g} s"


def length(value: float | None, digits: int = 4) -> str:
    """A length, an area or a volume with that many significant digits; None is "no promise"."""
    if value is None:
        return "no promise"
    value += 0.0  # -0.0 would read "-0.000"
    if value != 0.0 and not 1e-4 <= abs(value) < 1e9:
        return f"{value:.{digits - 1}e}"
    before = math.floor(math.log10(abs(value))) if value != 0.0 else 0
    return f"{value:,.{max(0, digits - 1 - before)}f}"


def distance_range(level: int, starts: Sequence[float | None]) -> str:
    """``"0 to 4,037"``, ``"4,037 to 8,075"``, ``"8,075 and beyond"``: from where to where a level
    of detail is used, units of the mesh; ``"any"`` where no coarser one follows the finest.

    ``starts``  distance from which each level may be used, the finest first; None for one whose
    error is not promised, which is never used.  Nearer than all of them the finest is used, so that
    its own does not count.
    """
    if level and starts[level] is None:
        return length(None)
    begin, following = length(starts[level]) if level else "0", _following(level, starts)
    if following is None:
        return f"{begin} and beyond" if level else "any"
    return f"{begin} to {length(starts[following])}"


def distance_advice(level: int, starts: Sequence[float | None]) -> str:
    """``"use from 0 to 4,037 units; beyond, level 1"``: :func:`distance_range` as advice."""
    if level and starts[level] is None:
        return "never used: its error is not promised"
    following = _following(level, starts)
    if following is None:
        return f"use from {length(starts[level])} units on" if level else "use at any distance"
    return f"use from {distance_range(level, starts)} units; beyond, level {following}"


def _following(level: int, starts: Sequence[float | None]) -> int | None:
    """The level that takes over from another one."""
    coarser = range(level + 1, len(starts))
    return next((one for one in coarser if starts[one] is not None), None)


_SIDES = ("the front", "the front right", "the right", "the back right", "the back",
          "the back left", "the left", "the front left")  # fmt: skip
_STRAIGHT = 75.0  # degrees of height from which the side no longer matters
_STEEPNESS = ((50.0, "steeply "), (20.0, ""), (5.0, "slightly "))
_RIGHT_AND_FRONT: Mapping[str, tuple[tuple[int, float], tuple[int, float]]] = {
    "x": ((1, -1.0), (2, 1.0)), "y": ((0, 1.0), (2, 1.0)), "z": ((0, 1.0), (1, -1.0)),
}  # fmt: skip
"""By the axis that is up: the axes that point to the right and to the front, with their signs."""


def viewpoint(line_of_sight: Sequence[float], up: str = "y") -> str:
    """``"from the right, slightly below"``: where a viewer stands who looks along a unit vector.

    The front is where +z points with x or y up, and where -y points with z up.
    """
    (across, to_right), (along, to_front) = _RIGHT_AND_FRONT[up]
    right, front = -to_right * line_of_sight[across], -to_front * line_of_sight[along]
    above = -line_of_sight["xyz".index(up)]
    height = math.degrees(math.asin(max(-1.0, min(1.0, above))))
    word = "above" if height > 0.0 else "below"
    if abs(height) >= _STRAIGHT:
        return f"from straight {word}"
    side = _SIDES[round(math.degrees(math.atan2(right, front)) / 45.0) % len(_SIDES)]
    for least, how in _STEEPNESS:
        if abs(height) >= least:
            return f"from {side}, {how}{word}"
    return f"from {side}"


def grid_size(cells: Iterable[int]) -> str:
    """``"64 x 63 x 50"``."""
    return " x ".join(map(str, cells))


def count(number: int, what: str) -> str:
    """``"1 part"``, ``"1,234 parts"``."""
    return f"{number:,} {what}{'' if number == 1 else 's'}"


def verdict_words(verdict: Mapping[str, Any]) -> str:
    """``"weak: precision is 98.12 %, ..."``: the word and the reason of a report's verdict."""
    return f"{verdict['word']}: {verdict['reason']}"


def picture_line(text: str) -> str:
    """One short line that can be drawn: no character that does not print, no formula.

    File names hold any byte, and matplotlib takes dollar signs for formulas.
    """
    line = "".join(c if c.isprintable() else "?" for c in text)
    return (line if len(line) <= 48 else f"{line[:45]}...").replace("$", r"\$")
