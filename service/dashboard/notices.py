"""Words to whoever has a page open: what was done, what was not, and what is not there."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from nicegui import ui

from service.dashboard.frame import page_frame
from service.errors import NotFoundError, ServiceError, UnauthenticatedError


def tell(text: str) -> None:
    """That something was done."""
    ui.notify(text, position="bottom", type="positive")


def warn(text: str) -> None:
    """That something was not done; it stays until it is read."""
    ui.notify(text, position="bottom", type="negative", timeout=0, close_button="Close")


@contextmanager
def showing_refusals() -> Iterator[None]:
    """Say what a store refuses, and what to do; who is signed in no more has to sign in again."""
    try:
        yield
    except UnauthenticatedError:
        ui.navigate.reload()
    except ServiceError as refusal:
        warn(". ".join(_capitals(one) for one in (refusal.detail, refusal.remedy) if one))


def _capitals(text: str) -> str:
    return text[:1].upper() + text[1:]


@contextmanager
def showing_unknown() -> Iterator[None]:
    """Around a whole page: says what is not there, or belongs to another tenant."""
    try:
        yield
    except NotFoundError as error:
        with page_frame("Not found", here=""):
            ui.label(f"{error.detail}.")
            ui.link("All assets", "/")
