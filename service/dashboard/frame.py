"""What surrounds every page: where one is, where one can go, who one is, and its colours."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum

from nicegui import ui
from nicegui.elements.mixins.text_element import TextElement
from nicegui.events import ValueChangeEventArguments

from service.access.key import Caller
from service.dashboard.links import CopyButton
from service.dashboard.names import show_name
from service.dashboard.sign_in import STYLE
from service.dashboard.visitor import current_caller

_PLACES = {"Overview": "/", "Submit": "/submit", "Jobs": "/jobs", "API docs": "/docs"}

_THEME_COOKIE = "occluder_theme"
_THEME_SECONDS = 365 * 86_400
ICON = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32">'
    '<path d="M16 2 29 9v14L16 30 3 23V9z" fill="#0b5cad"/>'
    '<path d="M16 7 24 22H8z" fill="#fff"/></svg>'
)


@contextmanager
def page_frame(title: str, *, here: str) -> Iterator[None]:
    """Around the content of a page; ``here`` is the address in the navigation that it belongs to.

    The title is shown as the page's heading, and may be any text.
    """
    ui.page_title(f"{title} - planar-occluder")
    ui.add_head_html(f'<link rel="stylesheet" href="{STYLE}">')
    ui.colors(primary="#0b5cad", positive="#1a7a3c", negative="#b3261e", warning="#8a5a00")
    with ui.header(elevated=False).classes("bar").props("bordered"):
        ui.link("Skip to the content", "#content").classes("skip-link")
        _brand()
        _navigation(here)
        ui.space()
        theme_switch()
        _whoever(current_caller())
    # NiceGUI's page around it is the main part already.
    with ui.element("div").props('id=content tabindex="-1"').classes("content"):
        with ui.element("div").classes("title-row"):
            with ui.element("h1").classes("title"):
                show_name(title)
            CopyButton()
        yield


@contextmanager
def panel(title: str, *, titled: bool = True) -> Iterator[None]:
    """A part of a page; ``titled`` is whether its title is shown, or only read out."""
    section = ui.element("section").classes("panel")
    section.props["aria-label"] = title
    with section:
        if titled:
            ui.label(title).classes("panel-title").props("role=heading aria-level=2")
        yield


@contextmanager
def folded(title: str) -> Iterator[None]:
    """A part of a page that is folded away until somebody wants it."""
    with ui.element("details").classes("panel fold"):
        TextElement(tag="summary", text=title)
        yield


def _brand() -> None:
    # Our own text, the same for everybody.
    ui.html(ICON, sanitize=False).classes("brand").props('aria-hidden="true"')


def _navigation(here: str) -> None:
    with ui.element("nav").props('aria-label="Pages"').classes("places"):
        for name, address in _PLACES.items():
            link = ui.link(name, address).classes("place")
            if address == here:
                link.props('aria-current="page"')


def _whoever(caller: Caller) -> None:
    """Whose key it is, and the way out; nothing where no key is needed."""
    if caller.key_id is None:
        return
    ui.label(f"{caller.tenant}, {caller.scope}").classes("quiet whoever")
    with ui.element("form").props('method=post action="/sign-out"'):
        ui.button("Sign out").props("flat dense no-caps type=submit").classes("sign-out")


class Theme(StrEnum):
    """What the switch offers."""

    AUTO = "auto"
    LIGHT = "light"
    DARK = "dark"

    @property
    def dark(self) -> bool | None:
        """The theme as NiceGUI has it: None follows the system."""
        return {Theme.AUTO: None, Theme.LIGHT: False, Theme.DARK: True}[self]


def remembered_theme() -> Theme:
    """The theme that the browser remembers for which a page is built."""
    stored = ui.context.client.request.cookies.get(_THEME_COOKIE, "")
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
            f"document.cookie = '{_THEME_COOKIE}={chosen}; path=/; max-age={_THEME_SECONDS}; "
            "SameSite=Strict'"
        )

    names = {Theme.AUTO: "Auto", Theme.LIGHT: "Light", Theme.DARK: "Dark"}
    with ui.element("div").classes("theme"):
        ui.label("Colours:").props("aria-hidden=true")
        ui.select(
            {str(one): name for one, name in names.items()}, value=str(theme), on_change=change
        ).props('dense borderless options-dense aria-label="Colours"').classes("theme-switch")
