"""A part of a page, with a heading."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from nicegui import ui


@contextmanager
def panel(title: str) -> Iterator[None]:
    """Around its content."""
    section = ui.element("section").classes("panel")
    section.props["aria-label"] = title
    with section:
        ui.label(title).props("role=heading aria-level=2").classes("panel-title")
        yield
