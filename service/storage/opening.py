"""The stores that the settings ask for, opened: a folder of this server's own, or a database that
several share.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType

from sqlalchemy import text

from service.access.attempts import Attempts
from service.errors import SettingsError
from service.jobs.progress import ProgressStore
from service.jobs.stores import BlobInventory, BlobStore
from service.jobs.turns import Shares
from service.settings import EngineChoice, Settings
from service.storage.answer_store import SqlAnswerStore
from service.storage.asset_store import SqlAssetStore
from service.storage.blobs.opening import open_blobs
from service.storage.check_store import SqlCheckStore
from service.storage.data_folder import DataFolder
from service.storage.database import Database
from service.storage.delivery_store import SqlDeliveryStore
from service.storage.job_store import SqlJobStore
from service.storage.journal_store import SqlJournal
from service.storage.key_store import SqlKeyStore
from service.storage.secret_ages import SqlSecretAges
from service.storage.sharing import Sharing, sharing
from service.storage.tally_store import SqlTallies
from simplifier import __version__


@dataclass(frozen=True)
class Storage:
    """All stores of a server.

    ``scratch``   a folder on the disk of the blobs, for work under way.
    ``sharing``   with other servers; :data:`~service.storage.sharing.ALONE` where nobody shares.
    ``progress``, ``failures``  what is told to other servers; None where nobody shares.
    """

    database: Database
    scratch: Path
    blobs: BlobStore
    inventory: BlobInventory
    jobs: SqlJobStore
    assets: SqlAssetStore
    keys: SqlKeyStore
    journal: SqlJournal
    answers: SqlAnswerStore
    deliveries: SqlDeliveryStore
    secret_ages: SqlSecretAges
    checks: SqlCheckStore
    tallies: SqlTallies
    sharing: Sharing
    progress: ProgressStore | None
    failures: Attempts | None


@contextmanager
def open_storage(settings: Settings, *, for_worker: bool = False) -> Iterator[Storage]:
    """Everything stays open within the block.

    ``for_worker``  that answers and signs nothing, and never leads.

    Raises :class:`~service.errors.SettingsError` where it cannot be used as it is set up, and
    :class:`~service.errors.DatabaseDamagedError`.
    """
    if for_worker:
        check_for_worker(settings)
    else:
        check_together(settings)
    folder = DataFolder(settings.data)
    with ExitStack() as parts:
        parts.enter_context(folder.own())
        database = parts.enter_context(closing(open_database(settings)))
        blobs = parts.enter_context(open_blobs(settings, folder, database))
        shares = Shares(settings.workers, settings.tenant_waiting, settings.tenant_running)
        yield Storage(
            database=database,
            scratch=folder.scratch,
            blobs=blobs.store,
            inventory=blobs.inventory,
            jobs=SqlJobStore(
                database,
                shares=shares,
                is_stored=blobs.store.has,
                rely_on=blobs.rely_on,
                release=__version__,
            ),
            assets=SqlAssetStore(database),
            keys=SqlKeyStore(database),
            journal=SqlJournal(database),
            answers=SqlAnswerStore(database),
            deliveries=SqlDeliveryStore(database),
            secret_ages=SqlSecretAges(database),
            checks=SqlCheckStore(database),
            tallies=SqlTallies(database),
            sharing=parts.enter_context(sharing(database, may_lead=not for_worker)),
            progress=_shared_progress(database),
            failures=_shared_failures(database),
        )


def open_database(settings: Settings) -> Database:
    """To be closed.  Raises as :func:`open_storage` does."""
    if settings.database_url is None:
        return DataFolder(settings.data).open_database()
    opened: Database = _postgres().PostgresDatabase.open(settings.database_url.get_secret_value())
    return opened


def migrate_database(settings: Settings, secret: str | None) -> str:
    """Bring the database to the schema of this release; what was done, in words.

    ``secret``  the fingerprint of the one that servers are to sign with from now on; None leaves
    it.  Raises as :func:`open_storage` does.
    """
    if settings.database_url is None:
        DataFolder(settings.data).make()
        open_database(settings).close()
        return f"the database in '{settings.data}' has the schema of release {__version__}"
    postgres = _postgres()
    address = settings.database_url.get_secret_value()
    told: str = postgres.migrate_server(address)
    if secret is not None:
        with closing(open_database(settings)) as database, database.writing() as session:
            session.execute(text("UPDATE deployment SET secret = :mine"), {"mine": secret})
    return told


def _postgres() -> ModuleType:
    try:
        return import_module("service.storage.postgres")
    except ModuleNotFoundError as error:
        raise SettingsError(
            f"OCCLUDER_DATABASE_URL needs '{error.name}', which is not installed; "
            "run: pip install 'planar-occluder[cluster]'"
        ) from None


def check_together(settings: Settings) -> None:
    """Raises :class:`~service.errors.SettingsError` for settings of which one needs another."""
    if settings.database_url is None:
        if settings.engine is not EngineChoice.LOCAL:
            raise SettingsError(
                f"OCCLUDER_ENGINE={settings.engine} leaves the jobs to others, and nobody shares "
                f"the database in '{settings.data}'; set OCCLUDER_DATABASE_URL, or "
                "OCCLUDER_ENGINE=local"
            )
    elif settings.secret_file is None:
        raise SettingsError(
            "servers that share a database sign with one secret; make it, once, by "
            "'head -c 32 /dev/urandom > FILE; chmod 600 FILE', give it to all of them, and name it "
            "by OCCLUDER_SECRET_FILE"
        )


def check_for_worker(settings: Settings) -> None:
    """Raises :class:`~service.errors.SettingsError` where nobody would share jobs, or files, with a
    worker."""
    if settings.database_url is None:
        raise SettingsError(
            "a worker takes its jobs from a database that servers share; set "
            "OCCLUDER_DATABASE_URL, or run 'occluder serve', which has workers of its own"
        )
    if not settings.blobs:
        raise SettingsError(
            "a worker needs the files of the servers, and a folder is of one server alone; set "
            "OCCLUDER_BLOBS=s3://BUCKET/PREFIX, for the servers as well"
        )


def check_release(database: Database, release: str = __version__) -> None:
    """Raises :class:`~service.errors.SettingsError` where the jobs are for another release."""
    with database.reading() as session:
        works = session.scalar(text("SELECT release FROM deployment"))
    if works != release:
        raise SettingsError(
            f"the database is set up for release {works}, and this one, {release}, gets no work; "
            f"install {works} here, or run 'occluder migrate' of {release}"
        )


def agree_on_secret(database: Database, fingerprint: str) -> None:
    """Raises :class:`~service.errors.SettingsError` where others sign with another secret.

    ``fingerprint``  of this server's, which tells nothing of it.
    """
    with database.writing() as session:
        session.execute(
            text("UPDATE deployment SET secret = :mine WHERE secret = ''"), {"mine": fingerprint}
        )
        known = session.scalar(text("SELECT secret FROM deployment"))
    if known != fingerprint:
        raise SettingsError(
            "OCCLUDER_SECRET_FILE holds another secret than other servers of this database have; "
            "give this one the same file, or, to change it, stop all and run 'occluder migrate'"
        )


def _shared_progress(database: Database) -> ProgressStore | None:
    from service.storage.progress_store import SqlProgressStore

    return SqlProgressStore(database) if database.shared else None


def _shared_failures(database: Database) -> Attempts | None:
    from service.storage.sign_in_store import SqlFailedAttempts

    return SqlFailedAttempts(database) if database.shared else None
