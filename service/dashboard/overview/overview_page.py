"""The page of all assets: what needs attention first, then all of them, to be searched and sorted.

Where there is none yet it says what to do first.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from datetime import UTC, datetime, timedelta

from anyio.to_thread import run_sync
from nicegui import run, ui

from service.dashboard.changes.removal import RemovedPanel, UndoBar
from service.dashboard.changes.rename_dialog import open_rename
from service.dashboard.changes.thresholds_dialog import Subject, open_thresholds
from service.dashboard.frame import page_frame, panel
from service.dashboard.links import CopyButton, keep_in_address
from service.dashboard.overview.asset_lines import (
    AssetLine,
    Overview,
    midnight,
    shared_overview,
    summary,
)
from service.dashboard.overview.asset_list import AssetList
from service.dashboard.overview.attention_panel import AttentionPanel
from service.dashboard.overview.distribution import Distribution
from service.dashboard.overview.exports import csv_of, rows_address, rows_of
from service.dashboard.visitor import Visitor, current_caller, current_visitor
from service.errors import ServiceError, UnauthenticatedError
from service.jobs.asset import Thresholds, folder_path

_WEEK = timedelta(days=7)
_LOOK_SECONDS = 4.0
"""Between two looks for new results."""

_FIRST_ROWS = 40
"""Rows that come with the page itself, to be drawn before all others are there."""


@ui.page("/")
async def overview_page(since: str = "") -> None:
    """``since``  the day that things are compared with; the other parameters are the list's."""
    visitor = current_visitor()
    day = _day(since)
    overview = await run_sync(_read, visitor, day)
    with page_frame("Overview", here="/"):
        _Page(visitor, overview)


def _day(text: str) -> datetime:
    """A week ago, unless the text is a day."""
    try:
        return midnight(text)
    except ValueError:
        return datetime.now(UTC).replace(hour=0, minute=0, second=0, microsecond=0) - _WEEK


def _read(visitor: Visitor, since: datetime) -> Overview:
    """What there is now; waits for the database."""
    return shared_overview(visitor.services.assets, visitor.caller().tenant, since)


class _Page:
    """The panels of one open page, and what they show."""

    def __init__(self, visitor: Visitor, overview: Overview) -> None:
        self._visitor = visitor
        self._overview = overview
        self._shown = 0
        self._since = overview.since
        settings, request = visitor.services.settings, ui.context.client.request
        source, count = rows_address(overview.since, self._shown), len(overview.lines)
        editable = current_caller().may_curate
        self._figures = ui.label(summary(overview)).classes("quiet").props("role=status")
        self._beginning = beginning(
            settings.public_url or str(request.base_url).rstrip("/"), keyed=settings.keys_needed
        )
        self._panels = ui.element("div").classes("stacked")
        with self._panels:
            self._attention = AttentionPanel(overview, self._choose_since, self._show_kind)
            with panel("Assets", titled=False):
                self._list = AssetList(
                    source, rows_of(overview, _FIRST_ROWS), count,
                    limits=_limits(overview), editable=editable, asked=self,
                )  # fmt: skip
            with panel("Precision against recall", titled=False):
                self._distribution = Distribution(source)
        self._removed = RemovedPanel(visitor, editable=editable, on_changed=self._look)
        self._undo = UndoBar(visitor, self._look)
        self._choose_panels()
        ui.timer(_LOOK_SECONDS, self._look)

    async def _look(self) -> None:
        """Show what is new, if anything is."""
        try:
            overview = await run.io_bound(_read, self._visitor, self._since)
        except UnauthenticatedError:
            ui.navigate.reload()
        except ServiceError as refusal:
            self._figures.text = f"These figures may be out of date: {refusal.detail}."
        else:
            if overview not in (None, self._overview) and overview.since == self._since:
                self._show(overview)

    def _show(self, overview: Overview) -> None:
        self._overview = overview
        self._shown += 1
        source = rows_address(overview.since, self._shown)
        self._figures.text = summary(overview)
        self._choose_panels()
        self._list.show(source, len(overview.lines), _limits(overview))
        self._distribution.show(source)
        self._attention.show(overview)

    def _choose_panels(self) -> None:
        there = bool(self._overview.lines or self._overview.failed)
        self._panels.visible, self._beginning.visible = there, not there
        self._removed.show(self._overview.removed)

    async def _choose_since(self, since: datetime) -> None:
        self._since = since
        keep_in_address(since=since.date().isoformat())
        await self._look()

    def _show_kind(self, kind: str) -> None:
        self._list.show_kind(kind)

    def demand(self, asset_id: str) -> None:
        line = self._lines.get(asset_id)
        if line is not None:
            subject = Subject(line.name, line.id, line.thresholds, self._overview.folders)
            open_thresholds(self._visitor, subject, self._look)

    def demand_folder(self, folder: str) -> None:
        try:
            path = folder_path(folder)
        except ValueError:  # from an address that somebody has changed
            return
        folders = self._overview.folders
        subject = Subject(path, None, folders.get(path, Thresholds()), folders)
        open_thresholds(self._visitor, subject, self._look)

    def rename(self, asset_id: str) -> None:
        line = self._lines.get(asset_id)
        if line is not None:
            open_rename(self._visitor, line.id, line.name, self._look)

    async def remove(self, asset_ids: Sequence[str]) -> None:
        lines = self._lines
        names = {one: lines[one].name for one in asset_ids if one in lines}
        if names:
            await self._undo.remove(names)

    def export(self, asset_ids: Sequence[str]) -> None:
        """Send a table of the assets, in the order in which they are shown."""
        lines = self._lines
        chosen = (lines[one] for one in asset_ids if one in lines)
        ui.download.content(csv_of(chosen), "assets.csv", "text/csv")

    @property
    def _lines(self) -> Mapping[str, AssetLine]:
        """By their ids."""
        return {line.id: line for line in self._overview.lines}


def _limits(overview: Overview) -> Mapping[str, Mapping[str, float | None]]:
    return {path: asdict(limits) for path, limits in overview.folders.items()}


def beginning(address: str, *, keyed: bool) -> ui.element:
    """The panel; ``address`` is the service's as it was asked for, ``keyed`` if it needs keys."""
    key = ' -H "X-API-Key: $OCCLUDER_KEY"' if keyed else ""
    command = (
        f"curl --data-binary @castle.glb{key} \\\n"
        f'  "{address}/v1/occluders?filename=castle.glb&asset=props/castle"'
    )
    with ui.element("section").classes("panel beginning") as panel:
        ui.label("No assets yet").classes("panel-title").props("role=heading aria-level=2")
        ui.label(
            "An asset is a name for a mesh and its runs. Send a mesh under a name, and the asset "
            "appears here with its recall and precision. Send the mesh again after a change to "
            "compare the two runs."
        )
        with ui.element("div").classes("row-of-controls"):
            ui.link("Submit a mesh", "/submit").classes("button-link")
            ui.label("or from a shell:").classes("quiet")
        with ui.element("div").classes("command-row"):
            with ui.element("pre").classes("command").props("tabindex=0"):
                ui.label(command)
            CopyButton("Copy", command)
    return panel
