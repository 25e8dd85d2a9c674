"""The file: opened, checked, shared, full and damaged."""

from __future__ import annotations

import itertools
import multiprocessing
import sqlite3
import tempfile
from contextlib import suppress
from functools import cache
from multiprocessing.connection import Connection
from multiprocessing.synchronize import Event
from pathlib import Path

import pytest
from sqlalchemy import text

from service.access.key import Scope
from service.errors import DatabaseDamagedError, DiskFullError, SettingsError
from service.jobs.job import JobState
from service.jobs.stores import JobFilter
from service.storage.database import Database
from service.storage.job_store import SqlJobStore
from service.storage.key_store import SqlKeyStore
from service.storage.sqlite import SqliteDatabase
from tests.service.storage.fresh import fresh_database
from tests.service.storage.samples import mesh, results, submission, summary


@pytest.fixture
def database(sqlite_database: SqliteDatabase) -> SqliteDatabase:
    return sqlite_database


def filled(file: Path, jobs: int) -> None:
    """A database with some queued jobs, closed, so that all of it is in the one file."""
    file.touch(mode=0o600)
    file.write_bytes(_filled(jobs))


@cache
def _filled(jobs: int) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "occluder.db"
        database = fresh_database(file)
        submit_many(SqlJobStore(database), jobs)
        database.close()
        return file.read_bytes()


def submit_many(store: SqlJobStore, jobs: int) -> None:
    for number in range(jobs):
        store.submit(submission(str(number), options={"filler": "x" * 500}), 10_000)


def spoil(file: Path, page: int) -> None:
    """Write over a page, counted from 1 as SQLite does."""
    with file.open("r+b") as stream:
        stream.seek((page - 1) * 4096)
        stream.write(b"\xa5" * 4096)


def root_page(file: Path, table: str) -> int:
    connection = sqlite3.connect(file)
    try:
        query = "SELECT rootpage FROM sqlite_master WHERE name = ?"
        return int(connection.execute(query, (table,)).fetchone()[0])
    finally:
        connection.close()


def test_what_was_committed_is_there_after_opening_again(file: Path) -> None:
    filled(file, 3)
    database = SqliteDatabase.open(file)
    assert SqlJobStore(database).counts()[JobState.QUEUED] == 3
    assert database.is_sound()
    database.close()


def test_nobody_else_may_read_it(file: Path) -> None:
    database = SqliteDatabase.open(file)
    submit_many(SqlJobStore(database), 1)
    modes = {path.name: path.stat().st_mode & 0o777 for path in file.parent.glob(f"{file.name}*")}
    assert modes == dict.fromkeys([file.name, f"{file.name}-shm", f"{file.name}-wal"], 0o600)
    database.close()


def test_every_commit_is_flushed_and_readers_do_not_wait(database: Database) -> None:
    with database.writing() as session:
        assert session.execute(text("PRAGMA synchronous")).scalar_one() == 2  # full
        assert session.execute(text("PRAGMA journal_mode")).scalar_one() == "wal"
        assert session.execute(text("PRAGMA foreign_keys")).scalar_one() == 1
        session.execute(text("DELETE FROM assets"))
        with database.reading() as reader:
            assert reader.execute(text("SELECT count(*) FROM jobs")).scalar_one() == 0


@pytest.mark.parametrize("share", [0.25, 0.5, 0.75])
def test_a_damaged_page_is_told_when_the_service_starts(file: Path, share: float) -> None:
    filled(file, 60)
    pages = file.stat().st_size // 4096
    spoil(file, int(pages * share))
    with pytest.raises(DatabaseDamagedError, match=r"occluder\.db' is damaged.*backup"):
        SqliteDatabase.open(file)


def test_damage_that_comes_while_the_service_runs_is_told_and_remembered(file: Path) -> None:
    filled(file, 60)
    database = SqliteDatabase.open(file)
    store = SqlJobStore(database)
    assert database.is_sound()
    spoil(file, root_page(file, "jobs"))
    with pytest.raises(DatabaseDamagedError):
        store.jobs("studio", JobFilter(), before=None, limit=10)
    assert not database.is_sound()
    database.close()


def test_a_text_that_is_none_is_damage(database: Database) -> None:
    store = SqlJobStore(database)
    submit_many(store, 2)
    with database.writing() as session:
        session.execute(text("UPDATE jobs SET name = CAST(x'c3c361' AS TEXT)"))
    with pytest.raises(DatabaseDamagedError, match=r"UTF-8 column '\w*name'\)"):
        store.jobs("studio", JobFilter(), before=None, limit=10)
    assert not database.is_sound()


def test_a_schema_whose_names_are_no_text_is_damage(file: Path) -> None:
    filled(file, 1)
    connection = sqlite3.connect(file)
    connection.execute("PRAGMA writable_schema = ON")
    connection.execute("UPDATE sqlite_master SET name = CAST(x'c3c3' AS TEXT), sql = 'x'")
    connection.commit()
    connection.close()
    with pytest.raises(DatabaseDamagedError, match="is damaged"):
        SqliteDatabase.open(file)


