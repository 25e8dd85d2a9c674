"""Databases for blobs in a bucket, and the servers of buckets."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from sqlalchemy import event

from service.storage.sqlite import SqliteDatabase
from tests.s3 import S3Server
from tests.service.storage.fresh import fresh_database


@pytest.fixture
def sqlite_database(file: Path) -> Iterator[SqliteDatabase]:
    """One that waits for no disk: each blob in a bucket is a few commits."""
    opened = fresh_database(file)
    event.listen(
        opened._writer, "connect", lambda made, _: made.execute("PRAGMA synchronous = OFF")
    )
    yield opened
    opened.close()


@pytest.fixture(params=["moto", "localbucket"])
def server(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> S3Server:
    """Each of them, and the environment tells of it."""
    found: S3Server = request.getfixturevalue(request.param)
    for name, value in found.variables.items():
        monkeypatch.setenv(name, value)
    return found


@pytest.fixture
def database(sqlite_database: SqliteDatabase) -> SqliteDatabase:
    """Of one kind, where the other makes no difference."""
    return sqlite_database
