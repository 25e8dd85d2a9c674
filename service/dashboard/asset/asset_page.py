"""The page of one asset: its latest run, or another, and the history of all of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import urlencode

from anyio.to_thread import run_sync
from nicegui import ui

from service.dashboard.asset.details import AssetDetail, RunLine, read_asset
from service.dashboard.asset.history_chart import history_chart
from service.dashboard.asset.panels import run_panels
from service.dashboard.changes.thresholds_dialog import Subject, open_thresholds, thresholds_words
from service.dashboard.frame import page_frame, panel
from service.dashboard.jobs.words import KINDS
from service.dashboard.links import Address, keep_in_address
from service.dashboard.notices import showing_unknown
from service.dashboard.visitor import Visitor, current_caller, current_visitor
from service.dashboard.wording import overhang, percent, seconds, whole
from service.jobs.asset import Asset
from service.jobs.job import JobKind

_SELDOM = {"classes": "seldom", "headerClasses": "seldom"}
"""Columns that phones have no room for."""
_COLUMNS: list[dict[str, Any]] = [
    {"name": "when", "label": "Run (UTC)", "field": "when", "align": "left", "sortable": True},
    {"name": "kind", "label": "Kind", "field": "kind", "align": "left"},
    {"name": "verdict", "label": "Verdict", "field": "verdict", "align": "left"},
    {"name": "recall", "label": "Recall", "field": "recall"},
    {"name": "precision", "label": "Precision", "field": "precision"},
    {"name": "worst", "label": "Worst view", "field": "worst", **_SELDOM},
    {"name": "overhang", "label": "Overhang", "field": "overhang", **_SELDOM},
    {"name": "triangles", "label": "Triangles", "field": "triangles", **_SELDOM},
    {"name": "time", "label": "Run time", "field": "time", **_SELDOM},
    {"name": "holds", "label": "Thresholds", "field": "holds", "align": "left"},
    {"name": "options", "label": "Options", "field": "options", "align": "left", **_SELDOM},
    {"name": "version", "label": "Version", "field": "version", "align": "left", **_SELDOM},
]
_RUNS_A_PAGE = 10
_ROWS = (5, 7, 10, 15, 20, 25, 50, 0)
"""Runs that a page may list, as Quasar offers them; 0 is all."""
_HOLDS_WORDS = {True: "met", False: "missed", None: ""}
# Ours; what comes from outside is filled in as text by Vue.
_WHEN_CELL = """<q-td :props="props"><a :href="props.row.address"
    :aria-current="props.row.shown ? 'true' : null">{{ props.value }}</a></q-td>"""
_WORD_CELL = """<q-td :props="props"><span
    :class="{ good: ['met', 'good'].includes(props.value), doubt: props.value === 'weak',
              bad: ['missed', 'unusable'].includes(props.value) }">{{ props.value
    }}</span></q-td>"""
_CHOICE_CELL = """<q-checkbox v-model="props.selected" dense
    :aria-label="`Choose the run of ${props.row.when}`"></q-checkbox>"""
_CHOICE_OF_ALL = """<q-checkbox v-model="props.selected" dense
    aria-label="Choose all runs shown"></q-checkbox>"""
_OPTIONS_CELL = """<q-td :props="props" class="wrapping">{{ props.value }}</q-td>"""


@ui.page("/assets/{asset_id}")
async def asset_page(asset_id: str, run: str | None = None) -> None:
    """``run`` is the job to show in place of the latest run."""
    visitor = current_visitor()
    with showing_unknown():
        detail = await _read(visitor, asset_id, run)
        with page_frame(detail.asset.name, here="/"), ui.element("div").classes("detail"):
            _show(visitor, detail)


async def _read(visitor: Visitor, asset_id: str, job_id: str | None) -> AssetDetail:
    def read() -> AssetDetail:
        return read_asset(visitor.services, visitor.caller().tenant, asset_id, job_id)

    return await run_sync(read)


def _show(visitor: Visitor, detail: AssetDetail) -> None:
    if detail.run is None:
        ui.label("No run of this asset has succeeded yet. Submit a mesh under its name.")
        _demand(visitor, detail)
        return
    shown = detail.run.job.id
    holds = next((line.holds for line in detail.history if line.job_id == shown), None)

    if detail.run.job.kind is JobKind.EVALUATION:
        ui.label(
            "This run is an evaluation. Its occluder was made elsewhere and measured here."
        ).classes("evaluation-note")

    def beside() -> None:
        _demand(visitor, detail, shown)

    run_panels(detail.run, holds, beside=beside)
    history_panel(detail.asset, detail.history, shown)


def _demand(visitor: Visitor, detail: AssetDetail, job_id: str | None = None) -> None:
    """What is demanded, a way to change it for those who may, and where to go on from a run."""
    asset = detail.asset
    with ui.element("div").classes("row-of-controls"):
        ui.label(thresholds_words(asset.demanded)).classes("quiet")
        if current_caller().may_curate:
            subject = Subject(asset.name, asset.id, asset.thresholds, detail.folders)
            ui.button(
                "Thresholds", on_click=lambda: open_thresholds(visitor, subject, _reload)
            ).props("no-caps outline dense")
        if job_id is not None:
            ui.link("Speed against accuracy", f"/tradeoff/{asset.id}")
            ui.link("Run again with other settings", f"/submit?from={job_id}")


async def _reload() -> None:
    ui.navigate.reload()


def history_panel(asset: Asset, history: Sequence[RunLine], shown: str) -> None:
    """Show the runs, newest first; ``shown`` is the one that the page is about."""
    with panel("History"):
        if len(history) > 1:
            history_chart(history, asset.demanded)
        address = Address.of_page()
        rows = [_row(asset.id, line, shown) for line in history]
        table = ui.table(
            rows=rows,
            columns=_COLUMNS,
            row_key="id",
            selection="multiple",
            pagination=_pagination(address, len(rows)),
            on_pagination_change=lambda event: _keep_pagination(event.value),
        ).props("dense flat")
        chosen = address.text("chosen").split(",")
        table.selected = [row for row in rows if row["id"] in chosen]
        table.classes("history")
        table.add_slot("header-selection", _CHOICE_OF_ALL)
        table.add_slot("body-selection", _CHOICE_CELL)
        table.add_slot("body-cell-when", _WHEN_CELL)
        table.add_slot("body-cell-verdict", _WORD_CELL)
        table.add_slot("body-cell-holds", _WORD_CELL)
        table.add_slot("body-cell-options", _OPTIONS_CELL)
        words = ui.label().classes("quiet")
        compare = ui.button("Compare the two").props("no-caps unelevated")

        def choose() -> None:
            count = len(table.selected)
            compare.set_enabled(count == 2)
            words.set_text("" if count == 2 else "Choose two runs to compare them.")

        def keep() -> None:
            choose()
            keep_in_address(chosen=",".join(row["id"] for row in table.selected) or None)

        table.on_select(lambda _: keep())
        compare.on_click(lambda: ui.navigate.to(_comparison(history, table.selected)))
        choose()


def _pagination(address: Address, rows: int) -> dict[str, Any]:
    """As Quasar has it, which runs are listed, and whether the oldest come first."""
    most = address.one_of("rows", _ROWS, _RUNS_A_PAGE)
    pages = range(1, -(-rows // (most or rows)) + 1)
    listed: dict[str, Any] = {"rowsPerPage": most, "page": address.one_of("page", pages, 1)}
    order = address.one_of("sort", ("when", "-when"), None)
    return listed | ({"sortBy": "when", "descending": order == "-when"} if order else {})


def _keep_pagination(listed: Mapping[str, Any]) -> None:
    order = listed.get("sortBy") and ("-when" if listed.get("descending") else "when")
    page, rows = listed.get("page", 1), listed.get("rowsPerPage", _RUNS_A_PAGE)
    keep_in_address(
        page=None if page == 1 else page,
        rows=None if rows == _RUNS_A_PAGE else rows,
        sort=order or None,
    )


def _comparison(history: Sequence[RunLine], selected: Sequence[dict[str, Any]]) -> str:
    """The older one first."""
    chosen = {row["id"] for row in selected}
    newer, older = (line.job_id for line in history if line.job_id in chosen)
    return f"/compare?{urlencode({'a': older, 'b': newer})}"


def _row(asset_id: str, line: RunLine, shown: str) -> dict[str, Any]:
    return {
        "id": line.job_id,
        "address": f"/assets/{asset_id}?{urlencode({'run': line.job_id})}",
        "shown": line.job_id == shown,
        "when": f"{line.created:%Y-%m-%d %H:%M:%S}",
        "kind": KINDS[line.kind],
        "recall": percent(line.recall),
        "precision": percent(line.precision),
        "worst": percent(line.worst_recall),
        "overhang": overhang(line.overhang),
        "verdict": line.verdict or "",
        "triangles": whole(line.triangles),
        "time": seconds(line.seconds),
        "holds": _HOLDS_WORDS[line.holds],
        "options": line.options,
        "version": line.version,
    }
