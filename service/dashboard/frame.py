"""What surrounds every page: where one is, where one can go, and who one is."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from nicegui import ui

from service.access.key import Caller
from service.dashboard.icon import ICON
from service.dashboard.sign_in import STYLE
from service.dashboard.theme import theme_switch
from service.dashboard.visitor import current_caller

_PLACES = {"Overview": "/", "Submit": "/submit", "Jobs": "/jobs", "API docs": "/docs"}


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
        ui.label(title).props("role=heading aria-level=1").classes("title")
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
