"""What a server has left in its folder, looked at without any code of the service."""

from __future__ import annotations

import hashlib
import sqlite3
from contextlib import closing
from dataclasses import dataclass


@dataclass(frozen=True)
class LeftJob:
    """A row of the table of jobs.

    ``ends``      how often it ended: each end puts down one delivery.
    ``delivery``  the id of the last.
    ``results``   names of the files that were made.
    """

    id: str
    state: str
    attempt: int
    attempts: int
    ends: int
    delivery: str
    results: frozenset[str]


def jobs_left(data):
    """By id; of a folder whose server has ended."""
    with closing(sqlite3.connect(data / "occluder.db")) as database:
        files = {}
        for number, name in database.execute(
            "SELECT job_number, name FROM job_files WHERE NOT is_input"
        ):
            files.setdefault(number, set()).add(name)
        rows = database.execute(
            "SELECT jobs.number, jobs.id, jobs.state, jobs.attempt, attempts,"
            " count(deliveries.id), max(deliveries.id)"
            " FROM jobs LEFT JOIN deliveries ON job_number = jobs.number GROUP BY jobs.number"
        ).fetchall()
    return {row[1]: LeftJob(*row[1:], frozenset(files.get(row[0], ()))) for row in rows}


def assert_folder_is_clean(data):
    """Blobs are exactly those that rows name, each with the bytes of its name; nothing is beside.

    Holds once a round of cleaning was done after the last fault.
    """
    with closing(sqlite3.connect(data / "occluder.db")) as database:
        assert database.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        named = dict(database.execute("SELECT digest, size FROM job_files"))
    stored = {path.parent.name + path.name: path for path in (data / "blobs").glob("??/*")}
    assert stored.keys() == named.keys()
    for digest, path in stored.items():
        assert path.stat().st_size == named[digest]
        assert hashlib.sha256(path.read_bytes()).hexdigest() == digest
    assert list((data / "blobs" / "drafts").iterdir()) == []
    assert list((data / "scratch").iterdir()) == []
