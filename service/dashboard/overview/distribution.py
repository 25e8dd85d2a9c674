"""Precision against recall of all assets, drawn by the browser."""

from __future__ import annotations

from nicegui.element import Element

from service.dashboard.lazy_chart import CHART_LIBRARY
from service.dashboard.overview.exports import SOURCE


class Distribution(
    Element,
    component="distribution.js",
    esm={**CHART_LIBRARY, "occluder-assets": SOURCE},
):
    """A chart that is drawn once it is unfolded, with a point for each asset that has both shares;
    a click opens the asset.

    ``source``  address of the rows.
    """

    def __init__(self, source: str) -> None:
        super().__init__()
        self.props["source"] = source

    def show(self, source: str) -> None:
        """Other rows, at an address."""
        self.props["source"] = source
        self.update()
