"""Files made by a process of their own: once, in a bounded line, whatever happens to it."""

from __future__ import annotations

import io
import os
import signal
from collections.abc import Sequence
from concurrent.futures import Future, wait
from pathlib import Path

import pytest

from service.engines.on_demand import _MOST, _MOST_OF_TENANT, OnDemand
from service.errors import JobFailedError, NotFoundError, NotReadyError, ServiceError
from service.jobs.job import Job, JobFile, JobKind, Submission, Summary
from service.settings import Settings
from service.storage.job_store import SqlJobStore
from tests.service.engines.memory import FolderBlobs
from tests.service.storage.fresh import fresh_database
from tests.waiting import until

WORK = "tests.service.engines.works:start_on_demand"


class Desk:
    """Jobs that are done but for their pages, and who draws these."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.database = fresh_database(folder / "occluder.db")
        self.jobs = SqlJobStore(self.database)
        self.blobs = FolderBlobs(folder / "blobs")
        (folder / "scratch").mkdir()
        settings = Settings(data=folder, lease_seconds=5.0)
        self.on_demand = OnDemand(self.jobs, self.blobs, settings, folder / "scratch", WORK)
        self.note = folder / "note"

    def job(
        self,
        do: str = "draw",
        tenant: str = "me",
        results: Sequence[str] = ("lod0.glb", "lod0.ply"),
    ) -> Job:
        def stored(name: str, text: str, is_input: bool = False) -> JobFile:
            blob = self.blobs.put(io.BytesIO(text.encode()))
            return JobFile(name, blob, "x/y", is_input, "cat.obj" if is_input else None)

        options = {"do": do, "note": str(self.note)}
        mesh = stored("input/mesh.obj", f"mesh of {tenant} {do}", is_input=True)
        job, _ = self.jobs.submit(
            Submission(
                tenant=tenant, kind=JobKind.OCCLUDER, name="cat.obj", options=options,
                inputs=(mesh,), version="1", may_reuse=False,
            ),
            1000,
        )  # fmt: skip
        claim = self.jobs.claim("one", 60.0)
        assert claim is not None
        assert claim.job.id == job.id
        made = [stored(name, f"{name} of {do}") for name in ("report.json", *results)]
        assert self.jobs.succeed(claim, made, Summary(1, 2, 1, 0.1))
        return self.jobs.job(None, job.id)

    def make(self, job: Job, name: str = "report.html") -> Future[None]:
        return self.on_demand.make(job, name)

    def names(self, job: Job) -> set[str]:
        return {file.name for file in self.jobs.files(job.id)}

    @property
    def begun(self) -> list[int]:
        """The process of each drawing that was begun."""
        return [int(line) for line in self.note.read_text().split()] if self.note.exists() else []


@pytest.fixture
def desk(tmp_path: Path):
    desk = Desk(tmp_path)
    desk.on_demand.start()
    yield desk
    desk.on_demand.stop()
    desk.database.close()
    assert not list((tmp_path / "scratch").iterdir())
    assert not [pid for pid in desk.begun if Path(f"/proc/{pid}").exists()]


def test_pages_are_drawn_once_for_all_who_ask_and_become_files(desk: Desk) -> None:
    job, other = desk.job(), desk.job(tenant="rival")
    asked = [desk.make(job) for _ in range(5)] + [desk.make(other)]
    for one in asked:
        assert one.result(30.0) is None
    assert desk.names(job) == {
        "input/mesh.obj", "report.json", "lod0.glb", "lod0.ply", "report.html",
        "pictures/recall.png",
    }  # fmt: skip
    page = next(file for file in desk.jobs.files(job.id) if file.name == "report.html")
    assert desk.blobs.path(page.blob).read_text() == "lod0.ply mesh report.json of cat.obj"
    assert page.media_type.startswith("text/html")
    desk.make(job).result(30.0)
    assert len(desk.begun) == 2  # one each
    assert len(set(desk.begun)) == 1  # by one warm process


def test_of_a_job_that_kept_little_each_file_is_made_by_itself(desk: Desk) -> None:
    job = desk.job(results=("occluder.glb", "levels.npz"))
    names = ("lod0.obj", "lod0.ply", "occluder.occ", "original.glb", "lod0.obj")
    for one in [desk.make(job, name) for name in names]:
        one.result(30.0)
    made = {file.name: desk.blobs.path(file.blob).read_text() for file in desk.jobs.files(job.id)}
    assert {name: made[name] for name in names} == {
        "lod0.obj": "lod0.obj of levels.npz", "lod0.ply": "lod0.ply of levels.npz",
        "occluder.occ": "occluder.occ of levels.npz", "original.glb": "original.glb of mesh",
    }  # fmt: skip
    assert len(desk.begun) == 4
    desk.make(job, "report.html").result(30.0)
    assert "report.html" in desk.names(job)


def test_nothing_comes_of_a_name_that_no_file_has(desk: Desk) -> None:
    job = desk.job(results=("occluder.glb", "levels.npz"))
    for name in ("lod1.obj", "lod0.fbx", "lod00.obj", "../lod0.obj", "input/mesh.ply", "levels"):
        desk.make(job, name).result(30.0)
    desk.make(desk.job(), "lod0.obj").result(30.0)  # which has no levels to make it from
    assert desk.begun == []


@pytest.mark.parametrize(
    ("deed", "kind", "words"),
    [
        ("fail", JobFailedError, "it is a cat"),
        ("die", NotReadyError, "its process"),
        ("fault", JobFailedError, "ZeroDivisionError"),
        ("fill_once", ServiceError, "no room"),
    ],
)
def test_what_cannot_be_drawn_is_told_and_keeps_nobody_else(
    desk: Desk, deed: str, kind: type[ServiceError], words: str
) -> None:
    bad, good = desk.job(deed), desk.job()
    told, drawn = desk.make(bad), desk.make(good)
    with pytest.raises(kind, match=words):
        told.result(30.0)
    drawn.result(30.0)
    assert "report.html" in desk.names(good)
    assert "report.html" not in desk.names(bad)


def test_a_mesh_that_is_stored_no_more_is_told(desk: Desk) -> None:
    job = desk.job()
    mesh = next(file for file in desk.jobs.files(job.id) if file.is_input)
    desk.blobs.path(mesh.blob).unlink()
    with pytest.raises(NotFoundError, match="no longer stored"):
        desk.make(job).result(30.0)


def test_a_process_that_is_killed_or_stopped_costs_one_try(desk: Desk) -> None:
    for number in (signal.SIGKILL, signal.SIGSTOP):
        begun = len(desk.begun)
        told = desk.make(desk.job("wait"))
        until(lambda count=begun: len(desk.begun) > count)
        os.kill(desk.begun[-1], number)
        with pytest.raises(NotReadyError):
            told.result(60.0)
    desk.make(desk.job()).result(30.0)


def test_the_line_has_an_end_for_each_tenant_and_for_all(desk: Desk) -> None:
    """What waits as the service ends is told to come again."""
    asked = [desk.make(desk.job("wait")) for _ in range(_MOST_OF_TENANT)]
    with pytest.raises(NotReadyError) as refused:
        desk.make(desk.job())
    assert refused.value.headers == {"Retry-After": "5"}
    tenant = 0
    while len(asked) < _MOST:
        tenant += 1
        jobs = [desk.job(tenant=f"rival {tenant}") for _ in range(_MOST_OF_TENANT)]
        asked += map(desk.make, jobs)
    with pytest.raises(NotReadyError):
        desk.make(desk.job(tenant="one more"))
    until(lambda: desk.begun)
    desk.on_demand.stop()
    assert not wait(asked, 5.0).not_done
    assert all(isinstance(one.exception(), NotReadyError) for one in asked)
    with pytest.raises(NotReadyError):
        desk.make(desk.job())


def test_pages_of_a_job_that_is_forgotten_meanwhile_are_dropped(desk: Desk) -> None:
    job = desk.job()
    desk.jobs.expire(2e10)
    assert not desk.jobs.add_files(job.id, desk.jobs.files(job.id))
    with pytest.raises(NotFoundError, match="no longer stored"):
        desk.make(job).result(30.0)
    assert not desk.begun
