"""How good an occluder is from where: in 3D, on a map, and the worst views in a table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import get_args

from nicegui import ui
from nicegui.events import ValueChangeEventArguments

from service.dashboard.asset.details import RunDetail
from service.dashboard.frame import panel
from service.dashboard.links import Address, keep_in_address
from service.dashboard.plain_table import PlainTable
from service.dashboard.view_map import Axis, ViewMap
from service.dashboard.viewer import MeshViewer, Mode
from service.dashboard.views import Measure, View, worst_first
from service.dashboard.wording import distance_advice, percent, viewpoint, whole

ShowView = Callable[[View], None]

_MODES: dict[Mode, str] = {
    "overlay": "Overlay",
    "transparent": "See-through",
    "side": "Side by side",
    "wipe": "Slider",
    "silhouette": "Silhouettes",
    "loss": "Heat map",
}

_LISTED = 6


def viewer_panel(
    run: RunDetail,
    *,
    title: str = "3D view",
    mode: Mode = "overlay",
    group: str | None = None,
    suffix: str = "",
) -> ShowView:
    """The panel of a run; what it returns shows one of the report's views there.

    ``mode``    to begin with, unless the address names another.
    ``group``   panels of one name on a page look from the same place.
    ``suffix``  of the names under which the address keeps what is shown.
    """
    with panel(title):
        if run.original is None or not run.levels:
            ui.label("This job has no mesh to look at. Run it again to see it here.")
            return lambda view: None
        return _ControlledViewer(run, run.original, mode, group, suffix).show_view


class _ControlledViewer:
    """A viewer and its controls."""

    def __init__(
        self, run: RunDetail, original: str, mode: Mode, group: str | None, suffix: str
    ) -> None:
        self._up = run.up
        self._starts = [level.switch_distance for level in run.levels]
        self._address, self._usual = Address.of_page(suffix), mode
        with ui.element("div").classes("row-of-controls"):
            modes = {one: name for one, name in _MODES.items() if one != "loss" or run.loss}
            mode = self._address.one_of("mode", modes, mode)
            self._modes = ui.toggle(modes, value=mode, on_change=self._show_mode)
            self._modes.props('dense no-caps unelevated role=group aria-label="What is shown"')
            levels = {
                level.level: f"Level {level.level}, {whole(level.triangles)} triangles"
                for level in run.levels
            }
            level = self._address.one_of("level", levels, 0)
            ui.select(
                levels, value=level, label="Level of detail", on_change=self._show_level
            ).props("dense outlined options-dense").classes("level-choice")
            wireframe = bool(self._address.text("wireframe"))
            ui.switch("Wireframe", value=wireframe, on_change=self._show_wireframe).props("dense")
        view = chosen_view(run.views)
        self._viewer = MeshViewer(
            original,
            [level.files["glb"] for level in run.levels],
            label=f"{run.job.name}, original and occluder",
            up=run.up,
            mode=mode,
            level=level,
            wireframe=wireframe,
            direction=view.direction if view else None,
            group=group,
            loss=run.loss,
            suffix=suffix,
        )
        self._said = ui.label().classes("quiet one-line").props("aria-live=polite")
        if view and mode == "silhouette":
            self._say_view(view)
        elif level:
            self._say_level(level)

    def show_view(self, view: View) -> None:
        """Show silhouettes from one of the report's directions."""
        self._modes.value = "silhouette"
        self._viewer.look_along(view.direction)
        self._say_view(view)
        keep_in_address(view=view.index)

    def _say_view(self, view: View) -> None:
        self._said.set_text(
            f"View {view.index}, {viewpoint(view.direction, self._up)}: recall"
            f" {percent(view.recall)}, precision {percent(view.precision)}, measured on"
            " the finest level."
        )

    def _show_mode(self, event: ValueChangeEventArguments[Mode]) -> None:
        self._viewer.show_mode(event.value)
        self._said.set_text("")
        self._address.keep(mode=None if event.value == self._usual else event.value)

    def _show_level(self, event: ValueChangeEventArguments[int]) -> None:
        self._viewer.show_level(event.value)
        self._say_level(event.value)
        self._address.keep(level=event.value or None)

    def _say_level(self, level: int) -> None:
        self._said.set_text(f"Level {level}: {distance_advice(level, self._starts)}.")

    def _show_wireframe(self, event: ValueChangeEventArguments[bool | None]) -> None:
        self._viewer.show_wireframe(bool(event.value))
        self._address.keep(wireframe="on" if event.value else None)


def chosen_view(views: Sequence[View]) -> View | None:
    """The view that the address names."""
    index = Address.of_page().one_of("view", [view.index for view in views], None)
    return next((view for view in views if view.index == index), None)


def views_panel(views: Sequence[View], up: Axis, show: ShowView) -> None:
    """Show the views, as the report orders them, at least one; ``show`` gets the chosen one."""
    with panel("By direction"):
        _ViewsPanel(views, up, show)


class _ViewsPanel:
    """Map and table speak of the same measure and mark the same view."""

    def __init__(self, views: Sequence[View], up: Axis, show: ShowView) -> None:
        self._views, self._up = views, up
        self._show = show
        measures: tuple[Measure, ...] = get_args(Measure)
        self._measure = Address.of_page().one_of("by", measures, "recall")
        choice = ui.toggle(
            {one: one.capitalize() for one in measures},
            value=self._measure,
            on_change=lambda event: self._show_measure(event.value),
        )
        choice.props('dense no-caps unelevated role=group aria-label="What colours stand for"')
        chosen = chosen_view(views)
        self._map = ViewMap(
            views, up=up, measure=self._measure, chosen=chosen.index if chosen else None
        )
        self._map.on_choose(self._choose)
        self._list_worst()

    def _show_measure(self, measure: Measure) -> None:
        self._measure = measure
        self._map.show_measure(measure)
        self._list_worst.refresh()
        keep_in_address(by=None if measure == "recall" else measure)

    def _choose(self, index: int) -> None:
        # The index comes from the browser.
        if 0 <= index < len(self._views):
            self._map.show_chosen(index)
            self._show(self._views[index])

    @ui.refreshable_method
    def _list_worst(self) -> None:
        table = PlainTable(
            f"Views of the worst {self._measure}",
            ["Worst views", "Seen", "#Recall", "#Precision"],
        )
        for view in worst_first(self._views, self._measure)[:_LISTED]:
            with table.row():
                with table.cell():
                    button = ui.button(f"View {view.index}")
                    button.on_click(lambda _, index=view.index: self._choose(index))
                    button.props("flat dense no-caps size=sm")
                table.text(viewpoint(view.direction, self._up))
                table.number(percent(view.recall))
                table.number(percent(view.precision))
