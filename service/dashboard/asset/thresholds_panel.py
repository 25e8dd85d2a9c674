"""What is demanded of an asset, and changing it."""

from __future__ import annotations

from collections.abc import Callable

from anyio.to_thread import run_sync
from nicegui import ui

from service.access.key import Scope
from service.dashboard.notices import refusals_told
from service.dashboard.panel import panel
from service.dashboard.session import Visitor
from service.jobs.asset import Thresholds


def thresholds_panel(
    visitor: Visitor, asset_id: str, thresholds: Thresholds, changed: Callable[[], None]
) -> None:
    """``changed`` is called once new ones are stored."""
    with panel("Thresholds"):
        with ui.element("div").classes("row-of-controls"):
            precision = _share("Least precision, %", thresholds.min_precision)
            recall = _share("Least recall, %", thresholds.min_recall)

            async def store() -> None:
                with refusals_told():
                    wanted = Thresholds(_part(precision.value), _part(recall.value))
                    await run_sync(_store, visitor, asset_id, wanted)
                    changed()

            ui.button("Save", on_click=store).props("no-caps unelevated")
        ui.label("Empty demands nothing. Runs that miss one are red, here and in lists.").classes(
            "quiet"
        )


def _store(visitor: Visitor, asset_id: str, thresholds: Thresholds) -> None:
    caller = visitor.caller(Scope.WRITE)
    visitor.services.assets.set_thresholds(caller.tenant, asset_id, thresholds)


def _share(label: str, share: float | None) -> ui.number:
    value = None if share is None else round(100.0 * share, 6)
    return (
        ui.number(label, value=value, min=0, max=100, step=0.1)
        .props("dense outlined clearable")
        .classes("threshold")
    )


def _part(percents: float | None) -> float | None:
    """A share of 0 to 1 from what was typed."""
    return None if percents is None else min(1.0, max(0.0, percents / 100.0))
