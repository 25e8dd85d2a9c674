"""Stored files that rot or vanish under a running server: nobody is given a wrong byte as whole,
and what was lost is there again once somebody sends it or asks for it.
"""

from __future__ import annotations

import hashlib
import random
import re
import shutil

import httpx
import pytest

from tests.acceptance.command import occluder
from tests.service.real import BOX
from tests.service.storage.blobs.rot import flip
from tests.waiting import until


def blob_path(serving, file):
    """Where the bytes of a listed file lie."""
    return serving.data / "blobs" / file["sha256"][:2] / file["sha256"][2:]


def flip_somewhere(rng, path):
    if path.stat().st_size:
        flip(path, rng.randrange(path.stat().st_size))


def cut(rng, path):
    path.chmod(0o600)
    with path.open("r+b") as file:
        file.truncate(rng.randrange(path.stat().st_size))


def lose(rng, path):
    path.unlink()


HARMS = (flip_somewhere, flip_somewhere, cut, lose)


class Mesh:
    """One that is sent again and again; its result has a file that no other work makes alike."""

    def __init__(self, serving, number, size):
        self._serving = serving
        self._body = f"# fill {size}\n# {number}\n".encode() + BOX

    def done(self):
        """The id of a job that has its result, and whether that was stored."""
        answer = self._serving.post(body=self._body)
        assert answer.status_code in (200, 202), answer.text
        job_id = answer.headers["Location"].rpartition("/")[2]
        job = self._serving.end_of(job_id)
        assert job["state"] == "succeeded", job
        return job_id, answer.status_code == 200


def files_of(serving, job_id):
    return serving.get(f"/v1/jobs/{job_id}/files").raise_for_status().json()["items"]


def was_served_wrongly(serving, file):
    """Whether an answer came to its end with other bytes than it promised; it may break off."""
    try:
        answer = serving.get(file["link"])
    except httpx.RemoteProtocolError:
        return False
    if answer.status_code == 404:
        return False
    assert answer.status_code == 200, answer.text
    return hashlib.sha256(answer.content).hexdigest() != file["sha256"]


def metric(serving, name):
    return float(re.search(rf"^{name} (\S+)$", serving.get("/metrics").text, re.MULTILINE)[1])


@pytest.mark.parametrize(
    ("meshes", "rounds", "seed"),
    [
        pytest.param(3, 4, 5, id="short"),
        pytest.param(12, 200, 2, id="long", marks=pytest.mark.faults),
    ],
)
def test_rot_and_loss_reach_nobody_and_are_made_good(server, meshes, rounds, seed):
    rng = random.Random(seed)
    serving = server(OCCLUDER_WORKERS="1", OCCLUDER_SCRUB_DAYS="0").start()
    sent = [Mesh(serving, number, rng.choice([10, 5_000, 300_000])) for number in range(meshes)]
    harmed = redone = restarts = 0
    for _ in range(rounds):
        mesh = rng.choice(sent)
        job_id, _ = mesh.done()
        victims = rng.sample(files_of(serving, job_id), k=rng.choice([1, 1, 2]))
        for file in victims:
            path = blob_path(serving, file)
            if path.exists():  # two files may be one blob
                rng.choice(HARMS)(rng, path)
                harmed += 1
        if rng.random() < 0.05:
            serving.kill()
            serving.start()
            restarts += 1
        if rng.random() < 0.8:  # else whoever sends it again is the first to meet with it
            assert not any(was_served_wrongly(serving, file) for file in victims)
        for _ in range(4):
            job_id, stored = mesh.done()
            redone += not stored
            if not any(was_served_wrongly(serving, one) for one in files_of(serving, job_id)) and (
                all_there(serving, job_id)
            ):
                break
        serving.assert_served_whole(job_id)
    aside = list((serving.data / "blobs" / "damaged").iterdir())
    assert metric(serving, "occluder_corrupt_blobs") == len(aside)
    assert "Traceback" not in serving.log
    for mesh in sent:
        job_id, _ = mesh.done()
        serving.assert_served_whole(job_id)
    print(
        f"{harmed} files harmed in {rounds} rounds over {restarts} kills: none was served wrongly, "
        f"{redone} results made again, {len(aside)} blobs aside, of old jobs alone"
    )


def all_there(serving, job_id):
    return all(serving.get(file["link"]).status_code == 200 for file in files_of(serving, job_id))


