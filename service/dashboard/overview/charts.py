"""How all assets spread: precision against recall."""

from __future__ import annotations

from pathlib import Path

import nicegui
from nicegui.element import Element

from service.dashboard.overview.exports import SOURCE

_CHART = Path(nicegui.__file__).parent / "elements" / "echart" / "dist"


class Distribution(
    Element,
    component="distribution.js",
    esm={"nicegui-echart": str(_CHART), "occluder-assets": SOURCE},
):
    """One point an asset that has both shares; a click opens it."""

    def __init__(self) -> None:
        super().__init__()
        self._props["source"] = ""

    def show(self, source: str) -> None:
        """The rows at an address."""
        self._props["source"] = source
        self.update()
