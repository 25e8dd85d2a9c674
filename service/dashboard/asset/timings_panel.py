"""Where the time went."""

from __future__ import annotations

from collections.abc import Mapping

from nicegui import ui

from service.dashboard.frame import panel
from service.dashboard.plain_table import PlainTable
from service.dashboard.wording import seconds


def timings_panel(timings: Mapping[str, float], total: float) -> None:
    """Seconds by stage, in their order, and of the whole job."""
    with panel("Time by stage"):
        longest = max(timings.values(), default=0.0)
        table = PlainTable("Seconds by stage", ["Stage", "#Time", "Share of the longest"])
        for stage, taken in timings.items():
            with table.row():
                table.heading(stage)
                table.number(seconds(taken))
                with table.cell() as cell:
                    cell.classes("bar-cell")
                    share = taken / longest if longest > 0.0 else 0.0
                    ui.element("div").classes("bar-of-time").style(f"width: {100 * share:.1f}%")
        ui.label(f"The whole job took {seconds(total)}.").classes("quiet")
