"""The measure of the best so far, drawn over time."""

from __future__ import annotations

from collections.abc import Sequence

from nicegui import ui

from service.dashboard.wording import percent
from service.jobs.progress import JobProgress

_WIDE, _HIGH = 200.0, 40.0
_MOST_POINTS = 400

Point = tuple[float, float]
"""Seconds, and a share from 0 to 1."""


class MeasureLine:
    """A small line, and its last value in words; hidden until there is a first point."""

    def __init__(self) -> None:
        self._points: list[Point] = []
        self._level = 0
        with ui.element("div").classes("measure-line") as self._box:
            with ui.element("svg") as drawing:
                drawing.props(
                    f'viewBox="0 0 {_WIDE:g} {_HIGH:g}" preserveAspectRatio=none aria-hidden=true'
                )
                self._line = ui.element("polyline").props(
                    'fill=none stroke=currentColor vector-effect="non-scaling-stroke"'
                )
            self._words = ui.label().classes("quiet number")
        self._box.set_visibility(False)

    def add(self, progress: JobProgress) -> None:
        """What was told, if it has a measure; another level or attempt begins a new line."""
        if progress.measure is None:
            return
        seconds, measure = progress.seconds, progress.measure
        if self._points and (progress.level != self._level or seconds < self._points[-1][0]):
            self._points.clear()
        self._level = progress.level
        if self._points and self._points[-1][1] == measure:
            return
        self._points.append((seconds, measure))
        if len(self._points) > _MOST_POINTS:
            del self._points[1:-1:2]
        self._line.props["points"] = polyline(self._points)
        self._line.update()
        self._words.text = f"hides {percent(measure)} of what the original hides, so far"
        self._box.set_visibility(True)

    def end(self) -> None:
        """There will be no more, and the result says what it came to."""
        self._box.set_visibility(False)


def polyline(points: Sequence[Point]) -> str:
    """Points of a line over the whole width, the lowest value at the bottom."""
    times = [time for time, _ in points]
    values = [value for _, value in points]
    begin, span = times[0], max(times[-1] - times[0], 1e-9)
    low, reach = min(values), max(max(values) - min(values), 1e-9)
    across, up = _WIDE / span, (_HIGH - 4.0) / reach
    return " ".join(
        f"{across * (time - begin):.1f},{_HIGH - 2.0 - up * (value - low):.1f}"
        for time, value in points
    )
