"""New databases at the price of a copy: to make the tables takes five times as long as to open."""

from __future__ import annotations

import tempfile
from functools import cache
from pathlib import Path
from typing import Any

from sqlalchemy import Engine
from sqlalchemy.util import LRUCache

from service.storage.database import Database
from service.storage.postgres import PostgresDatabase
from service.storage.sqlite import SqliteDatabase
from tests.postgres import PostgresServer


@cache
def _migrated() -> bytes:
    """The file of a database with all tables and no rows, made once a process."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "occluder.db"
        SqliteDatabase.open(file).close()
        return file.read_bytes()


def fresh_database(file: Path) -> SqliteDatabase:
    """Open a file that was not there, as if it had just been made.

    What is looked at when others are opened, it was found to be right in when it was made.
    """
    assert not file.exists()
    file.touch(mode=0o600)
    file.write_bytes(_migrated())
    database = SqliteDatabase(file)
    share_statements(database)
    return database


_dialects: dict[str, Any] = {}
_compiled: LRUCache[Any, Any] = LRUCache(2000)


def share_statements(database: Database) -> None:
    """Databases of one kind put the same statements into SQL, which takes as long as a test does
    for the rest: they share what one has made of them."""
    for engine in (database._writer, database._reader):
        _share(engine)


def _share(engine: Engine) -> None:
    name = engine.dialect.name
    if name not in _dialects:
        engine.connect().close()  # which tells the dialect what the server can do
        _dialects[name] = engine.dialect
    engine.dialect = _dialects[name]
    engine.update_execution_options(compiled_cache=_compiled)


_KEEP = "CREATE SCHEMA kept; CREATE TABLE kept.deployment AS TABLE deployment"

_EMPTY = """
DO $$ DECLARE filled text; BEGIN
    PERFORM pg_terminate_backend(pid) FROM pg_stat_activity
    WHERE datname = current_database() AND state <> 'idle' AND pid <> pg_backend_pid();
    SELECT string_agg(quote_ident(relname), ', ') INTO filled FROM pg_class
    WHERE relkind = 'r' AND relnamespace = 'public'::regnamespace
    AND relname NOT IN ('alembic_version', 'deployment') AND pg_relation_size(oid) > 0;
    IF filled IS NOT NULL THEN
        EXECUTE 'TRUNCATE ' || filled || ' RESTART IDENTITY CASCADE';
    END IF;
    DELETE FROM deployment;
    INSERT INTO deployment TABLE kept.deployment;
END $$
"""


class ReusedPostgres:
    """A database that is emptied for each test, which takes a tenth of what a new one does."""

    def __init__(self, server: PostgresServer) -> None:
        self._server = server
        # Statistics of the rows of one test would have statements of another done in other ways.
        server.execute("ALTER SYSTEM SET autovacuum = off")
        server.execute("SELECT pg_reload_conf()")
        self.address = server.database()
        self._execute(_KEEP)
        self.database = PostgresDatabase.open(self.address)
        share_statements(self.database)

    def empty(self) -> None:
        """As it was when it was made."""
        self._execute(_EMPTY)

    def close(self) -> None:
        self.database.close()
        self._server.drop(self.address)

    def _execute(self, statement: str) -> None:
        self._server.execute(statement, self.address.rpartition("/")[2])
