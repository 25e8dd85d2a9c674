"""Light, dark, or as the system has it; remembered by the browser."""

from __future__ import annotations

from enum import StrEnum

from nicegui import ui
from nicegui.events import ValueChangeEventArguments

_COOKIE = "occluder_theme"
_SECONDS = 365 * 86_400


class Theme(StrEnum):
    """What the switch offers."""

    AUTO = "auto"
    LIGHT = "light"
    DARK = "dark"

    @property
    def dark(self) -> bool | None:
        """As NiceGUI has it: None follows the system."""
        return {Theme.AUTO: None, Theme.LIGHT: False, Theme.DARK: True}[self]


def remembered_theme() -> Theme:
    """Of the browser that a page is built for."""
    stored = ui.context.client.request.cookies.get(_COOKIE, "")
    return Theme(stored) if stored in list(Theme) else Theme.AUTO


def theme_switch() -> None:
    """The control; its page takes on the remembered theme."""
    theme = remembered_theme()
    mode = ui.dark_mode(theme.dark)

    def change(event: ValueChangeEventArguments[str]) -> None:
        chosen = Theme(event.value)
        mode.value = chosen.dark
        # From our own words alone, by way of the enumeration.
        ui.run_javascript(
            f"document.cookie = '{_COOKIE}={chosen}; path=/; max-age={_SECONDS}; SameSite=Strict'"
        )

    names = {Theme.AUTO: "Auto", Theme.LIGHT: "Light", Theme.DARK: "Dark"}
    ui.select(
        {str(one): name for one, name in names.items()}, value=str(theme), on_change=change
    ).props('dense borderless options-dense aria-label="Colours"').classes("theme-switch")
