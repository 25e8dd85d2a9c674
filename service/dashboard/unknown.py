"""A page for what is not there."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from nicegui import ui

from service.dashboard.frame import page_frame
from service.errors import NotFoundError


@contextmanager
def unknown_told() -> Iterator[None]:
    """Around a whole page: says what is not there, or belongs to another tenant."""
    try:
        yield
    except NotFoundError as error:
        with page_frame("Not found", here=""):
            ui.label(f"{error.detail}.")
            ui.link("All assets", "/")
