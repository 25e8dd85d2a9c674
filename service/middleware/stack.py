"""All of it, in order."""

from __future__ import annotations

from starlette.types import ASGIApp

from service.middleware.host_guard import HostGuard
from service.middleware.lingering_close import LingeringClose
from service.middleware.request_log import RequestLog
from service.middleware.security_headers import SecurityHeaders
from service.middleware.turnstile import Turnstile
from service.settings import Settings


def surrounded(app: ASGIApp, settings: Settings) -> ASGIApp:
    """The application within its surroundings.

    It goes around the whole of it, the handler of unexpected errors included, so that no answer
    comes without its headers.
    """
    guarded = SecurityHeaders(HostGuard(app, settings), settings)
    return Turnstile(LingeringClose(RequestLog(guarded)))
