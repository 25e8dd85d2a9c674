"""Removing assets, and having them back.

What is removed leaves all lists at once, and goes for good with its runs after some days.  Until
then it can be restored.
"""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable, Sequence

from nicegui import run, ui

from service.dashboard.names import show_name
from service.dashboard.notices import showing_refusals
from service.dashboard.plain_table import PlainTable
from service.dashboard.visitor import Visitor
from service.dashboard.wording import moment
from service.jobs.asset import RemovedAsset

RESTORABLE_SECONDS = 7 * 86_400.0
_SHOWN_SECONDS = 20.0


def remove(visitor: Visitor, asset_ids: Sequence[str]) -> None:
    """Waits for the database; raises :class:`~service.errors.ServiceError`."""
    caller = visitor.curator()
    goes, by = time.time() + RESTORABLE_SECONDS, caller.at(visitor.address)
    for asset_id in asset_ids:
        visitor.services.assets.remove_later(caller.tenant, asset_id, goes, by=by)


def restore(visitor: Visitor, asset_ids: Sequence[str]) -> None:
    """Waits for the database; raises :class:`~service.errors.ServiceError`."""
    caller = visitor.curator()
    by = caller.at(visitor.address)
    for asset_id in asset_ids:
        visitor.services.assets.restore(caller.tenant, asset_id, by=by)


class UndoBar:
    """Says what was removed, at the edge of the window, and offers to undo it for a while."""

    def __init__(self, visitor: Visitor, on_changed: Callable[[], Awaitable[None]]) -> None:
        self._visitor, self._on_changed = visitor, on_changed
        self._ids: tuple[str, ...] = ()
        with ui.element("div").classes("undo-bar").props("role=status") as self._bar:
            self._words = ui.label()
            ui.button("Undo", on_click=self._undo).props("no-caps unelevated dense")
        self._bar.visible = False
        self._timer = ui.timer(_SHOWN_SECONDS, self._hide, active=False)

    async def remove(self, names: dict[str, str]) -> None:
        """Remove assets, whose names are given by their ids."""
        self._ids = tuple(names)
        with showing_refusals():
            await run.io_bound(remove, self._visitor, self._ids)
            first = next(iter(names.values()))
            self._words.text = (
                f"Deleted {first}." if len(names) == 1 else f"Deleted {len(names)} assets."
            )
            self._bar.visible = True
            self._timer.activate()
            await self._on_changed()

    async def _undo(self) -> None:
        with showing_refusals():
            await run.io_bound(restore, self._visitor, self._ids)
            self._hide()
            await self._on_changed()

    def _hide(self) -> None:
        self._timer.deactivate()
        self._bar.visible = False


class RemovedPanel:
    """What was removed and can be restored; nothing is shown while there is none."""

    def __init__(
        self, visitor: Visitor, *, editable: bool, on_changed: Callable[[], Awaitable[None]]
    ) -> None:
        self._visitor, self._editable, self._on_changed = visitor, editable, on_changed
        with ui.element("details").classes("panel fold") as self._panel:
            with ui.element("summary"):
                self._title = ui.label().classes("inline")
            self._body = ui.element("div")

    def show(self, removed: Sequence[RemovedAsset]) -> None:
        self._panel.visible = bool(removed)
        self._title.text = f"Deleted assets ({len(removed):,})"
        self._body.clear()
        with self._body:
            table = PlainTable("Deleted assets", ["Asset", "Deleted for good on", ""])
        for one in removed:
            with table.row():
                with table.cell() as cell:
                    cell.classes("name")
                    show_name(one.name)
                table.text(moment(one.goes), "moment")
                with table.cell() as cell:
                    cell.classes("button-cell")
                    if self._editable:
                        self._button(one)

    def _button(self, one: RemovedAsset) -> None:
        async def bring_back() -> None:
            with showing_refusals():
                await run.io_bound(restore, self._visitor, [one.id])
                await self._on_changed()

        button = ui.button("Restore", on_click=bring_back).props("no-caps flat dense")
        button.props["aria-label"] = f"Restore {one.name}"
