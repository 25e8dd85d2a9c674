"""A scene's walk, with the player that pages of ``occluder cull`` have."""

from __future__ import annotations

from pathlib import Path

from nicegui.element import Element

import simplifier
from service.dashboard.links import ADDRESS

PLAYER = Path(simplifier.__file__).parent / "culling" / "player"


class WalkView(
    Element,
    component="walk_view.js",
    esm={"occluder-address": ADDRESS, "occluder-walk": str(PLAYER)},
):
    """Nothing is fetched until somebody asks for it, or has a link to one of its frames.

    ``address``  of the file :data:`service.jobs.on_demand.WALK` of a job; ``made`` whether it is
                 there, or is made when it is asked for.
    """

    def __init__(self, address: str, *, made: bool) -> None:
        super().__init__()
        self.props["address"] = address
        self.props["made"] = made
