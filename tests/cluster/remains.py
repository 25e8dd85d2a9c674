"""What a cluster has left in database and bucket, looked at without any code of the service."""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections import defaultdict
from contextlib import closing

from tests.faults.remains import LeftJob


def jobs_left(cluster):
    """By id."""
    files = defaultdict(set)
    for number, name in cluster.rows("SELECT job_number, name FROM job_files WHERE NOT is_input"):
        files[number].add(name)
    rows = cluster.rows(
        "SELECT jobs.number, jobs.id, jobs.state, jobs.attempt, attempts,"
        " count(deliveries.id), max(deliveries.id)"
        " FROM jobs LEFT JOIN deliveries ON job_number = jobs.number GROUP BY jobs.number"
    )
    return {row[1]: LeftJob(*row[1:], frozenset(files.get(row[0], ()))) for row in rows}


def astray(cluster):
    """What keeps objects, and what the database says of them, from being those that jobs name."""
    named = {digest for (digest,) in cluster.rows("SELECT DISTINCT digest FROM job_files")}
    # Who is alive has keys in reserve, to which nothing was put yet.
    there = {path.name for path in cluster.objects.iterdir()} - {"identity"}
    alive = {owner for (owner,) in cluster.rows("SELECT id FROM blob_owners")}
    objects = [
        (key, state, digest)
        for key, state, digest, owner in cluster.rows(
            "SELECT key, state, digest, owner FROM blob_objects"
        )
        if not (state == "writing" and owner in alive and key not in there)
    ]
    kept = {digest for _, state, digest in objects if state == "stored"}
    told = {
        "missing": named - kept,
        "left over": kept - named,
        "not stored": {(key, state) for key, state, _ in objects if state != "stored"},
        "unknown": there - {key for key, *_ in objects},
        "gone": {key for key, *_ in objects} - there,
    }
    return {name: found for name, found in told.items() if found}


def assert_objects_are_whole(cluster):
    """Each has the bytes of its digest."""
    for key, digest in cluster.rows("SELECT key, digest FROM blob_objects WHERE state = 'stored'"):
        assert hashlib.sha256((cluster.objects / key).read_bytes()).hexdigest() == digest


_FILES = (
    "SELECT inputs.digest, made.name, made.digest FROM job_files AS made JOIN job_files AS inputs"
    " ON made.job_number = inputs.job_number WHERE inputs.is_input AND NOT made.is_input"
)


def files_by_input(cluster):
    """What was made, by the digest of the mesh and by name."""
    keys = dict(cluster.rows("SELECT digest, key FROM blob_objects WHERE state = 'stored'"))
    return _by_input(cluster.rows(_FILES), lambda digest: cluster.objects / keys[digest])


def files_by_input_alone(data):
    """The same of a server that has its database for itself, and has ended."""
    with closing(sqlite3.connect(data / "occluder.db")) as database:
        rows = database.execute(_FILES).fetchall()
    return _by_input(rows, lambda digest: data / "blobs" / digest[:2] / digest[2:])


def _by_input(rows, path_of):
    """Reports without the times that it took, other files by their digest."""
    found = defaultdict(dict)
    for mesh, name, digest in rows:
        made = digest
        if name == "report.json":
            report = json.loads(path_of(digest).read_bytes())
            del report["timings"]
            made = json.dumps(report)
        assert found[mesh].setdefault(name, made) == made
    return found
