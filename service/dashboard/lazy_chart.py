"""A chart of ECharts, whose library a page loads when the chart comes into sight."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import nicegui
from nicegui.element import Element

CHART_LIBRARY = {"nicegui-echart": str(Path(nicegui.__file__).parent / "elements/echart/dist")}
"""Where pages import ECharts from."""


class LazyChart(Element, component="lazy_chart.js", esm=CHART_LIBRARY):
    """``options``  as ECharts takes them.
    ``label``    what the chart shows, for those who do not see it.
    """

    def __init__(self, options: Mapping[str, Any], label: str) -> None:
        super().__init__()
        self.props["options"] = dict(options)
        self.props["label"] = label
