"""One process that answers: socket, signals, protocol and log around the application."""

from __future__ import annotations

import asyncio
import logging
import os
import resource
import signal
import socket
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from functools import partial
from types import FrameType
from typing import cast

import uvicorn
from fastapi import FastAPI

from service.app import create_app
from service.cli.protocol import ConnectionLimits, Hangup, HttpProtocol
from service.errors import SettingsError
from service.logs import log_as
from service.settings import Settings
from service.storage.data_folder import DataFolder
from service.storage.key_store import SqlKeyStore
from service.storage.opening import open_database
from service.tracing import tracing
from simplifier.cli.plugin import print_text

_IDLE = 75  # seconds that a connection without a request is kept: longer than proxies keep theirs
_GRACE = 3  # seconds that answers under way have once the server is to end
_LAST_GRACE = 6  # seconds after which what still goes on is broken off, with a word in the log
_WAITING = 2048  # connections that the system accepts ahead of us
_MOST_FILES = 65_536


def run_server(settings: Settings) -> None:
    """Serve until a signal says to end.

    Raises :class:`~service.errors.SettingsError` where it cannot listen or the data folder cannot
    be used.
    """
    _check_keys(settings)
    _begin_log(settings)
    _allow_files()
    listener = _bind(settings)
    try:
        app = create_app(settings)
        config = uvicorn.Config(
            app, http=_protocol(settings, app), lifespan="off", log_config=None, access_log=False,
            server_header=False, proxy_headers=False, backlog=_WAITING, timeout_keep_alive=_IDLE,
            timeout_graceful_shutdown=_LAST_GRACE,
        )  # fmt: skip
        config.load()  # the pages look at it when the application starts
        server = _Server(config, _address(settings.host, listener))

        async def serve() -> None:
            # Not by uvicorn's lifespan, which turns what goes wrong into a traceback in the log.
            with server.capture_signals():
                async with app.router.lifespan_context(app):
                    if not server.should_exit:
                        await server.serve([listener])

        with tracing(), asyncio.Runner(loop_factory=config.get_loop_factory()) as runner:
            runner.run(serve())
    finally:
        listener.close()


def _protocol(settings: Settings, app: FastAPI) -> type[asyncio.Protocol]:
    """What makes the protocol of each connection."""

    def count(reason: Hangup) -> None:
        app.state.services.metrics.count_hangup(reason)

    limits = ConnectionLimits(download_seconds=settings.download_idle_seconds)
    made = partial(HttpProtocol, limits=limits, on_hangup=count)
    return cast("type[asyncio.Protocol]", made)  # uvicorn only calls it


class _Server(uvicorn.Server):
    """Ends by the first signal in good order, by the second at once."""

    def __init__(self, config: uvicorn.Config, address: str) -> None:
        super().__init__(config)
        self._address = address

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        print_text(f"occluder serves at {self._address}")

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        asyncio.get_running_loop().call_later(_GRACE, self._hang_up)
        await super().shutdown(sockets)

    def _hang_up(self) -> None:
        """End what would go on for as long as its job does: streams of events, and waiting."""
        for connection in list(self.server_state.connections):
            connection.transport.abort()

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Do as uvicorn does, but do not raise a signal again at the end that was obeyed."""
        numbers = (signal.SIGINT, signal.SIGTERM)
        before = {number: signal.signal(number, self.handle_exit) for number in numbers}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        if self.should_exit:
            # Workers end with this process; their jobs are taken up again after the next start.
            os._exit(128 + sig)
        self.should_exit = True


def _check_keys(settings: Settings) -> None:
    """Refuse to serve nobody: where a key is needed there has to be one."""
    if not settings.keys_needed:
        return
    if settings.database_url is None:
        DataFolder(settings.data).make()
    with closing(open_database(settings)) as database:
        known = SqlKeyStore(database).keys()
        now = time.time()
        if not any(key.counts_at(now) for key in known):
            raise SettingsError(
                f"on {settings.host} an API key is needed, and there is none; "
                "make one: occluder keys create --name NAME --scope write"
            )


def _bind(settings: Settings) -> socket.socket:
    """A socket that has the address, not listening yet: nobody waits for a server that fails."""
    try:
        family, kind, protocol, _, place = socket.getaddrinfo(
            settings.host, settings.port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        listener = socket.socket(family, kind, protocol)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(place)
    except OSError as error:
        raise SettingsError(
            f"cannot listen on {settings.host} port {settings.port} ({error.strerror}); "
            "choose another --host or --port, or end what listens there"
        ) from error
    return listener


def _address(host: str, listener: socket.socket) -> str:
    shown = f"[{host}]" if ":" in host else host
    return f"http://{shown}:{listener.getsockname()[1]}"


def _begin_log(settings: Settings) -> None:
    """A line an event on standard error; of uvicorn only what goes wrong."""
    log_as(settings.log)
    logging.getLogger("service").setLevel(logging.INFO)
    logging.getLogger("uvicorn").setLevel(logging.WARNING)


def _allow_files() -> None:
    """Allow as many open files as may be: each connection is one, and shells allow 1,024."""
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    most = _MOST_FILES if hard == resource.RLIM_INFINITY else min(hard, _MOST_FILES)
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
