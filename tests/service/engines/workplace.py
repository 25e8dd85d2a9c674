"""An engine over plain stores, and how to wait for what it does."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path

from service.engines.engine import Engine
from service.engines.failures import server_ended
from service.jobs.job import JobFile, JobKind, Submission
from service.jobs.progress import ProgressBoard
from service.settings import Settings
from tests.service.engines.memory import FolderBlobs, MemoryJobs
from tests.waiting import until

WORK = "tests.service.engines.works:start"


class Workplace:
    """Stores in a folder, and the engine that works on them while a block lasts."""

    def __init__(self, folder: Path, work: str = WORK, **settings):
        self.folder = folder
        self.jobs = MemoryJobs()
        self.blobs = FolderBlobs(folder / "blobs")
        self.board = ProgressBoard()
        self.ended = []
        self.settings = Settings(data=folder, **{"workers": 2, **settings})
        self.work = work
        (folder / "scratch").mkdir()

    @contextlib.contextmanager
    def open(self):
        self.engine = Engine(
            self.jobs, self.blobs, self.board, self.settings, self.folder / "scratch",
            self.ended.append, self.work,
        )  # fmt: skip
        self.engine.start(self.reclaim)
        try:
            yield self
        finally:
            self.engine.stop()

    def reclaim(self):
        for job in self.jobs.recover(server_ended(), all_leases=True):
            if job.state.ended:
                self.ended.append(job)

    def submit(self, do="copy", *, text="mesh", wake=True, attempts=3, request_id=None, **options):
        return self.submit_files(
            JobKind.OCCLUDER, {"input/mesh.obj": text.encode()}, {"do": do, **options},
            name="cat.obj", wake=wake, attempts=attempts, request_id=request_id,
        )  # fmt: skip

    def submit_files(
        self, kind, files, options, *, name, labels=(), wake=True, attempts=3, request_id=None
    ):
        called = dict(labels)
        inputs = tuple(
            JobFile(path, self.blobs.put(io.BytesIO(data)), "x/y", True, called.get(path))
            for path, data in files.items()
        )
        submission = Submission(
            tenant="me", kind=kind, name=name, options=options, inputs=inputs, version="1",
            attempts=attempts, request_id=request_id,
        )  # fmt: skip
        job, _ = self.jobs.submit(submission, 1000)
        if wake:
            self.engine.wake()
        return job.id

    def job(self, job_id):
        return self.jobs.job(None, job_id)

    def end_of(self, job_id, seconds=30.0):
        return until(lambda: self.job(job_id).state.ended and self.job(job_id), seconds)

    def results(self, job_id):
        return {
            one.name: self.blobs.path(one.blob).read_bytes()
            for one in self.jobs.files(job_id)
            if not one.is_input
        }
