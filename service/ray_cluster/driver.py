"""The process that offers jobs to Ray, while it leads.

It is a process of its own, started and started again by ``occluder dispatch``, because Ray ends a
driver's process where the raylet beside it, or the head for a minute, is gone.  It lives no longer
than its standard input is open, which its parent holds.
"""

from __future__ import annotations

import logging
import os
import signal
import sys
import threading
import time
from contextlib import ExitStack, closing
from types import FrameType
from typing import Any

from service.engines.confinement import hide_memory
from service.engines.signals import Bell
from service.errors import ServiceError, SettingsError
from service.logs import log_as
from service.ray_cluster.dispatching import Dispatcher
from service.ray_cluster.joining import joined
from service.ray_cluster.nodes import Nodes
from service.ray_cluster.task import check_worker_node
from service.settings import Settings
from service.storage.database import Database, Topic
from service.storage.leadership import DISPATCHERS, Leadership
from service.storage.offer_store import SqlOffers
from service.storage.opening import check_release, open_database
from service.storage.sharing import sharing
from service.tracing import tracing
from simplifier import __version__

JOINED = b"joined\n"
"""Written to the descriptor that the parent has named, once work may begin."""

_POLL = 1.0  # seconds between looks for what nobody has told of
_LEAST_BETWEEN = 0.05  # seconds between looks, however often the bell is rung
_PROBE_SECONDS = 30.0  # that nodes have to answer before the first job is offered
_LAST_SECONDS = 5.0  # in which jobs are given back at the end, if the database is there

_log = logging.getLogger(__name__)


def run_driver(settings: Settings, told: int | None) -> None:
    """Offer jobs until a signal says to end.

    ``told``  the descriptor that :data:`JOINED` is written to.
    Raises :class:`~service.errors.SettingsError` where it is set up wrongly.
    """
    hide_memory()
    log_as(settings.log)
    logging.getLogger("service").setLevel(logging.INFO)
    _end_with_parent()
    if settings.database_url is None:
        raise SettingsError(
            "a dispatcher offers jobs of a database that servers share; set OCCLUDER_DATABASE_URL"
        )
    with tracing(), closing(open_database(settings)) as database, ExitStack() as parts:
        check_release(database)
        ray = parts.enter_context(joined())
        end, bell = threading.Event(), Bell()
        _hear_signals(end, bell)
        nodes = Nodes(ray, check_worker_node)
        nodes.look(_PROBE_SECONDS)
        leadership = _leadership(database)
        parts.enter_context(leadership.running())
        shared = parts.enter_context(sharing(database, may_lead=False))

        def hear(topic: Topic, what: str) -> None:
            if topic is Topic.QUEUED:
                bell.ring()

        parts.enter_context(shared.listening(hear, bell.ring))
        _log.info(
            "joined Ray: %d processors may do jobs, %d nodes may not",
            nodes.processors, len(nodes.unfit),
        )  # fmt: skip
        if told is not None:
            os.write(told, JOINED)
        dispatcher = Dispatcher(ray, nodes, SqlOffers(database, __version__), settings, bell)
        _rounds(dispatcher, leadership, end, bell)
        ray.shutdown()
        _give_back(dispatcher)


def _leadership(database: Database) -> Leadership:
    from service.storage.postgres import PostgresDatabase

    assert isinstance(database, PostgresDatabase)
    return Leadership(database.place, lock=DISPATCHERS, duty="it offers jobs to Ray")


def _rounds(
    dispatcher: Dispatcher, leadership: Leadership, end: threading.Event, bell: Bell
) -> None:
    failing = False
    while not end.is_set():
        bell.wait(_POLL)
        try:
            # Tasks of a time when it led are looked after to their end.
            dispatcher.step(offering=leadership.held())
        except Exception as error:
            if not failing:
                ours = not isinstance(error, ServiceError)
                _log.error("no jobs are offered for now: %s", error, exc_info=ours)
            failing = True
        else:
            failing = False
        end.wait(_LEAST_BETWEEN)


def _give_back(dispatcher: Dispatcher) -> None:
    until = time.monotonic() + _LAST_SECONDS
    while True:
        try:
            dispatcher.give_back()
        except ServiceError as error:
            if time.monotonic() >= until:
                _log.error("jobs are not given back, and begin again after their lease: %s", error)
                return
            time.sleep(_POLL)
        else:
            return


def _hear_signals(end: threading.Event, bell: Bell) -> None:
    """After Ray has set its own, which would end the process with jobs under way."""

    def handle(number: int, frame: FrameType | None) -> None:
        if end.is_set():
            os._exit(128 + number)
        end.set()
        bell.ring()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, handle)


def _end_with_parent() -> None:
    def wait() -> Any:
        while os.read(sys.stdin.fileno(), 4096):
            pass
        os._exit(1)

    threading.Thread(target=wait, name="occluder parent", daemon=True).start()
