"""The migrations and the tables say the same."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from alembic import command
from sqlalchemy import Connection, create_engine, inspect

from service.storage.database import Database, alembic_config, migrate
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
            "indexes": sorted(map(str, look.get_indexes(table))),
            "never reused": "AUTOINCREMENT"
            in connection.exec_driver_sql(
                "SELECT sql FROM sqlite_master WHERE name = ?", (table,)
            ).scalar_one(),
        }
        for table in look.get_table_names()
        if table != "alembic_version"
    }


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


def test_a_migration_that_fails_leaves_nothing(tmp_path: Path) -> None:
    file = tmp_path / "occluder.db"
    taken = sqlite3.connect(file)
    taken.execute("CREATE TABLE job_files (other INTEGER)")  # in the way, after some tables
    taken.close()
    with pytest.raises(Exception, match="already exists"):
        Database.open(file)
    left = sqlite3.connect(file)
    names = [name for (name,) in left.execute("SELECT name FROM sqlite_master")]
    left.close()
    assert names == ["job_files"]
