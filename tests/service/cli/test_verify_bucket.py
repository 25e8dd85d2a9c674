"""``occluder verify`` where the files are in a bucket: the same as with a folder."""

from __future__ import annotations

import io
from contextlib import closing, contextmanager

import pytest

from service.jobs.job import JobFile
from service.settings import Settings
from service.storage.blobs.bucket import Bucket
from service.storage.blobs.opening import open_blobs
from service.storage.data_folder import DataFolder
from service.storage.job_store import SqlJobStore
from tests.service.cli.test_verify import CONTENTS, Folder
from tests.service.storage.blobs.s3_stores import keys_in
from tests.service.storage.samples import submission


class Place:
    """A database in a folder, and files of its jobs in a bucket."""

    def __init__(self, folder, url):
        self.settings = Settings(data=folder, blobs=url)
        self.place, self.bucket = DataFolder(folder), Bucket.open(url)
        self.place.make()

    @contextmanager
    def open(self):
        with (
            closing(self.place.open_database()) as database,
            open_blobs(self.settings, self.place, database) as blobs,
        ):
            yield blobs.store, SqlJobStore(database, rely_on=blobs.rely_on), blobs.inventory

    def fill(self):
        self.stored, self.jobs = [], []
        with self.open() as (blobs, jobs, _):
            for data in CONTENTS:
                with blobs.keeping() as keeping:
                    blob = keeping.put(io.BytesIO(data))
                    file = JobFile("input/mesh.obj", blob, "model/obj", is_input=True)
                    self.jobs.append(jobs.submit(submission(inputs=(file,)), 1000)[0].id)
                    self.stored.append(blob)
            self.keys = [blobs._ledger.key_of(blob) for blob in self.stored]

    def are_right(self):
        with self.open() as (blobs, _, _):
            return [blobs.check(blob) for blob in self.stored]


@pytest.fixture
def place(localbucket, tmp_path, monkeypatch):
    for name, value in localbucket.variables.items():
        monkeypatch.setenv(name, value)
    return Place(tmp_path / "occluder_data", f"s3://{localbucket.new_bucket()}/studio")


@pytest.fixture
def verify(here, place):
    return lambda *arguments: here("verify", *arguments, OCCLUDER_BLOBS=place.settings.blobs)


def test_what_is_wrong_is_told_put_aside_and_brought_back(verify, place, tmp_path):
    place.fill()
    sound = verify()
    assert (sound.returncode, sound.stdout) == (0, ""), sound.stderr
    assert "8 files, 0.1 MiB" in sound.stderr

    place.bucket.put(place.keys[1], b"others" * 100)
    place.bucket.delete([place.keys[2]])
    wrong = [
        f"{place.stored[1].digest}: damaged: input/mesh.obj of job {place.jobs[1]}",
        f"{place.stored[2].digest}: gone: input/mesh.obj of job {place.jobs[2]}",
    ]
    ended = verify()
    assert ended.returncode == 1
    assert sorted(ended.stdout.splitlines()) == sorted(wrong)
    assert "1 damaged, 1 gone" in verify("--repair").stderr
    again = verify()
    assert f"{place.stored[1].digest}: damaged, and put aside before: " in again.stdout
    assert f"{place.stored[2].digest}: gone: " in again.stdout

    backup = Folder(tmp_path / "backup")
    ended = verify("--repair", "--from", backup.place.path)
    assert ended.returncode == 0, ended.stdout
    assert "2 put right" in ended.stderr
    assert all(place.are_right())


def test_files_of_a_folder_can_be_brought_into_a_bucket(verify, here, place):
    """The way from one machine to several; a server refuses the empty bucket until then."""
    folder = Folder(place.place.path)
    refused = here("serve", "--port", "0", OCCLUDER_BLOBS=place.settings.blobs)
    assert refused.returncode == 2
    assert "occluder verify --repair --from" in refused.stderr
    ended = verify("--repair", "--from", place.place.path)
    assert ended.returncode == 0, ended.stderr
    assert "8 put right" in ended.stderr
    place.stored = folder.stored
    assert all(place.are_right())
    assert len(keys_in(place.bucket)) == 8
    back = here("verify", "--data", place.place.path)
    assert back.returncode == 2
    assert f"the files of this database are in '{place.bucket}'" in back.stderr
