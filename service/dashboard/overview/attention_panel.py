"""The panel of what needs attention first."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from datetime import datetime

from nicegui import ui
from nicegui.events import ValueChangeEventArguments

from service.dashboard.frame import panel
from service.dashboard.names import name_link
from service.dashboard.overview.asset_lines import Holds, Overview, midnight
from service.dashboard.overview.attention import Matter, Reason, matters

_MOST = 6
"""Matters that are shown; the list of assets has all."""

_ALL = {
    Reason.FAILED: "All {} failed uploads",
    Reason.MISSED: "All {} below a threshold",
    Reason.WORSE: "All {} that got worse",
}


class AttentionPanel:
    """``on_since`` hears of another day to compare with, ``on_kind`` which assets to list."""

    def __init__(
        self,
        overview: Overview,
        on_since: Callable[[datetime], Awaitable[None]],
        on_kind: Callable[[str], None],
    ) -> None:
        self._on_since, self._on_kind = on_since, on_kind
        with panel("Needs attention", titled=False):
            with ui.element("div").classes("row-of-controls"):
                ui.label("Needs attention").classes("panel-title").props(
                    "role=heading aria-level=2"
                )
                ui.space()
                ui.input(
                    "Worse since", value=overview.since.date().isoformat(),
                    on_change=self._choose,
                ).props("type=date dense outlined stack-label").classes("date")  # fmt: skip
            self._body = ui.element("div").classes("matters")
        self.show(overview)

    def show(self, overview: Overview) -> None:
        found = matters(overview)
        self._body.clear()
        with self._body:
            if not found:
                ui.label(
                    "Nothing. No upload failed, no asset is below a threshold, none got worse."
                )
                return
            with ui.element("ul").classes("matter-list"):
                for matter in found[:_MOST]:
                    _show_matter(matter)
            if len(found) > _MOST:
                self._show_rest(overview)

    def _show_rest(self, overview: Overview) -> None:
        """Ways to whole lists, each with the number that is in it."""
        counts = {
            Reason.FAILED: sum(line.failed is not None for line in overview.lines),
            Reason.MISSED: sum(line.holds is Holds.MISSED for line in overview.lines),
            Reason.WORSE: len(overview.worse),
        }
        with ui.element("div").classes("row-of-controls"):
            for reason, title in _ALL.items():
                if counts[reason]:
                    button = ui.button(title.format(f"{counts[reason]:,}"))
                    button.props("no-caps flat dense")
                    button.on_click(lambda _, one=reason: self._on_kind(one))

    async def _choose(self, event: ValueChangeEventArguments[str | None]) -> None:
        try:
            since = midnight(event.value or "")
        except ValueError:  # half a date, while it is typed
            return
        await self._on_since(since)


def _show_matter(matter: Matter) -> None:
    with ui.element("li").classes(f"matter {matter.reason}"):
        with ui.element("div").classes("matter-name"):
            name_link(matter.name, matter.address)
        ui.label(matter.words).classes("matter-words name")
        if matter.link != matter.address:
            ui.link(matter.link_name, matter.link).props["aria-label"] = (
                f"{matter.link_name}: {matter.name}"
            )
