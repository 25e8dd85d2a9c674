"""The page of one asset."""

from __future__ import annotations

from anyio.to_thread import run_sync
from nicegui import ui

from service.dashboard.asset.history_panel import history_panel
from service.dashboard.asset.rows import AssetDetail, read_asset
from service.dashboard.asset.run_panels import run_panels
from service.dashboard.asset.thresholds_panel import thresholds_panel
from service.dashboard.frame import page_frame
from service.dashboard.session import Visitor, current_visitor
from service.dashboard.unknown import unknown_told


@ui.page("/assets/{asset_id}")
async def asset_page(asset_id: str, run: str | None = None) -> None:
    """``run`` is the job to show in place of the latest run."""
    visitor = current_visitor()
    with unknown_told():
        detail = await _read(visitor, asset_id, run)
        with page_frame(detail.asset.name, here="/"):
            _show(visitor, detail)


async def _read(visitor: Visitor, asset_id: str, job_id: str | None) -> AssetDetail:
    def read() -> AssetDetail:
        return read_asset(visitor.services, visitor.caller().tenant, asset_id, job_id)

    return await run_sync(read)


def _show(visitor: Visitor, detail: AssetDetail) -> None:
    asset = detail.asset
    if detail.run is None:
        ui.label("No run of this asset has succeeded yet. Submit a mesh under its name.")
    else:
        holds = next(
            (line.holds for line in detail.history if line.job_id == detail.run.job.id), None
        )
        run_panels(detail.run, holds)
        history_panel(asset.id, detail.history, detail.run.job.id)
    thresholds_panel(visitor, asset.id, asset.thresholds, ui.navigate.reload)
