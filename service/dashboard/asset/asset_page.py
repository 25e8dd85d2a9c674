"""The page of one asset."""

from __future__ import annotations

from anyio.to_thread import run_sync
from nicegui import ui

from service.access.key import Scope
from service.dashboard.asset.details import AssetDetail, read_asset
from service.dashboard.asset.history_panel import history_panel
from service.dashboard.asset.run_panels import run_panels
from service.dashboard.frame import page_frame
from service.dashboard.overview.thresholds_dialog import open_demand
from service.dashboard.unknown import unknown_told
from service.dashboard.visitor import Visitor, current_caller, current_visitor
from service.dashboard.wording import percent
from service.jobs.asset import Asset, Thresholds


@ui.page("/assets/{asset_id}")
async def asset_page(asset_id: str, run: str | None = None) -> None:
    """``run`` is the job to show in place of the latest run."""
    visitor = current_visitor()
    with unknown_told():
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
        _demand(visitor, detail.asset)
        return
    shown = detail.run.job.id
    holds = next((line.holds for line in detail.history if line.job_id == shown), None)

    def beside() -> None:
        _demand(visitor, detail.asset, shown)

    run_panels(detail.run, holds, beside=beside)
    history_panel(detail.asset.id, detail.history, shown)


def _demand(visitor: Visitor, asset: Asset, job_id: str | None = None) -> None:
    """What is demanded, a way to change it for those who may, and where to go on from a run."""
    with ui.element("div").classes("row-of-controls"):
        ui.label(_words(asset.thresholds)).classes("quiet")
        if current_caller().may(Scope.WRITE):
            ui.button("Thresholds", on_click=lambda: open_demand(visitor, asset, _reload)).props(
                "no-caps outline dense"
            )
        if job_id is not None:
            ui.link("Speed against accuracy", f"/tradeoff/{asset.id}")
            ui.link("Run again with other settings", f"/submit?from={job_id}")


def _words(thresholds: Thresholds) -> str:
    pairs = [("precision", thresholds.min_precision), ("recall", thresholds.min_recall)]
    asked = [f"{name} {percent(least, 2)}" for name, least in pairs if least is not None]
    return f"Demanded: {' and '.join(asked)}." if asked else "Nothing is demanded."


async def _reload() -> None:
    ui.navigate.reload()
