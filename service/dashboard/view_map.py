"""A dot for each view, where its viewer stands, coloured by how well the occluder does there."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from nicegui.element import Element

from service.dashboard.projection import Axis, graticule, place
from service.dashboard.scale import STOPS, Scale, css
from service.dashboard.views import Measure, View, worst_first
from service.dashboard.wording import along, percent

_MOST = 1024
"""Dots that a map has room for: of more views, the worst."""


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
        worst = worst_first(self._views, measure)[:_MOST]
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
            "text": f"View {view.index}, along {along(view.direction)}: recall "
            f"{percent(view.recall)}, precision {percent(view.precision, 2)}",
        }
