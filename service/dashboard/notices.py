"""Words to whoever has a page open: what was done, what was not, and what is not there."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from nicegui import ui

from service.dashboard.frame import page_frame
from service.dashboard.jobs.words import sentence
from service.errors import NotFoundError, ServiceError, UnauthenticatedError


def tell(text: str) -> None:
    """That something was done."""
    ui.notify(text, position="bottom", type="positive")


_CLOSE = {"label": "Close", "color": "white", "noCaps": True}
"""Said in full: a button of no colour takes the accent, which cannot be seen on red."""


def warn(text: str) -> None:
    """That something was not done; it stays until it is read."""
    ui.notify(text, position="bottom", type="negative", timeout=0, actions=[_CLOSE])


class StandingWarning:
    """At most one at a time, which stays until it is read or no longer true."""

    def __init__(self) -> None:
        self._shown: ui.notification | None = None

    def show(self, text: str) -> None:
        """In place of the one before."""
        self.take_away()
        self._shown = ui.notification(
            text, position="bottom", type="negative", timeout=None, actions=[_CLOSE]
        )

    def take_away(self) -> None:
        if self._shown is not None and not self._shown.is_deleted:
            self._shown.dismiss()
        self._shown = None


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
        ui.context.client.status_code = 404
        with page_frame("Not found", here=""):
            ui.label(sentence(error.detail))
            ui.link("All assets", "/")
