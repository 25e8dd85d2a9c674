"""``occluder verify`` on a folder of a service: what it finds, what it puts right, how it ends."""

from __future__ import annotations

import io
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest

from service.jobs.job import JobFile
from service.storage.blobs.file_blobs import FileBlobs
from service.storage.check_store import SqlCheckStore
from service.storage.data_folder import DataFolder
from service.storage.job_store import SqlJobStore
from service.storage.sqlite import SqliteDatabase
from tests.acceptance.command import OCCLUDER, environment
from tests.service.storage.blobs.rot import flip
from tests.service.storage.fresh import fresh_database
from tests.service.storage.samples import submission
from tests.waiting import until

CONTENTS = [bytes([number]) * 10_000 for number in range(8)]


class Folder:
    """A service's folder with a job for each content."""

    def __init__(self, path, contents=CONTENTS):
        self.place = DataFolder(path)
        self.place.make()
        database = fresh_database(self.place.database)
        jobs, self.blobs = SqlJobStore(database), FileBlobs(self.place.blobs)
        self.jobs, self.stored = [], []
        for data in contents:
            with self.blobs.keeping() as keeping:
                blob = keeping.put(io.BytesIO(data))
                file = JobFile("input/mesh.obj", blob, "model/obj", is_input=True)
                self.jobs.append(jobs.submit(submission(inputs=(file,)), 1000)[0].id)
                self.stored.append(blob)
        database.close()

    def rot(self, *numbers):
        for number in numbers:
            flip(self.blobs.path(self.stored[number]))

    def lose(self, *numbers):
        for number in numbers:
            self.blobs.path(self.stored[number]).unlink()

    def are_right(self, *numbers):
        return [
            self.blobs.has(self.stored[number])
            and self.blobs.path(self.stored[number]).read_bytes() == CONTENTS[number]
            for number in numbers
        ]


@pytest.fixture
def folder(tmp_path):
    return Folder(tmp_path / "occluder_data")


def test_a_sound_folder_is_told_so(here, folder):
    ended = here("verify")
    assert (ended.returncode, ended.stdout) == (0, ""), ended.stderr
    assert "8 files, 0.1 MiB" in ended.stderr
    assert "all are right" in ended.stderr


def test_what_is_wrong_is_told_by_file_and_job_and_nothing_is_changed(here, folder):
    folder.rot(1)
    folder.lose(2)
    before = folder.blobs.path(folder.stored[1]).read_bytes()
    ended = here("verify")
    assert ended.returncode == 1
    assert sorted(ended.stdout.splitlines()) == sorted([
        f"{folder.stored[1].digest}: damaged: input/mesh.obj of job {folder.jobs[1]}",
        f"{folder.stored[2].digest}: gone: input/mesh.obj of job {folder.jobs[2]}",
    ])  # fmt: skip
    assert "error: 7 files" in ended.stderr
    assert "1 damaged, 1 gone" in ended.stderr
    assert "--repair" in ended.stderr
    assert folder.blobs.path(folder.stored[1]).read_bytes() == before


def test_repair_puts_damaged_ones_aside_and_says_what_is_left(here, folder):
    folder.rot(1)
    ended = here("verify", "--repair")
    assert ended.returncode == 1
    assert "made again when somebody asks" in ended.stderr
    assert not folder.blobs.has(folder.stored[1])
    again = here("verify")
    assert again.returncode == 1
    assert f"{folder.stored[1].digest}: damaged, and put aside before: " in again.stdout
    with folder.blobs.keeping() as keeping:  # somebody sends it
        keeping.put(io.BytesIO(CONTENTS[1]))
    assert here("verify").returncode == 0


def test_repair_takes_from_a_copy_what_is_right_there(here, folder, tmp_path):
    copy = tmp_path / "backup"
    shutil.copytree(folder.place.path, copy)
    folder.rot(1, 3)
    folder.lose(2, 4)
    flip(copy / "blobs" / folder.stored[3].digest[:2] / folder.stored[3].digest[2:])
    ended = here("verify", "--repair", "--from", copy)
    assert ended.returncode == 1
    assert [line.split(": ")[:2] for line in ended.stdout.splitlines()] == [
        [folder.stored[3].digest, "damaged"]
    ]
    assert "1 damaged, 3 put right" in ended.stderr
    assert folder.are_right(*range(8)) == [number != 3 for number in range(8)]
    assert list(folder.blobs.places.drafts.iterdir()) == []

    # The backup of another day has the last one.
    place = copy / "blobs" / folder.stored[3].digest[:2] / folder.stored[3].digest[2:]
    place.chmod(0o600)
    place.write_bytes(CONTENTS[3])
    last = here("verify", "--repair", "--from", copy / "blobs")
    assert (last.returncode, last.stdout) == (0, "")
    assert "1 put right" in last.stderr
    assert all(folder.are_right(*range(8)))
    assert folder.blobs.places.digests_aside() == []


def test_repair_puts_back_what_is_right_after_all(here, folder):
    """Where memory or a cable was bad when it was put aside."""
    place = folder.blobs.path(folder.stored[5])
    place.replace(folder.blobs.places.place_aside(folder.stored[5].digest))
    ended = here("verify", "--repair")
    assert ended.returncode == 0, ended.stderr
    assert "1 put right" in ended.stderr
    assert all(folder.are_right(5))


def test_a_whole_run_counts_as_a_check_of_everything(here, folder):
    begin = time.time()
    here("verify")
    database = SqliteDatabase.open(folder.place.database)
    try:
        assert min(one.checked for one in SqlCheckStore(database).all()) >= begin
    finally:
        database.close()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--data", "nowhere"), "not a folder of a service"),
        (("--from", "copy"), "--repair"),
        (("--repair", "--from", "nowhere"), "has no blobs"),
    ],
)
def test_wrong_values_are_refused_in_a_line(here, folder, tmp_path, arguments, said):
    ended = here("verify", *arguments)
    assert (ended.returncode, ended.stdout) == (2, "")
    (line,) = ended.stderr.splitlines()
    assert line.startswith("error: ")
    assert said in line
    assert not (tmp_path / "nowhere").exists()


def test_ctrl_c_ends_it_at_once_and_keeps_what_was_found(declared, tmp_path):
    folder = Folder(tmp_path / "data", [bytes(10_000), bytes([1]) * 100])
    digests = sorted(one.digest for one in folder.stored)
    first = digests[0]
    flip(folder.blobs.places.place(first))
    # The last one is as large as a disk, and takes no room: reading it takes minutes.
    huge = folder.blobs.places.place("ff" * 32)
    with huge.open("wb") as file:
        file.truncate(1 << 38)
    process = subprocess.Popen(
        [*OCCLUDER, "verify", "--data", tmp_path / "data"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env=environment(PYTHONPATH=declared),
    )  # fmt: skip
    try:
        handles = f"/proc/{process.pid}/fd"
        until(lambda: _has_open(handles, huge), 30.0)
        begin = time.monotonic()
        process.send_signal(signal.SIGINT)
        said, errors = process.communicate(timeout=30)
    finally:
        process.kill()
    assert time.monotonic() - begin < 3.0
    assert process.returncode == 130, errors
    assert said.startswith(f"{first}: damaged: ")
    assert "interrupted; 2 files" in errors


def _has_open(handles, path):
    try:
        links = [one.readlink() for one in Path(handles).iterdir()]
    except OSError:
        return False
    return path in links
