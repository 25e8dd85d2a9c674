"""What a node does for a dispatcher: one job, by its row.

The node's own environment says where database and bucket are; of the dispatcher come the name of
the job, the name of the offer, and numbers.  A Ray worker process opens the stores once, and keeps
them and its confined process for the tasks that follow.  What comes of a job goes into its row:
nothing but None goes back through Ray.
"""

from __future__ import annotations

import atexit
import logging
import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import cache

from service.at_work import sharing_progress
from service.engines.confinement import hide_memory
from service.engines.single_place import SinglePlace
from service.errors import SettingsError
from service.jobs.progress import ProgressBoard
from service.jobs.turns import Shares
from service.logs import log_as
from service.ray_cluster.nodes import UnfitNodeError, check_node
from service.settings import Settings, read_settings
from service.storage.data_folder import FolderInUseError
from service.storage.offer_store import SqlOffers
from service.storage.opening import (
    Storage,
    check_for_worker,
    check_release,
    open_database,
    open_storage,
)
from service.tracing import tracing
from simplifier import __version__

_PLACES = 1024
"""Folders that are tried: one is of one process, and a node has no more than some hundreds."""


def check_worker_node(release: str) -> None:
    """The probe of :class:`~service.ray_cluster.nodes.Nodes`: whether jobs can be done here.

    Raises :class:`~service.ray_cluster.nodes.UnfitNodeError`.
    """
    check_node(release)
    try:
        settings = read_settings({})
        check_for_worker(settings)
        database = open_database(settings)
        try:
            check_release(database)
        finally:
            database.close()
    except SettingsError as error:
        raise UnfitNodeError(" ".join(str(error).split())) from None


def do_job(job_id: str, owner: str, release: str, places: int, threads: int) -> None:
    """Claim a job under the owner's name, do it, and end its row; nothing where it waits no more.

    ``places``  of all nodes, of which one tenant may have a share.

    Raises :class:`~service.ray_cluster.nodes.UnfitNodeError` where another release is here, which
    then claims nothing.
    """
    check_node(release)
    here = _here(threads)
    shares = Shares(places, running=here.settings.tenant_running)
    lease = here.settings.lease_seconds
    here.place.do_one(lambda: here.offers.claim(job_id, owner, lease, shares))


@dataclass(frozen=True)
class _Here:
    """What a worker process keeps open."""

    settings: Settings
    offers: SqlOffers
    place: SinglePlace


@cache
def _here(threads: int) -> _Here:
    parts = ExitStack()
    try:
        here = parts.enter_context(_opened(threads))
    except SettingsError as error:
        raise UnfitNodeError(" ".join(str(error).split())) from None
    atexit.register(parts.close)
    return here


@contextmanager
def _opened(threads: int) -> Iterator[_Here]:
    hide_memory()
    told = read_settings({})
    log_as(told.log)
    logging.getLogger("service").setLevel(logging.INFO)
    board = ProgressBoard()
    with tracing(), _storage_of_one(told) as (settings, stores), sharing_progress(stores, board):
        check_release(stores.database)
        place = SinglePlace(
            stores.jobs, stores.blobs, board, settings, stores.scratch, threads=threads
        )
        place.start()
        try:
            yield _Here(settings, SqlOffers(stores.database, __version__), place)
        finally:
            place.stop()


@contextmanager
def _storage_of_one(told: Settings) -> Iterator[tuple[Settings, Storage]]:
    """The stores on the first folder of the node that no other process has.

    So one that follows a killed process empties its scratch, and finds its copies of inputs.
    """
    # Copies of inputs are each process's own, and share the room.
    cache = told.blob_cache // (os.cpu_count() or 1)
    for number in range(_PLACES):
        folder = told.data / f"ray-{number}"
        settings = told.model_copy(update={"data": folder, "blob_cache": cache, "workers": 1})
        with ExitStack() as parts:
            try:
                stores = parts.enter_context(open_storage(settings, for_worker=True))
            except FolderInUseError:
                continue
            yield settings, stores
            return
    raise SettingsError(f"the {_PLACES:,} folders '{told.data}/ray-…' are all in use")