def test_a_digest_is_not_called_unnamed_for_a_damaged_page(file: Path) -> None:
    """Blobs that a damaged page names must not be swept away."""
    filled(file, 60)
    database = SqliteDatabase.open(file)
    spoil(file, root_page(file, "ix_job_files_digest"))
    with pytest.raises(DatabaseDamagedError):
        SqlJobStore(database).unnamed([mesh("0").blob.digest])
    database.close()


def test_another_file_is_not_taken_for_a_database(file: Path) -> None:
    file.write_bytes(b"solid cube\n" * 1000)
    with pytest.raises(DatabaseDamagedError, match="not a database"):
        SqliteDatabase.open(file)
    assert file.read_bytes() == b"solid cube\n" * 1000


def test_a_missing_folder_is_told(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="check that its folder is there"):
        SqliteDatabase.open(tmp_path / "nowhere" / "occluder.db")


def test_the_schema_of_a_newer_version_is_left_alone(file: Path) -> None:
    SqliteDatabase.open(file).close()
    connection = sqlite3.connect(file)
    connection.execute("UPDATE alembic_version SET version_num = '9999'")
    connection.commit()
    connection.close()
    with pytest.raises(SettingsError, match=r"9999.*newer"):
        SqliteDatabase.open(file)


def test_a_full_disk_is_told_and_what_was_stored_stays(database: Database) -> None:
    store = SqlJobStore(database)
    held = store.submit(submission("before"), 10)[0]
    claim = store.claim("one", 30.0)
    assert claim is not None
    set_pages(database, 1)  # SQLite goes no lower than what is in use
    with pytest.raises(DiskFullError, match="make room on the disk"):
        submit_many(store, 1000)
    stored = store.counts()[JobState.QUEUED]
    assert len(store.jobs(None, JobFilter(), before=None, limit=2000).jobs) == stored + 1
    assert database.is_sound()

    set_pages(database, 100_000)
    assert store.succeed(claim, results(), summary())
    assert store.job(None, held.id).state is JobState.SUCCEEDED
    store.submit(submission("after"), 10_000)


def set_pages(database: Database, pages: int) -> None:
    with database.writing() as session:
        session.execute(text(f"PRAGMA max_page_count = {pages}"))


def test_a_key_is_known_on_a_full_disk(database: Database) -> None:
    keys = SqlKeyStore(database)
    _, secret = keys.create("studio", "build farm", Scope.READ)
    with database.writing() as session:  # each note of a use takes a page more
        session.execute(text("CREATE TABLE ballast (weight BLOB)"))
        session.execute(
            text(
                "CREATE TRIGGER grow AFTER UPDATE ON api_keys "
                "BEGIN INSERT INTO ballast VALUES (zeroblob(8192)); END"
            )
        )
    set_pages(database, 1)
    found = keys.find(secret)
    assert found
    assert keys.keys() == [found]  # and its use is not noted


def submit_and_tell(file: Path, told: Connection) -> None:
    """Until killed."""
    store = SqlJobStore(SqliteDatabase.open(file))
    for number in itertools.count():
        told.send(store.submit(submission(str(number)), 1_000_000)[0].id)


@pytest.mark.parametrize(
    "jobs",
    [20, *(pytest.param(number, marks=pytest.mark.slow) for number in (1, 41))],
)
def test_what_a_killed_server_has_told_is_there(file: Path, jobs: int) -> None:
    spawn = multiprocessing.get_context("spawn")
    hears, tells = spawn.Pipe(duplex=False)
    process = spawn.Process(target=submit_and_tell, args=(file, tells))
    process.start()
    tells.close()
    told = []
    with suppress(EOFError):
        while hears.poll(timeout=60.0):
            told.append(hears.recv())
            if len(told) == jobs:
                process.kill()
    process.kill()
    process.join(timeout=60.0)
    assert len(told) >= jobs

    database = SqliteDatabase.open(file)
    stored = SqlJobStore(database).jobs(None, JobFilter(), before=None, limit=10_000).jobs
    ids = [job.id for job in reversed(stored)]
    assert ids[: len(told)] == told
    assert len(ids) <= len(told) + 1  # one may be stored that could not be told any more
    database.close()


def make_keys(file: Path, count: int, begun: Event) -> None:
    """In another process, as ``occluder keys create`` does."""
    database = SqliteDatabase.open(file)
    begun.set()
    for number in range(count):
        SqlKeyStore(database).create("studio", f"key {number}", Scope.READ)
    database.close()


def test_another_process_writes_meanwhile(file: Path, database: Database) -> None:
    store = SqlJobStore(database)
    spawning = multiprocessing.get_context("spawn")
    begun = spawning.Event()
    process = spawning.Process(target=make_keys, args=(file, 20, begun))
    process.start()
    assert begun.wait(timeout=30.0)
    number = 0
    while process.is_alive() or number < 20:
        store.submit(submission(str(number)), 10_000)
        number += 1
    process.join(timeout=30.0)
    assert process.exitcode == 0
    assert len(SqlKeyStore(database).keys()) == 20
    assert store.counts()[JobState.QUEUED] == number
