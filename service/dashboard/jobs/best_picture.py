"""The best so far of a running job, drawn over the original."""

from __future__ import annotations

from base64 import b64encode

from nicegui import ui

from service.dashboard.colours import BOTH, MISSED, WRONG
from service.dashboard.wording import percent, seconds
from service.jobs.progress import JobProgress, Snapshot

_LEGEND = ((BOTH, "hidden rightly"), (MISSED, "missed"), (WRONG, "hidden wrongly"))


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
        f"best so far after {seconds(progress.seconds)}: hides {percent(progress.measure)} of what "
        "the original hides"
    )


def _address(snapshot: Snapshot) -> str:
    return f"data:image/png;base64,{b64encode(snapshot.png).decode('ascii')}"
