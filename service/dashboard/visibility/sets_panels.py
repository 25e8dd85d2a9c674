"""All that there is to see of visible sets, put together by :func:`sets_panels`.

numbers   what came out, in a line; how, in a sentence; the file
cells     in plan, and in 3D what the chosen one may see
parts     which slices are drawn of what the chosen one may see, or from which height it is seen
largest   the cells that see most, in a table
"""

from __future__ import annotations

from collections.abc import Sequence

from nicegui import ui
from nicegui.events import ValueChangeEventArguments

from service.dashboard.asset.panels import (
    downloads_panel,
    file_size,
    show_number,
    timings_panel,
    warnings_panel,
)
from service.dashboard.frame import panel
from service.dashboard.links import Address, keep_in_address
from service.dashboard.plain_table import PlainTable
from service.dashboard.view_map import Axis
from service.dashboard.viewer import MeshViewer, Mode
from service.dashboard.views import Direction
from service.dashboard.visibility.cell_parts import CellParts
from service.dashboard.visibility.cells_plan import CellsPlan
from service.dashboard.visibility.sets_detail import FILE, VIEW, SetsDetail
from service.dashboard.wording import lengths_alike, percent, seconds, side_by_side, whole
from service.schemas.result import ResultFile

_FROM_ABOVE: dict[Axis, Direction] = {
    "x": (-0.75, 0.35, -0.56), "y": (-0.35, -0.75, -0.56), "z": (-0.35, 0.56, -0.75),
}  # fmt: skip
"""Lines of sight by the axis that is up, steep enough that streets are seen."""

_MODES: dict[Mode, str] = {"transparent": "Rest as a ghost", "alone": "Rest hidden"}
_USUAL: Mode = "transparent"


def sets_panels(sets: SetsDetail, files: Sequence[ResultFile]) -> None:
    """Show a job of visible sets that has succeeded."""
    _numbers(sets)
    ui.label(sets.way)
    with ui.element("div").classes("row-of-controls"):
        link = ui.link(f"Download {FILE}, {file_size(sets.bytes_)}", sets.link)
        link.classes("download-button").props["download"] = True
    if sets.summary.warnings:
        warnings_panel(sets.summary.warnings)
    cells = _Cells(sets)
    if sets.parts:
        cells.parts_panel()
    with ui.element("div").classes("run-panels"):
        if sets.largest:
            cells.largest_panel()
        timings_panel(sets.summary.timings, sets.summary.seconds)
        downloads_panel([file for file in files if not file.name.startswith(VIEW)])


def _numbers(sets: SetsDetail) -> None:
    report = sets.report
    with ui.element("dl").classes("numbers"):
        show_number("Culled on average", percent(report["culled_share"]))
        show_number("Cells", whole(report["cells"]))
        if report["left"]:
            show_number("Not computed", whole(report["left"]), "doubt")
        show_number("Objects", whole(report["objects"]))
        if sets.largest:
            show_number("Largest set", whole(sets.largest[0].objects))
        show_number("Bytes per cell", f"{sets.bytes_a_cell:,.0f}")
        show_number("Time per cell", side_by_side(report["seconds_a_cell"]))
        show_number("Run time", seconds(sets.summary.seconds))


class _Cells:
    """Plan, 3D view and table speak of the same cell, at first that with the largest set."""

    def __init__(self, sets: SetsDetail) -> None:
        self._sets = sets
        self._parts: CellParts | None = None
        address = Address.of_page()
        self._largest = sets.largest[0].cell if sets.largest else 0
        self._first = first = address.one_of("cell", range(sets.report["cells"]), self._largest)
        mode = address.one_of("mode", _MODES, _USUAL)
        with ui.element("div").classes("halves"):
            with panel("Cells by the size of their sets"):
                self._plan = CellsPlan(
                    sets.base,
                    chosen=first,
                    label=f"Plan of {sets.job.name}: view cells by how many objects each may see. "
                    "Arrow keys go to the next cell, Enter shows its set, Home the largest.",
                )
                self._plan.on_choose(self._choose)
            with panel("What the chosen cell may see"):
                modes = ui.toggle(dict(_MODES), value=mode, on_change=self._show_mode)
                modes.props('dense no-caps unelevated role=group aria-label="What is shown"')
                self._viewer = MeshViewer(
                    f"{sets.base}/scene.glb",
                    sets=sets.base,
                    cell=first,
                    up=sets.up,
                    mode=mode,
                    direction=_FROM_ABOVE[sets.up],
                    label=f"{sets.job.name}, what a cell may see of it",
                )

    def _choose(self, cell: int) -> None:
        # The number comes from the browser.
        if 0 <= cell < self._sets.report["cells"]:
            self._plan.show_chosen(cell)
            self._viewer.show_cell(cell)
            if self._parts is not None:
                self._parts.show_chosen(cell)
            keep_in_address(cell=None if cell == self._largest else cell)

    def _show_mode(self, event: ValueChangeEventArguments[Mode]) -> None:
        self._viewer.show_mode(event.value)
        keep_in_address(mode=None if event.value == _USUAL else event.value)

    def parts_panel(self) -> None:
        """What is drawn of the objects that the chosen cell may see."""
        with panel("What is drawn of its objects"):
            self._parts = CellParts(self._sets.base, chosen=self._first)

    def largest_panel(self) -> None:
        """The cells that see most, each with a button that shows it."""
        with panel("Cells that see most"), ui.element("div").classes("wide-table"):
            columns = ["Show", "#Objects", "#Of all", "#x", "#y", "#z"]
            table = PlainTable("Cells that see most", columns)
        middles = [one.middle for one in self._sets.largest]
        columns_alike = map(lengths_alike, zip(*middles, strict=True))
        for one, place in zip(self._sets.largest, zip(*columns_alike, strict=True), strict=True):
            with table.row():
                with table.cell() as cell:
                    cell.classes("button-cell")
                    button = ui.button(f"Cell {one.cell}")
                    button.on_click(lambda _, cell=one.cell: self._choose(cell))
                    button.props("flat dense no-caps size=sm")
                share = percent(one.objects / self._sets.report["objects"])
                for text in (whole(one.objects), share, *place):
                    table.number(text).classes("number-text")
