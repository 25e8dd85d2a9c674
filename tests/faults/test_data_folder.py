"""One folder: two servers at once, and what the first version has left."""

from __future__ import annotations

import hashlib
import json
from concurrent.futures import ThreadPoolExecutor

import pytest
from alembic import command
from sqlalchemy import create_engine

from service.storage.schema import alembic_config
from tests.faults.remains import assert_folder_is_clean
from tests.service.real import BOX
from tests.waiting import until

FIRST = "0001"
"""The revision of the first version; what that one wrote is below, never to be changed."""


@pytest.mark.faults
def test_of_servers_started_at_once_one_has_the_folder(server):
    servers = [server(), server()]
    assert servers[0].address != servers[1].address
    with ThreadPoolExecutor() as pool:
        starts = [pool.submit(one.start) for one in servers]
    refused = [start.exception() for start in starts]
    assert sum(error is None for error in refused) == 1
    [said] = [str(error) for error in refused if error is not None]
    assert "is used by another server" in said
    winner = servers[refused.index(None)]
    assert winner.end_of(winner.submit())["state"] == "succeeded"


@pytest.mark.faults
def test_what_the_first_version_left_is_gone_on_with(server):
    serving = server()
    left_by_first_version(serving.data)
    serving.start()
    until(lambda: "cleaning freed" in serving.log)
    done, running, queued = (serving.end_of(f"{number:032x}") for number in (1, 2, 3))
    assert (done["state"], done["summary"]["recall"], done["attempt"]) == ("succeeded", 0.75, 1)
    assert done["asset"]["name"] == "props/box"
    assert (running["state"], running["attempt"]) == ("succeeded", 2)
    assert (queued["state"], queued["attempt"]) == ("succeeded", 1)
    for job in (done, running, queued):
        serving.assert_served_whole(job["id"])
    again = serving.post(headers={"Idempotency-Key": "first"})
    assert again.status_code == 202  # keys are forgotten after a day
    serving.end_of(again.json()["id"])
    serving.stop()
    assert_folder_is_clean(serving.data)


def left_by_first_version(folder):
    """A folder with a job that was done, one that was under way, and one that waited."""
    (folder / "blobs").mkdir(parents=True)
    with create_engine(f"sqlite:///{folder / 'occluder.db'}").begin() as connection:
        command.upgrade(alembic_config(connection), FIRST)
        execute = connection.exec_driver_sql
        execute(
            "INSERT INTO assets (number, id, tenant, name, folded, created)"
            " VALUES (1, ?, 'local', 'props/box', 'props/box', 1767225600.5)",
            ("a" * 32,),
        )
        for number, state in enumerate(("succeeded", "running", "queued"), start=1):
            options = json.dumps({"budget": 32, "seed": number})
            summary = json.dumps(
                {"triangles": 1, "input_triangles": 12, "levels": 1, "seconds": 0.5,
                 "precision": 1.0, "recall": 0.75, "worst_recall": 0.5, "worst_view": 3,
                 "error_bound": 0.1, "timings": {"refine": 0.25}, "warnings": []}
            )  # fmt: skip
            begun, ended = state != "queued", state == "succeeded"
            execute(
                "INSERT INTO jobs (number, id, tenant, kind, state, name, options, version,"
                " work_key, created, started, ended, attempt, attempts, asset_number,"
                " cancel_asked, summary, owner, beat, lease_seconds)"
                " VALUES (?, ?, 'local', 'occluder', ?, 'box.obj', ?, '0.1', ?, 1767225600.5,"
                " ?, ?, ?, 3, ?, 0, ?, ?, 0, 30.0)",
                (
                    number, f"{number:032x}", state, options, f"{number:064x}",
                    1767225601.5 if begun else None, 4102444800.0 if ended else None,
                    int(begun), 1 if ended else None, summary if ended else None,
                    "engine-1" if state == "running" else None,
                ),
            )  # fmt: skip
            files = {"input/mesh.obj": BOX + b"# %d\n" % number}
            if ended:
                files |= {"lod0.obj": BOX, "report.json": b"{}"}
            for name, data in files.items():
                execute(
                    "INSERT INTO job_files (job_number, name, digest, size, media_type, is_input)"
                    " VALUES (?, ?, ?, ?, 'model/obj', ?)",
                    (number, name, put(folder, data), len(data), name.startswith("input")),
                )
        execute(
            "INSERT INTO idempotency_keys (tenant, key, fingerprint, job_number)"
            " VALUES ('local', 'first', ?, 1)",
            ("f" * 64,),
        )


def put(folder, data):
    """Store a blob as the first version did; its digest."""
    digest = hashlib.sha256(data).hexdigest()
    place = folder / "blobs" / digest[:2]
    place.mkdir(exist_ok=True)
    (place / digest[2:]).write_bytes(data)
    return digest
