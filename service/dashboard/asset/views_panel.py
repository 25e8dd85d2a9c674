"""How good the occluder is from where: a map, and the worst views in a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import get_args

from nicegui import ui

from service.dashboard.asset.viewer_panel import ShowView
from service.dashboard.frame import panel
from service.dashboard.plain_table import PlainTable
from service.dashboard.projection import Axis
from service.dashboard.view_map import ViewMap
from service.dashboard.views import Measure, View, worst_first
from service.dashboard.wording import along, percent

_LISTED = 6


def views_panel(views: Sequence[View], up: Axis, show: ShowView) -> None:
    """Whatever is chosen is shown by ``show``; views in the order of the report, at least one."""
    with panel("By direction"):
        _ViewsPanel(views, up, show)


class _ViewsPanel:
    """Map and table speak of the same measure and mark the same view."""

    def __init__(self, views: Sequence[View], up: Axis, show: ShowView) -> None:
        self._views = views
        self._show = show
        self._measure: Measure = "recall"
        choice = ui.toggle(
            {one: one.capitalize() for one in get_args(Measure)},
            value=self._measure,
            on_change=lambda event: self._show_measure(event.value),
        )
        choice.props('dense no-caps unelevated role=group aria-label="What colours stand for"')
        self._map = ViewMap(views, up=up, measure=self._measure)
        self._map.on_choose(self._choose)
        self._list_worst()

    def _show_measure(self, measure: Measure) -> None:
        self._measure = measure
        self._map.show_measure(measure)
        self._list_worst.refresh()

    def _choose(self, index: int) -> None:
        # The index comes from the browser.
        if 0 <= index < len(self._views):
            self._map.show_chosen(index)
            self._show(self._views[index])

    @ui.refreshable_method
    def _list_worst(self) -> None:
        table = PlainTable(
            f"Views of the worst {self._measure}",
            ["Worst views", "Line of sight", "#Recall", "#Precision"],
        )
        for view in worst_first(self._views, self._measure)[:_LISTED]:
            with table.row():
                with table.cell():
                    button = ui.button(f"View {view.index}")
                    button.on_click(lambda _, index=view.index: self._choose(index))
                    button.props("flat dense no-caps size=sm")
                table.text(along(view.direction)).classes("number-text")
                table.number(percent(view.recall))
                table.number(percent(view.precision, 2))
