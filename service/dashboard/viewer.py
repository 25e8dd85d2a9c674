"""The original and its occluder in one 3D view, or as silhouettes over each other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import nicegui
from nicegui.element import Element
from nicegui.events import GenericEventArguments

from service.dashboard.colours import BOTH, MISSED, NEITHER, STOPS, UNSEEN, WRONG
from service.dashboard.links import ADDRESS
from service.dashboard.views import Direction

Mode = Literal["overlay", "transparent", "side", "wipe", "silhouette", "loss", "alone"]

_THREE = Path(nicegui.__file__).parent / "elements" / "scene" / "dist"
_HERE = Path(__file__).parent
SETS = _HERE / "sets"
"""What reads visible sets in the browser."""


@dataclass(frozen=True)
class Shares:
    """Pixels of a square picture that spans the original's bounding sphere.

    ``both``  covered by original and occluder, ``missed`` by the original only, ``wrong`` by the
    occluder only; ``direction`` is the line of sight.
    """

    direction: Direction
    both: int
    missed: int
    wrong: int
    pixels: int


class MeshViewer(
    Element,
    component="viewer.js",
    esm={
        "nicegui-scene": str(_THREE),
        "occluder-address": ADDRESS,
        "occluder-drawing": str(_HERE / "drawing"),
        "occluder-sets": str(SETS),
    },
):
    """A view of one original and the levels of one occluder, or of what a view cell may see of it.

    Where one looks from and how far the slider is are kept in the page's address.

    ``original``   address of a GLB as :func:`simplifier.save_for_viewing` writes it: a node tells
                   its bounding sphere, the unit of this view.
    ``levels``     addresses of GLBs, the finest first; none where there are ``sets``.
    ``sets``       address of the folder that :mod:`service.engines.work.set_view` writes: the
                   objects of the original that are in the set of a cell take the occluder's place.
    ``cell``       the one to begin with.
    ``loss``       address of the file that :func:`simplifier.save_loss_map` writes, of the finest
                   level; it is loaded when its mode is first shown.
    ``up``         axis of the mesh that points up.
    ``label``      what the view shows, for those who do not see it.
    ``direction``  line of sight to begin with; None for from the front.
    ``group``      viewers of one name on a page look from the same place.
    ``suffix``     of the slider's name in the address, where a page has several viewers.
    """

    def __init__(
        self,
        original: str,
        levels: Sequence[str] = (),
        *,
        label: str,
        up: Literal["x", "y", "z"] = "y",
        mode: Mode = "overlay",
        level: int = 0,
        wireframe: bool = False,
        direction: Direction | None = None,
        group: str | None = None,
        sets: str | None = None,
        cell: int = 0,
        loss: str | None = None,
        suffix: str = "",
    ) -> None:
        super().__init__()
        self._set(
            original=original, levels=list(levels), level=level, mode=mode, wireframe=wireframe,
            up=up, palette=[NEITHER, WRONG, MISSED, BOTH], direction=direction, label=label,
            group=group, sets=sets, cell=cell, loss=loss, ramp=[UNSEEN, *reversed(STOPS)],
            suffix=suffix,
        )  # fmt: skip

    def show_level(self, level: int) -> None:
        """Show one of the levels given, counted from 0."""
        self._set(level=level)

    def show_cell(self, cell: int) -> None:
        """Show what another cell may see."""
        self._set(cell=cell)

    def show_mode(self, mode: Mode) -> None:
        """Both over each other, the original see-through, beside each other, the original up to a
        slider and the occluder from there on, silhouettes, where recall is lost on the original, or
        without the original."""
        self._set(mode=mode)

    def show_wireframe(self, on: bool) -> None:
        self._set(wireframe=on)

    def look_along(self, direction: Direction) -> None:
        """A unit vector, the line of sight."""
        self.props["direction"] = direction  # where the page is drawn anew
        self.run_method("lookAlong", direction)

    def on_counted(self, told: Callable[[Shares], None]) -> None:
        """Hear of the pixels of each silhouette that has been shown for a moment."""

        def hear(event: GenericEventArguments) -> None:
            told(_shares(event.args))

        self.on("counted", hear)

    def _set(self, **properties: object) -> None:
        for name, value in properties.items():
            self.props[name] = value
        self.update()


def _shares(told: dict[str, Any]) -> Shares:
    x, y, z = told["direction"]
    return Shares((x, y, z), told["both"], told["missed"], told["wrong"], told["pixels"])
