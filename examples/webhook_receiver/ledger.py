"""What was heard: a small database beside the pipeline."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path


class Ledger:
    """Words that were dealt with, by the id that they carry, and the files that came of them.

    It outlives the receiver: a word may be sent again hours later, when its answer was lost.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        with closing(self._open()) as database, database:
            database.execute(
                "CREATE TABLE IF NOT EXISTS heard (id TEXT PRIMARY KEY, file TEXT, created REAL)"
            )

    def has(self, delivery: str) -> bool:
        with closing(self._open()) as database:
            found = database.execute("SELECT 1 FROM heard WHERE id = ?", (delivery,))
            return found.fetchone() is not None

    def newest(self, file: str) -> float:
        """When the job was made that a file is of, Unix seconds; 0 where there is none."""
        with closing(self._open()) as database:
            found = database.execute("SELECT max(created) FROM heard WHERE file = ?", (file,))
            return float(found.fetchone()[0] or 0.0)

    def note(self, delivery: str, file: str | None = None, created: float | None = None) -> None:
        with closing(self._open()) as database, database:
            database.execute(
                "INSERT OR IGNORE INTO heard VALUES (?, ?, ?)", (delivery, file, created)
            )

    def _open(self) -> sqlite3.Connection:
        return sqlite3.connect(self._path, timeout=10.0)
