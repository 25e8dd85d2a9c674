"""The panel of a scene's job that plays a walk through it."""

from __future__ import annotations

from nicegui import ui

from service.dashboard.asset.details import RunDetail
from service.dashboard.frame import panel
from service.dashboard.walk.walk_view import WalkView
from service.jobs.on_demand import WALK


def walk_panel(run: RunDetail) -> None:
    """Nothing where the job has no walk and none can be made."""
    made = {file.name: file.link for file in run.files}
    links = {**{file.name: file.link for file in run.later}, **made}
    if WALK not in links:
        return
    with panel("Walk"):
        ui.label(
            "A camera walks through the scene. What the occluders hide fades, frame by frame, and "
            "is checked against what is truly visible."
        ).classes("quiet")
        WalkView(links[WALK], made=WALK in made)
