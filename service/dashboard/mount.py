"""NiceGUI within the service's application.

NiceGUI keeps one application a process.  It is set up once and stands behind the gate of whichever
service is open, for those addresses that it has pages or files for; all others stay the API's, with
its refusals.
"""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import cache
from types import SimpleNamespace

import nicegui
import nicegui.ui_run_with as nicegui_start
from fastapi import FastAPI
from nicegui import ui
from starlette.routing import BaseRoute, Match
from starlette.types import ASGIApp, Receive, Scope, Send

from service.dashboard import sign_in
from service.dashboard.asset import asset_page, compare_page
from service.dashboard.frame import ICON
from service.dashboard.gate import Gate
from service.dashboard.icons import ICONS_SCRIPT
from service.dashboard.jobs import job_page, jobs_page
from service.dashboard.overview import exports, overview_page
from service.dashboard.submit import submit_page
from service.dashboard.tradeoff import tradeoff_page

PAGES = (
    overview_page, asset_page, compare_page, submit_page, tradeoff_page, jobs_page, job_page,
)  # fmt: skip
"""Modules whose import makes pages."""

_RECONNECT_SECONDS = 30.0
"""That a page may be out of reach, as a tablet that was put down, before it has to load anew."""


def add_dashboard(app: FastAPI) -> None:
    """Add the pages, to live while the application does.

    ``app.state.services`` has to be there from then on.
    """
    app.include_router(sign_in.router)
    app.include_router(exports.router)
    host = _host()
    app.router.routes.append(_Pages(Gate(host, app)))
    inside = app.router.lifespan_context

    @asynccontextmanager
    async def lifespan(started: FastAPI) -> AsyncIterator[None]:
        # Pages end first: their timers work with the services.
        async with inside(started), host.router.lifespan_context(host):
            yield

    app.router.lifespan_context = lifespan


@cache
def _host() -> FastAPI:
    """What holds NiceGUI's application and starts and stops it."""
    host = FastAPI(openapi_url=None)
    nicegui.run.process_pool_start_method = "spawn"
    # NiceGUI looks for its own server among all objects that there are.  It holds them meanwhile,
    # so that a thread beside it can neither finish a tuple nor commit; this server is not its own.
    vars(nicegui_start)["gc"] = SimpleNamespace(get_objects=list)
    ui.run_with(
        host,
        title="planar-occluder",
        favicon=ICON,
        dark=None,
        language="en-US",
        reconnect_timeout=_RECONNECT_SECONDS,
        tailwind=False,
        show_welcome_message=False,
    )
    # Nothing is fetched that a bar would have to tell of, and the bar has no name.
    nicegui.app.config.quasar_config["loadingBar"]["skipHijack"] = True
    nicegui.app.config.vue_config_script += ICONS_SCRIPT
    return host


class _Pages(BaseRoute):
    """Addresses that NiceGUI has something for."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    def matches(self, scope: Scope) -> tuple[Match, Scope]:
        known = scope["type"] in ("http", "websocket") and any(
            route.matches(scope)[0] is Match.FULL for route in nicegui.app.routes
        )
        return (Match.FULL if known else Match.NONE), {}

    async def handle(self, scope: Scope, receive: Receive, send: Send) -> None:
        await self._app(scope, receive, send)
