"""How all assets stand, drawn by the browser: precision against recall, and a table.

The rows live in the browser, which fetches, filters and sorts them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import nicegui
from nicegui.element import Element

from service.dashboard.overview.exports import SOURCE

_CHART = Path(nicegui.__file__).parent / "elements" / "echart" / "dist"

_GRID = Path(nicegui.__file__).parent / "elements" / "aggrid" / "dist"


class Distribution(
    Element,
    component="distribution.js",
    esm={"nicegui-echart": str(_CHART), "occluder-assets": SOURCE},
):
    """A chart with a point for each asset that has both shares; a click opens the asset."""

    def __init__(self) -> None:
        super().__init__()
        self._props["source"] = ""

    def show(self, source: str) -> None:
        """The rows at an address."""
        self._props["source"] = source
        self.update()


class AssetsTable(
    Element,
    component="assets_table.js",
    esm={"nicegui-aggrid": str(_GRID), "occluder-assets": SOURCE},
):
    """Rows live in the browser, which fetches, filters and sorts them.

    ``editable``   whether to offer setting thresholds, ``on_demand`` of an asset's id.
    ``on_export``  with the ids of what is shown, in its order.
    """

    def __init__(
        self,
        *,
        editable: bool,
        on_demand: Callable[[str], None],
        on_export: Callable[[Sequence[str]], None],
    ) -> None:
        super().__init__()
        self._props["editable"] = editable
        self._props["source"] = ""
        self.on("demand", lambda event: on_demand(str(event.args)))
        self.on("export", lambda event: on_export([str(one) for one in event.args]))

    def show(self, source: str) -> None:
        """The rows at an address."""
        self._props["source"] = source
        self.update()
