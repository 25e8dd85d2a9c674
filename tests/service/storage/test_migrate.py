"""The migrations and the tables say the same."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from alembic import command
from sqlalchemy import Connection, create_engine, inspect

import service.storage.blobs.tables  # noqa: F401 - so that the metadata has them
from service.access.key import Scope, hash_of
from service.errors import IdempotencyKeyReusedError
from service.idempotency import Answer, KeyedRequest
from service.jobs.asset import Thresholds
from service.storage.answer_store import SqlAnswerStore
from service.storage.asset_store import SqlAssetStore
from service.storage.key_store import SqlKeyStore
from service.storage.schema import alembic_config, migrate
from service.storage.sqlite import SqliteDatabase
from service.storage.tables import Base


@pytest.fixture
def connection() -> Iterator[Connection]:
    with create_engine("sqlite://").begin() as connection:
        yield connection


def schema(connection: Connection) -> dict[str, Any]:
    """All that SQLite knows of each table, whatever the order it was told in."""
    look = inspect(connection)
    return {
        table: {
            "columns": sorted(
                (one["name"], str(one["type"]), one["nullable"], one["default"])
                for one in look.get_columns(table)
            ),
            "key": look.get_pk_constraint(table),
            "foreign keys": sorted(map(str, look.get_foreign_keys(table))),
            "unique": sorted(map(str, look.get_unique_constraints(table))),
            "checks": sorted(map(str, look.get_check_constraints(table))),
            "indexes": sorted(map(index_words, look.get_indexes(table))),
            "never reused": "AUTOINCREMENT"
            in connection.exec_driver_sql(
                "SELECT sql FROM sqlite_master WHERE name = ?", (table,)
            ).scalar_one(),
        }
        for table in look.get_table_names()
        if table != "alembic_version"
    }


def index_words(index: Any) -> str:
    options = {name: str(one) for name, one in index.get("dialect_options", {}).items()}
    return str({**index, "dialect_options": options})


def test_migrations_make_exactly_the_tables(connection: Connection) -> None:
    migrate(connection)
    with create_engine("sqlite://").begin() as other:
        Base.metadata.create_all(other)
        assert schema(connection) == schema(other)
    assert set(schema(connection)) == set(Base.metadata.tables)


def test_migrations_can_be_undone_and_done_again(connection: Connection) -> None:
    migrate(connection)
    made = schema(connection)
    command.downgrade(alembic_config(connection), "base")
    assert schema(connection) == {}
    migrate(connection)
    assert schema(connection) == made


def test_assets_and_jobs_of_before_overhang_stay(tmp_path: Path) -> None:
    """A table that is copied and dropped would take all jobs of its assets along."""
    file = tmp_path / "occluder.db"
    with create_engine(f"sqlite:///{file}").begin() as connection:
        command.upgrade(alembic_config(connection), "0002")
    old = sqlite3.connect(file)
    old.execute(
        "INSERT INTO assets (id, tenant, name, folded, created, min_recall)"
        " VALUES ('a1', 'studio', 'castle', 'castle', 1.0, 0.8)"
    )
    old.execute(
        "INSERT INTO jobs (id, tenant, kind, state, name, options, version, work_key, created,"
        " ended, attempt, attempts, asset_number, cancel_asked, summary, beat, lease_seconds)"
        " VALUES ('j1', 'studio', 'occluder', 'succeeded', 'castle.glb', '{}', '0.1.0', 'w', 1.0,"
        " 2.0, 1, 3, 1, 0, ?, 0, 0.0)",
        (json.dumps({"triangles": 12, "input_triangles": 100, "levels": 1, "seconds": 1.5,
                     "precision": 0.999, "recall": 0.9, "worst_recall": 0.5, "worst_view": 3,
                     "error_bound": 0.1, "timings": {}, "warnings": ["one hole"]}),),
    )  # fmt: skip
    old.commit()
    old.close()
    assets = SqlAssetStore(SqliteDatabase.open(file))
    (castle,) = assets.assets("studio").assets
    assert castle.thresholds == Thresholds(min_recall=0.8)
    assert castle.latest is not None
    assert castle.latest.summary is not None
    assert (castle.latest.summary.recall, castle.latest.summary.overhang) == (0.9, None)
    assert castle.thresholds.held_by(castle.latest.summary) is True
    assert assets.set_thresholds("studio", "a1", Thresholds(max_overhang=0.01)).runs == 1
    with pytest.raises(sqlite3.IntegrityError), sqlite3.connect(file) as connection:
        connection.execute("UPDATE assets SET max_overhang = -0.1")


def test_numbers_of_removed_jobs_do_not_come_again_with_the_new_kind(tmp_path: Path) -> None:
    """A table that is copied forgets how far its numbers went."""
    file = tmp_path / "occluder.db"
    insert = (
        "INSERT INTO jobs (id, tenant, kind, state, name, options, version, work_key, created,"
        " attempt, attempts, cancel_asked, beat, lease_seconds)"
        " VALUES (?, 'studio', ?, 'queued', 'a.glb', '{}', '1', 'w', 1.0, 0, 3, 0, 0, 0.0)"
    )
    with create_engine(f"sqlite:///{file}").begin() as connection:
        command.upgrade(alembic_config(connection), "0003")
    with sqlite3.connect(file) as old:
        old.execute(insert, ("j1", "scene"))
        old.execute("DELETE FROM jobs")
        with pytest.raises(sqlite3.IntegrityError):
            old.execute(insert, ("j2", "visibility"))
    SqliteDatabase.open(file).close()
    with sqlite3.connect(file) as new:
        new.execute(insert, ("j2", "visibility"))
        assert new.execute("SELECT number, id FROM jobs").fetchall() == [(2, "j2")]
        with pytest.raises(sqlite3.IntegrityError):
            new.execute(insert, ("j3", "dream"))


def test_names_of_before_are_composed_where_that_takes_no_other(tmp_path: Path) -> None:
    file = tmp_path / "occluder.db"
    with create_engine(f"sqlite:///{file}").begin() as connection:
        command.upgrade(alembic_config(connection), "0004")
    with sqlite3.connect(file) as old:
        for number, name in enumerate(("Tu\u0308r", "No\u0308", "N\u00f6")):
            old.execute(
                "INSERT INTO assets (id, tenant, name, folded, created)"
                " VALUES (?, 'studio', ?, ?, 1.0)",
                (f"a{number}", name, name.casefold()),
            )
    SqliteDatabase.open(file).close()
    with sqlite3.connect(file) as new:
        found = new.execute("SELECT id, name, folded FROM assets ORDER BY number").fetchall()
    assert found == [
        ("a0", "T\u00fcr", "t\u00fcr"),
        ("a1", "No\u0308", "no\u0308"),
        ("a2", "N\u00f6", "n\u00f6"),
    ]


def test_keys_of_before_go_on_and_those_to_write_keep_what_they_could(tmp_path: Path) -> None:
    file = tmp_path / "occluder.db"
    with create_engine(f"sqlite:///{file}").begin() as connection:
        command.upgrade(alembic_config(connection), "0006")
    of_before = "occ_k3J-_9fQ2mZ1x0YbLw8Vt6RsPqOnMlKjIhGfEdCbA-4"
    with sqlite3.connect(file) as old:
        for scope in ("read", "write", "admin"):
            old.execute(
                "INSERT INTO api_keys (id, tenant, name, scope, hint, digest, created)"
                " VALUES (?, 'studio', 'ci', ?, 'occ_k3J-', ?, 1.0)",
                (scope, scope, hash_of(of_before + scope)),
            )
    keys = SqlKeyStore(SqliteDatabase.open(file))
    found = [keys.find(of_before + scope) for scope in ("read", "write", "admin")]
    assert [(key.scope, key.curates) for key in found if key] == [
        ("read", False), ("write", True), ("admin", False),
    ]  # fmt: skip
    assert keys.create("studio", "new", Scope.WRITE)[0].curates is False
    assert keys.rotate("write", overlap=0.0).new.curates is True


def test_an_upload_that_is_sent_again_over_the_change_is_known(tmp_path: Path) -> None:
    file = tmp_path / "occluder.db"
    with create_engine(f"sqlite:///{file}").begin() as connection:
        command.upgrade(alembic_config(connection), "0010")
    with sqlite3.connect(file) as old:
        for number, created in ((1, 1_000.0), (2, 90_000.0)):
            old.execute(
                "INSERT INTO jobs (id, tenant, kind, state, name, options, version, work_key,"
                " created, attempt, attempts, cancel_asked, beat, lease_seconds)"
                " VALUES (?, 'studio', 'scene', 'queued', 'a.glb', '{}', '1', 'w', ?, 0, 3, 0, 0,"
                " 0.0)",
                (f"j{number}", created),
            )
            old.execute(
                "INSERT INTO idempotency_keys (tenant, key, fingerprint, job_number)"
                " VALUES ('studio', ?, 'f', ?)",
                (f"k{number}", number),
            )
    answers = SqlAnswerStore(SqliteDatabase.open(file), lambda: 100_000.0)
    late = Answer(204)
    assert answers.once(KeyedRequest("studio", "k2", "f"), lambda: late) == (
        Answer(200, job_id="j2"), True,
    )  # fmt: skip
    assert answers.once(KeyedRequest("studio", "k1", "f"), lambda: late) == (late, False)
    with pytest.raises(IdempotencyKeyReusedError):
        answers.once(KeyedRequest("studio", "k2", "g"), lambda: late)


def test_a_migration_that_fails_leaves_nothing(tmp_path: Path) -> None:
    file = tmp_path / "occluder.db"
    taken = sqlite3.connect(file)
    taken.execute("CREATE TABLE job_files (other INTEGER)")  # in the way, after some tables
    taken.close()
    with pytest.raises(Exception, match="already exists"):
        SqliteDatabase.open(file)
    left = sqlite3.connect(file)
    names = [name for (name,) in left.execute("SELECT name FROM sqlite_master")]
    left.close()
    assert names == ["job_files"]