def test_a_damaged_upload_fails_its_job_and_sending_it_again_heals(server, tmp_path):
    gate = tmp_path / "gate"
    serving = server(OCCLUDER_WORKERS="1", OCCLUDER_SCRUB_DAYS="0").start()
    holding = serving.submit(f"# wait {gate}")
    waiting = serving.submit("# 1")
    mesh = files_of(serving, waiting)[0]
    flip(blob_path(serving, mesh), 5)
    gate.touch()
    assert serving.end_of(holding)["state"] == "succeeded"
    job = serving.end_of(waiting)
    assert (job["state"], job["failure"]["kind"]) == ("failed", "upload-lost")
    assert metric(serving, "occluder_broken_reads_total") == 1
    assert metric(serving, "occluder_corrupt_blobs") == 1
    assert serving.post(f"/v1/jobs/{waiting}/retry", b"").status_code == 409
    again = serving.end_of(serving.submit("# 1"))
    assert again["state"] == "succeeded"
    assert metric(serving, "occluder_corrupt_blobs") == 0
    assert serving.post(f"/v1/jobs/{waiting}/retry", b"").status_code == 202
    serving.assert_served_whole(again["id"])


@pytest.mark.faults
def test_the_scrub_finds_what_nobody_reads_and_verify_repairs_it_beside_the_server(
    server, declared, tmp_path
):
    rng = random.Random(5)
    serving = server(OCCLUDER_SCRUB_DAYS="0").start()
    ids = [serving.submit(f"# fill 3000\n# {number}") for number in range(20)]
    for job_id in ids:
        serving.end_of(job_id)
    serving.stop()
    backup = tmp_path / "backup"
    occluder("verify", "--data", serving.data, PYTHONPATH=declared)
    copy_of(serving.data, backup)

    serving.start(OCCLUDER_SCRUB_DAYS="0.0002", OCCLUDER_SCRUB_RATE=str(1 << 30))
    blobs = sorted((serving.data / "blobs").glob("??/*"))
    harmed = rng.sample(blobs, k=8)
    for path in harmed[:5]:
        flip(path, rng.randrange(path.stat().st_size))
    for path in harmed[5:]:
        path.unlink()
    until(lambda: metric(serving, "occluder_scrub_damage_total") == 5, 120.0)
    until(lambda: metric(serving, "occluder_lost_blobs") == 3, 120.0)
    assert metric(serving, "occluder_corrupt_blobs") == 5
    assert metric(serving, "occluder_oldest_blob_check_seconds") < 120.0
    read = metric(serving, "occluder_scrubbed_blobs_total")

    told = occluder("verify", "--data", serving.data, PYTHONPATH=declared)
    assert (told.returncode, len(told.stdout.splitlines())) == (1, 8), told.stderr
    done = occluder(
        "verify", "--repair", "--from", backup, "--data", serving.data, PYTHONPATH=declared
    )
    assert (done.returncode, done.stdout) == (0, ""), done.stderr
    assert "8 put right" in done.stderr
    assert metric(serving, "occluder_corrupt_blobs") == 0
    for job_id in ids:
        serving.assert_served_whole(job_id)
    until(lambda: metric(serving, "occluder_lost_blobs") == 0, 120.0)
    assert "Traceback" not in serving.log
    print(
        f"5 damaged and 3 lost of {len(blobs)} found by the scrub, {read:.0f} reads in; put right "
        f"from a copy beside the server: {done.stderr.strip()}"
    )


def copy_of(folder, target):
    shutil.copytree(folder / "blobs", target / "blobs")


@pytest.mark.faults
def test_reading_that_takes_too_long_ends_and_the_worker_goes_on(server):
    """By the library, in whatever it is at just then."""
    serving = server(work=None, OCCLUDER_WORKERS="1", OCCLUDER_READ_SECONDS="0.5").start()
    quick = "&resolution=8&moves=0&views=4&image=32&lods=1"
    assert serving.end_of(serving.submit(query=quick), 300)["state"] == "succeeded"
    answer = serving.post(body=b"v 0.123456 0.654321 0.333333\n" * 3_000_000 + BOX)
    assert answer.status_code == 202
    job = serving.end_of(answer.json()["id"])
    assert (job["state"], job["failure"]["kind"]) == ("failed", "out-of-time"), job
    assert "reading" in job["failure"]["detail"]
    after = serving.end_of(serving.submit("# after", quick))
    assert after["state"] == "succeeded"
    print(f"reading was ended: {job['failure']['detail']}")
