"""Opening the blobs that the settings tell of, with the database that they belong to."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from service.errors import SettingsError
from service.jobs.stores import BlobInventory, BlobStore
from service.settings import Settings
from service.storage.blobs.cache import BlobCache
from service.storage.blobs.file_blobs import FileBlobs
from service.storage.blobs.identity import FolderHome, check_identity
from service.storage.blobs.ledger import BlobLedger, rely_on
from service.storage.blobs.places import BlobPlaces
from service.storage.blobs.s3_blobs import BucketParts, S3Blobs
from service.storage.blobs.sending import part_size
from service.storage.data_folder import DataFolder
from service.storage.database import Database
from service.storage.job_store import RelyOn

_LEASES = 10
"""Who puts blobs counts as alive for so many times the lease of a job: nothing is lost by waiting,
and what a server did for whom it took for dead has to be done again."""


@dataclass(frozen=True)
class OpenBlobs:
    """A store, all that is in it to be read anew, and what a transaction that names blobs calls.

    ``rely_on``  as :class:`~service.storage.job_store.SqlJobStore` has it.
    """

    store: BlobStore
    inventory: BlobInventory
    rely_on: RelyOn


@contextmanager
def open_blobs(settings: Settings, folder: DataFolder, database: Database) -> Iterator[OpenBlobs]:
    """For a server, or a worker; to be used within the block.

    Raises :class:`~service.errors.SettingsError` where they cannot be used, within seconds.
    """
    if not settings.blobs:
        check_identity(database, FolderHome(folder.blobs), claim=database.shared)
        files = FileBlobs(folder.blobs, min_free=settings.min_free)
        yield OpenBlobs(files, files.places, lambda session, blobs: None)
        return
    with _open_bucket(settings, database, may_lack=False) as parts:
        cache = BlobCache(folder.cache, settings.blob_cache, settings.min_free)
        yield OpenBlobs(S3Blobs(parts, cache), parts.inventory, rely_on)


@contextmanager
def open_inventory(
    settings: Settings, folder: DataFolder, database: Database, *, may_lack: bool
) -> Iterator[BlobInventory]:
    """The same for a command that runs beside servers.

    ``may_lack``  as :func:`~service.storage.blobs.identity.check_identity` has it.
    """
    if not settings.blobs:
        home = FolderHome(folder.blobs)
        check_identity(database, home, claim=database.shared, may_lack=may_lack)
        yield BlobPlaces(folder.blobs)
        return
    with _open_bucket(settings, database, may_lack=may_lack) as parts:
        yield parts.inventory


@contextmanager
def _open_bucket(
    settings: Settings, database: Database, *, may_lack: bool
) -> Iterator[BucketParts]:
    try:
        from service.storage.blobs.bucket import Bucket
    except ModuleNotFoundError as error:
        if error.name != "obstore":
            raise
        raise SettingsError(
            "OCCLUDER_BLOBS needs 'obstore', which is not installed; "
            "run: pip install 'planar-occluder[cluster]'"
        ) from error
    bucket = Bucket.open(settings.blobs)
    bucket.check()
    identity = check_identity(database, bucket, claim=True, may_lack=may_lack)
    assert identity is not None  # as it claims
    ledger = BlobLedger(database, lease=_LEASES * settings.lease_seconds)
    parts = BucketParts.of(bucket, ledger, identity, part_size(settings.max_upload))
    with parts.ownership.living():
        yield parts
