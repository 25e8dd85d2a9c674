"""What the occluder had to stay within, and what the owner should know."""

from __future__ import annotations

from collections.abc import Sequence

from nicegui import ui

from service.dashboard.asset.details import Solid
from service.dashboard.frame import panel
from service.dashboard.plain_table import PlainTable
from service.dashboard.wording import length, percent

_CLOSED_BY = {"ground": "the ground", "smallest_hole": "openings below the smallest hole"}


def solid_panel(solid: Solid, deviation: float | None, error_bound: float | None) -> None:
    """``deviation`` as measured and ``error_bound`` as promised, in the mesh's units."""
    with panel("The solid"):
        table = PlainTable("The solid that the occluder stays within", ["What", "Value"])
        rows = [
            ("Voxels", " x ".join(map(str, solid.cells))),
            ("Voxel size", length(solid.cell_size)),
            ("Inside, of the grid", percent(solid.inside)),
            *((f"Closed by {_CLOSED_BY.get(by, by)}", f"{length(volume)} added")
              for by, volume in solid.closed_by),
            ("Largest deviation found", length(deviation)),
            ("Error bound promised", length(error_bound)),
            *((f"Dropped triangles, {why.replace('_', ' ')}", f"{count:,}")
              for why, count in solid.dropped.items()),
        ]  # fmt: skip
        for name, value in rows:
            with table.row():
                table.heading(name)
                table.text(value)
        if not solid.closed_by:
            ui.label("Nothing was closed: the mesh is as tight as it came.").classes("quiet")


def warnings_panel(warnings: Sequence[str]) -> None:
    """A sentence each, at least one."""
    with panel("Warnings"), ui.element("ul").classes("warnings"):
        for warning in warnings:
            with ui.element("li"):
                ui.label(warning).classes("name")
