"""How good an occluder is by direction: a sphere of views, unrolled.

A dot for each view stands where its viewer does, coloured by how well the occluder does there.  The
map is of equal areas (Mollweide, 1805).  A view of direction d lies towards -d.  The front is in
the middle, viewers above are at the top.  Directions that are uniform on the sphere are uniform on
the map.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Literal

from nicegui.element import Element

from service.dashboard.colours import STOPS, Scale, css
from service.dashboard.views import Measure, View, worst_first
from service.dashboard.wording import percent, viewpoint

_MOST_DOTS = 1024
"""Dots that a map has room for: of more views, the worst."""

Axis = Literal["x", "y", "z"]
Vector = tuple[float, float, float]
# By the axis that points up: the signed axes that point to the right and to the front.
_RIGHT: dict[Axis, Vector] = {"x": (0, -1, 0), "y": (1, 0, 0), "z": (1, 0, 0)}
_FRONT: dict[Axis, Vector] = {"x": (0, 0, 1), "y": (0, 0, 1), "z": (0, -1, 0)}
_UP: dict[Axis, Vector] = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}

WIDTH, HEIGHT = 2.0, 1.0
"""Half the axes of the ellipse that places lie in."""


class ViewMap(Element, component="view_map.js"):
    """One view can be chosen, by a click, or by the arrow keys and Enter; Home is the worst.

    ``views``  at least one.
    ``up``     axis of the mesh that points up.
    ``chosen``  index of the view that is shown elsewhere on the page, if any.
    """

    def __init__(
        self, views: Sequence[View], *, up: Axis, measure: Measure, chosen: int | None = None
    ) -> None:
        super().__init__()
        self._views = views
        self._up = up
        self.props["lines"] = graticule()
        self.props["stops"] = [css(stop) for stop in STOPS]
        self.props["chosen"] = chosen
        self.show_measure(measure)

    def show_measure(self, measure: Measure) -> None:
        """Colour the dots by it."""
        worst = worst_first(self._views, measure)[:_MOST_DOTS]
        scale = Scale.over([view.share(measure) for view in worst])
        self.props["dots"] = [self._dot(view, scale, measure) for view in worst]
        self.props["worst"] = worst[0].index
        self.props["low"], self.props["high"] = percent(scale.low), percent(scale.high)
        self.props["label"] = (
            f"Views by {measure}, each where its viewer stands. Arrow keys go to the next, "
            "Enter shows it, Home goes to the worst."
        )
        self.update()

    def show_chosen(self, index: int) -> None:
        """Mark the view that is shown elsewhere."""
        self.props["chosen"] = index
        self.update()

    def on_choose(self, told: Callable[[int], None]) -> None:
        """Hear of the index of each view that is chosen."""
        self.on("choose", lambda event: told(int(event.args)))

    def _dot(self, view: View, scale: Scale, measure: Measure) -> dict[str, object]:
        x, y = place(view.direction, self._up)
        return {
            "index": view.index,
            "x": round(x, 4),
            "y": round(y, 4),
            "colour": css(scale.colour(view.share(measure))),
            "text": f"View {view.index}, {viewpoint(view.direction, self._up)}: recall "
            f"{percent(view.recall)}, precision {percent(view.precision)}",
        }


def place(direction: Vector, up: Axis) -> tuple[float, float]:
    """The place of a line of sight: x to the right, -2 to 2, y to the top, -1 to 1."""
    right, front, above = (-_dot(direction, axes[up]) for axes in (_RIGHT, _FRONT, _UP))
    return mollweide(math.atan2(right, front), math.asin(max(-1.0, min(1.0, above))))


def mollweide(longitude: float, latitude: float) -> tuple[float, float]:
    """Radians, -pi to pi and -pi/2 to pi/2, to a place on the map."""
    angle = _auxiliary(latitude)
    return 2.0 * longitude / math.pi * math.cos(angle), math.sin(angle)


def graticule() -> list[list[tuple[float, float]]]:
    """Lines to find one's way by: every 45 degrees around, every 30 up and down."""
    steps = [step / 24.0 for step in range(-24, 25)]
    meridians = [
        [mollweide(math.radians(degrees), step * math.pi / 2.0) for step in steps]
        for degrees in range(-180, 181, 45)
    ]
    parallels = [
        [mollweide(sign * math.pi, math.radians(degrees)) for sign in (-1.0, 1.0)]
        for degrees in (-60, -30, 0, 30, 60)
    ]
    return meridians + parallels


def _auxiliary(latitude: float) -> float:
    """The root t of 2 t + sin 2 t = pi sin(latitude), by bisection: its slope is 0 at the poles."""
    wanted = math.pi * math.sin(latitude)
    low, high = -math.pi / 2.0, math.pi / 2.0
    for _ in range(40):
        middle = (low + high) / 2.0
        if 2.0 * middle + math.sin(2.0 * middle) < wanted:
            low = middle
        else:
            high = middle
    return (low + high) / 2.0


def _dot(a: Vector, b: Vector) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))
