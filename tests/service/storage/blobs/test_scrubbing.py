"""All blobs are read anew, folder by folder, and what is wrong is found and told."""

from __future__ import annotations

import io
import logging
import threading
import time

import pytest

from service.jobs.job import JobFile
from service.jobs.stores import FOLDERS
from service.storage.blobs.file_blobs import FileBlobs
from service.storage.blobs.scrubbing import Findings, Scrubber, Stopped
from service.storage.check_store import FolderCheck, Named, SqlCheckStore
from tests.service.storage.blobs.blob_store_contract import put_now
from tests.service.storage.blobs.rot import flip
from tests.service.storage.samples import submission
from tests.waiting import until

DAY = 86_400.0


@pytest.fixture
def blobs(tmp_path):
    return FileBlobs(tmp_path / "blobs")


@pytest.fixture
def checks(database, clock):
    found = SqlCheckStore(database, clock)
    found.begin()
    return found


@pytest.fixture
def scrubber(blobs, checks, clock):
    return Scrubber(blobs.places, checks, 30.0, 1 << 40, clock)


def stored(blobs, jobs, data):
    """A blob that is the input of a job."""
    with blobs.keeping() as keeping:
        blob = keeping.put(io.BytesIO(data))
        file = JobFile("input/mesh.obj", blob, "model/obj", is_input=True)
        job, _ = jobs.submit(submission(inputs=(file,)), 1000)
    return blob, job


def once_around(scrubber):
    """Every folder once; all findings together."""
    found = [scrubber.read_next(threading.Event()) for _ in range(FOLDERS)]
    return Findings(
        sum(one.checked for one in found),
        sum(one.size for one in found),
        tuple(sorted(digest for one in found for digest in one.damaged)),
        tuple(sorted(digest for one in found for digest in one.lost)),
    )


def test_rot_and_loss_are_found_and_rot_is_put_aside(blobs, jobs, scrubber, caplog):
    contents = [bytes([number]) * 1000 for number in range(40)]
    kept = [stored(blobs, jobs, data)[0] for data in contents]
    rotten, gone, fine = kept[3], kept[4], kept[5:]
    nobodys = put_now(blobs, b"of no row")
    flip(blobs.path(rotten))
    blobs.path(gone).unlink()
    found = once_around(scrubber)
    assert found == Findings(40, 39 * 1000 + 9, (rotten.digest,), (gone.digest,))
    assert not blobs.has(rotten)
    assert all(map(blobs.has, [*fine, nobodys]))
    assert rotten.digest in caplog.text
    assert gone.digest in caplog.text
    figures = scrubber.figures()
    assert (figures.checked, figures.damaged, figures.lost) == (40, 1, 1)

    stored(blobs, jobs, contents[3])
    stored(blobs, jobs, contents[4])
    assert once_around(scrubber) == Findings(41, 40 * 1000 + 9)
    figures = scrubber.figures()
    assert (figures.checked, figures.damaged, figures.lost) == (81, 1, 0)


def test_what_is_swept_while_it_is_read_is_neither_damaged_nor_lost(blobs, jobs, scrubber):
    blob, job = stored(blobs, jobs, b"x" * 1000)
    before = scrubber.checks.named

    def named(folder):
        found = before(folder)
        if blob.digest in found and blobs.has(blob):
            jobs.cancel(None, job.id)
            jobs.expire(float("inf"))
            blobs.sweep(jobs.unnamed)
        return found

    scrubber.checks.named = named
    assert once_around(scrubber) == Findings(1, 1000)


def test_one_folder_after_the_other_over_the_days(scrubber, clock):
    """The first begins a share of the days after the start, whoever restarts how often."""
    share = 30.0 * DAY / FOLDERS
    assert scrubber.pause() == pytest.approx(share)
    clock.now += share
    assert scrubber.pause() == pytest.approx(0.0, abs=1e-6)
    scrubber.read_next(threading.Event())
    clock.now += share / 2
    assert scrubber.pause() == pytest.approx(share / 2)
    assert scrubber.figures().oldest_age == pytest.approx(1.5 * share)
    assert scrubber.checks.all()[-1] == FolderCheck(0, clock.now - share / 2)


def test_what_is_too_old_is_read_at_once(scrubber, clock):
    clock.now += 40.0 * DAY
    for _ in range(FOLDERS):
        assert scrubber.pause() == 0.0
        scrubber.read_next(threading.Event())
    assert scrubber.pause() > 0.0
    assert scrubber.figures().oldest_age == 0.0


def test_a_clock_that_is_set_back_has_no_folder_read_twice(scrubber, clock):
    clock.now += 40.0 * DAY
    for _ in range(FOLDERS):
        scrubber.read_next(threading.Event())
        clock.now -= DAY
    assert [one.folder for one in scrubber.checks.all()] == list(range(FOLDERS))


def test_it_is_slow_and_ends_at_once(blobs, checks, clock):
    blob = put_now(blobs, b"x" * 3_000_000)
    checks.note(FolderCheck(int(blob.digest[:2], 16), 0.0))  # so its folder is the next
    scrubber, stop = Scrubber(blobs.places, checks, 30.0, 1 << 20, clock), threading.Event()
    threading.Timer(0.2, stop.set).start()
    begin = time.monotonic()
    with pytest.raises(Stopped):
        scrubber.read_next(stop)
    assert 0.15 < time.monotonic() - begin < 2.0


def test_it_runs_by_itself_and_goes_on_after_trouble(blobs, jobs, database, caplog, monkeypatch):
    monkeypatch.setattr("service.storage.blobs.scrubbing._GLANCE", 0.01)
    blob, _ = stored(blobs, jobs, b"rotten")
    flip(blobs.path(blob))
    checks = SqlCheckStore(database)
    scrubber = Scrubber(blobs.places, checks, 1e-6, 1 << 40)
    faults = [OSError("the disk is away"), RuntimeError("a fault")]
    real = checks.note

    def note(check: FolderCheck) -> None:
        if faults:
            raise faults.pop()
        real(check)

    monkeypatch.setattr(checks, "note", note)
    with caplog.at_level(logging.INFO), scrubber.running():
        until(lambda: not blobs.has(blob) and not faults)
    assert caplog.text.count("cannot be checked at the moment") == 2
    assert not [thread for thread in threading.enumerate() if thread.name == "scrubber"]


def test_without_days_nothing_is_read(blobs, checks):
    blob = put_now(blobs, b"rotten")
    flip(blobs.path(blob))
    with Scrubber(blobs.places, checks, 0.0, 1 << 40).running():
        assert not [thread for thread in threading.enumerate() if thread.name == "scrubber"]
    assert blobs.has(blob)


def test_a_blob_is_told_by_the_files_that_it_is(blobs, jobs, checks):
    blob, job = stored(blobs, jobs, b"a mesh")
    stored(blobs, jobs, b"a mesh")
    assert checks.name_of(blob.digest) == Named(job.id, "input/mesh.obj", 1)
    assert checks.name_of("0" * 64) is None
