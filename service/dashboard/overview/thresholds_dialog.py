"""A dialog to say what is demanded of an asset's runs."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from nicegui import run, ui

from service.dashboard.notices import showing_refusals, tell
from service.dashboard.overview.asset_lines import AssetLine
from service.dashboard.visitor import Visitor
from service.jobs.asset import Asset, Thresholds


def open_demand(
    visitor: Visitor, line: AssetLine | Asset, on_saved: Callable[[], Awaitable[None]]
) -> None:
    """Opens at once; an empty field demands nothing."""
    with ui.dialog(value=True) as dialog, ui.card().classes("demand"):
        dialog.props('aria-label="Thresholds"').on("hide", dialog.delete)
        ui.label("Thresholds of").classes("quiet")
        ui.label(line.name).classes("panel-title name").props("role=heading aria-level=2")
        precision = _share("Least precision, %", line.thresholds.min_precision).props("autofocus")
        recall = _share("Least recall, %", line.thresholds.min_recall)
        overhang = _share("Most overhang, %", line.thresholds.max_overhang)
        ui.label("An empty field demands nothing.").classes("quiet")

        async def save() -> None:
            fields = (precision, recall, overhang)
            if not all(one.validate() for one in fields):
                return
            demanded = Thresholds(*(_of_percent(one.value) for one in fields))

            def store() -> None:
                caller = visitor.curator()
                visitor.services.assets.set_thresholds(
                    caller.tenant, line.id, demanded, by=caller.at(visitor.address)
                )

            with showing_refusals():
                await run.io_bound(store)
                dialog.close()
                tell("The thresholds are set")
                await on_saved()

        with ui.element("div").classes("row-of-controls"):
            ui.button("Save", on_click=save).props("no-caps unelevated")
            ui.button("Cancel", on_click=dialog.close).props("no-caps flat")


def _share(label: str, share: float | None) -> ui.number:
    return ui.number(
        label,
        value=None if share is None else round(100.0 * share, 6),
        min=0,
        max=100,
        step=0.1,
        validation={"Between 0 and 100": lambda value: value is None or 0 <= value <= 100},
    ).props("dense outlined clearable")


def _of_percent(value: float | None) -> float | None:
    return None if value is None else value / 100.0
