"""An empty database for each test, of either kind, and the stores on it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from service.storage.asset_store import SqlAssetStore
from service.storage.database import Database
from service.storage.delivery_store import SqlDeliveryStore
from service.storage.job_store import SqlJobStore
from service.storage.journal_store import SqlJournal
from service.storage.key_store import SqlKeyStore
from service.storage.postgres import PostgresDatabase
from service.storage.sqlite import SqliteDatabase
from tests.postgres import PostgresServer
from tests.service.storage.fresh import ReusedPostgres, fresh_database
from tests.service.storage.samples import Clock


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "occluder.db"


@pytest.fixture
def sqlite_database(file: Path) -> Iterator[SqliteDatabase]:
    database = fresh_database(file)
    yield database
    database.close()


@pytest.fixture(scope="session")
def reused_postgres(postgres: PostgresServer) -> Iterator[ReusedPostgres]:
    reused = ReusedPostgres(postgres)
    yield reused
    reused.close()


@pytest.fixture
def postgres_database(reused_postgres: ReusedPostgres) -> PostgresDatabase:
    reused_postgres.empty()
    return reused_postgres.database


@pytest.fixture(params=["sqlite", "postgres"])
def database(request: pytest.FixtureRequest) -> Database:
    found: Database = request.getfixturevalue(f"{request.param}_database")
    return found


@pytest.fixture
def clock() -> Clock:
    """The time of day."""
    return Clock()


@pytest.fixture
def monotonic() -> Clock:
    return Clock(1000.0)


@pytest.fixture
def jobs(database: Database, clock: Clock, monotonic: Clock) -> SqlJobStore:
    return SqlJobStore(database, clock, monotonic)


@pytest.fixture
def assets(database: Database, clock: Clock) -> SqlAssetStore:
    return SqlAssetStore(database, clock)


@pytest.fixture
def keys(database: Database, clock: Clock) -> SqlKeyStore:
    return SqlKeyStore(database, clock)


@pytest.fixture
def journal(database: Database, clock: Clock) -> SqlJournal:
    return SqlJournal(database, clock)


@pytest.fixture
def deliveries(database: Database, clock: Clock) -> SqlDeliveryStore:
    return SqlDeliveryStore(database, clock)
