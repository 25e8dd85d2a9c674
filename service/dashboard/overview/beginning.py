"""What to do first, where there is nothing yet."""

from __future__ import annotations

from nicegui import ui


def beginning(address: str, *, keyed: bool) -> ui.element:
    """The panel; ``address`` is the service's as it was asked for, ``keyed`` if it needs keys."""
    key = ' -H "X-API-Key: $OCCLUDER_KEY"' if keyed else ""
    command = (
        f"curl --data-binary @castle.glb{key} \\\n"
        f'  "{address}/v1/occluders?filename=castle.glb&asset=props/castle"'
    )
    with ui.element("section").classes("panel beginning") as panel:
        ui.label("No asset yet").classes("panel-title").props("role=heading aria-level=2")
        ui.label(
            "An asset is a name for a mesh and its runs. Send a mesh, and it appears here with its "
            "precision and recall; send it again after a change, and its history begins."
        )
        with ui.element("div").classes("row-of-controls"):
            ui.link("Submit a mesh", "/submit").classes("button-link")
            ui.label("or from a shell:").classes("quiet")
        with ui.element("pre").classes("command"):
            ui.label(command)
    return panel
