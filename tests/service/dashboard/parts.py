"""Components on pages of their own, with files from a folder: ``uvicorn ...parts:make_app``."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import get_args

from fastapi import FastAPI
from nicegui import app as pages
from nicegui import ui

import service.dashboard
from service.dashboard.view_map import ViewMap
from service.dashboard.viewer import MeshViewer, Mode, Shares
from service.dashboard.views import views_of

FOLDER = "PARTS_FOLDER"
STYLE = Path(service.dashboard.__file__).with_name("style.css")


def make_app() -> FastAPI:
    """Every page shows what the component has told Python."""
    app = FastAPI()
    pages.add_static_files("/files", os.environ[FOLDER])
    ui.run_with(app, title="parts", show_welcome_message=False)
    return app


@ui.page("/viewer")
def show_viewer(
    mode: Mode = "overlay",
    original: str = "original.glb",
    finest: str = "lod0.glb",
    dark: bool = False,
    loss: str | None = None,
) -> None:
    """One viewer with two levels, and a control for each thing that a page can ask of it."""
    ui.add_css(STYLE)
    ui.dark_mode(dark)
    viewer = MeshViewer(
        f"/files/{original}",
        [f"/files/{finest}", "/files/lod1.glb"],
        label="castle",
        mode=mode,
        loss=f"/files/{loss}" if loss else None,
    )
    ready, counted = ui.label(), ui.label()
    ready.props("data-testid=ready")
    counted.props("data-testid=counted")
    viewer.on("ready", lambda event: ready.set_text(f"{event.args['occluder']}"))

    def show(shares: Shares) -> None:
        counted.set_text(f"{shares.both} {shares.missed} {shares.wrong} {shares.pixels}")

    viewer.on_counted(show)
    for one in get_args(Mode):
        ui.button(one, on_click=lambda _, one=one: viewer.show_mode(one))
    ui.button("coarser", on_click=lambda: viewer.show_level(1))
    ui.button("wireframe", on_click=lambda: viewer.show_wireframe(True))
    aim = ui.input("direction")
    ui.button("look", on_click=lambda: viewer.look_along(_direction(aim.value)))


@ui.page("/pair")
def show_pair() -> None:
    """Two viewers that look from the same place."""
    ui.add_css(STYLE)
    with ui.grid(columns=2).classes("w-full"):
        for level in (0, 1):
            MeshViewer(
                "/files/original.glb", [f"/files/lod{level}.glb"], label=f"{level}", group="pair",
                mode="silhouette",
            )  # fmt: skip


def _direction(text: str) -> tuple[float, float, float]:
    x, y, z = map(float, text.split())
    return x, y, z


@ui.page("/view-map")
def show_view_map() -> None:
    """The map of the castle's views, and the index of the one that was chosen."""
    ui.add_css(STYLE)
    views = views_of(json.loads((Path(os.environ[FOLDER]) / "report.json").read_text()))
    chosen = ui.label().props("data-testid=chosen")
    view_map = ViewMap(views, up="y", measure="recall")
    view_map.style("width: 520px")

    def choose(index: int) -> None:
        chosen.set_text(str(index))
        view_map.show_chosen(index)

    view_map.on_choose(choose)
    ui.button("precision", on_click=lambda: view_map.show_measure("precision"))
