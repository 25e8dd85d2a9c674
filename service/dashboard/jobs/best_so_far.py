"""The best so far of a running job: drawn over the original, and its measure over time."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence

from nicegui import ui

from service.dashboard.colours import BOTH, MISSED, WRONG
from service.dashboard.wording import percent, seconds
from service.jobs.progress import JobProgress, Snapshot

_LEGEND = ((BOTH, "hidden correctly"), (MISSED, "missed"), (WRONG, "hidden wrongly"))

_MOST_POINTS = 400
MeasurePoint = tuple[float, float]
"""Seconds, and a share from 0 to 1."""

_WIDE, _HIGH = 200.0, 40.0


class BestPicture:
    """An image of a fixed size and what its colours mean; hidden until there is a first one.

    Pictures come with the page's own messages rather than by an address: one that is asked for as
    the job ends would not be there.  A browser shows the old one until it has read the new one.
    """

    def __init__(self) -> None:
        self._shown: Snapshot | None = None
        with ui.element("div").classes("best-picture") as self._box:
            self._image = ui.element("img").props("width=160 height=160")
            with ui.element("div").classes("quiet"):
                for colour, meaning in _LEGEND:
                    with ui.element("div").classes("best-picture-legend"):
                        ui.element("span").classes("swatch").style(f"background: rgb{colour}")
                        ui.label(meaning)
        self._box.set_visibility(False)

    def add(self, progress: JobProgress) -> None:
        """What was told; another attempt begins without a picture."""
        if progress.picture == self._shown:
            return
        self._shown = progress.picture
        self._box.set_visibility(self._shown is not None)
        if self._shown is not None:
            self._image.props["src"] = _address(self._shown)
            self._image.props["alt"] = best_words(progress)
            self._image.update()

    def end(self) -> None:
        """There will be no more."""
        self._box.set_visibility(False)


def best_words(progress: JobProgress) -> str:
    """What the picture shows, in words."""
    return (
        f"best so far after {seconds(progress.seconds)}: hides {percent(progress.measure, 1)} of"
        " what the original hides"
    )


def _address(snapshot: Snapshot) -> str:
    return f"data:image/png;base64,{b64encode(snapshot.png).decode('ascii')}"


class MeasureLine:
    """A small line, and its last value in words; hidden until there is a first point."""

    def __init__(self) -> None:
        self._points: list[MeasurePoint] = []
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
        self._words.text = f"hides {percent(measure, 1)} of what the original hides, so far"
        self._box.set_visibility(True)

    def end(self) -> None:
        """There will be no more, and the result says what it came to."""
        self._box.set_visibility(False)


def polyline(points: Sequence[MeasurePoint]) -> str:
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
