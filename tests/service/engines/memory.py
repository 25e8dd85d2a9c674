"""The plain stores: what the promises of ``service.jobs.stores`` come to without a disk."""

from __future__ import annotations

import contextlib
import hashlib
import io
import itertools
import secrets
import shutil
import threading
import time
from dataclasses import dataclass, replace

from service.errors import ConflictError, NotFoundError, QueueFullError
from service.jobs.job import Blob, Claim, Job, JobState
from service.jobs.stores import JobPage


@dataclass
class Row:
    job: Job
    files: tuple
    owner: str = ""
    lease: float = 0.0


class MemoryJobs:
    """One lock, one dictionary."""

    def __init__(self):
        self.lock = threading.RLock()
        self.rows = {}
        self.numbers = itertools.count(1)
        self.endings = []

    def submit(self, submission, queue_limit):
        with self.lock:
            waiting = self.counts().get(JobState.QUEUED, 0)
            if waiting >= queue_limit:
                raise QueueFullError(waiting, 1)
            number = next(self.numbers)
            job = Job(
                id=secrets.token_hex(8), number=number, tenant=submission.tenant,
                kind=submission.kind, state=JobState.QUEUED, name=submission.name,
                options=submission.options, version=submission.version, created=time.time(),
                attempt=0, attempts=submission.attempts, asset=submission.asset,
                webhook=submission.webhook, retry_of=submission.retry_of,
                request_id=submission.request_id,
            )  # fmt: skip
            self.rows[job.id] = Row(job, submission.inputs)
            return job, True

    def job(self, tenant, job_id):
        with self.lock:
            row = self.rows.get(job_id)
            if row is None or tenant not in (None, row.job.tenant):
                raise NotFoundError(f"there is no job {job_id}")
            return row.job

    def jobs(self, tenant, wanted, *, before, limit):
        with self.lock:
            found = [row.job for row in self.rows.values() if tenant in (None, row.job.tenant)]
            return JobPage(tuple(found[::-1][:limit]), None)

    def files(self, job_id):
        with self.lock:
            return tuple(sorted(self.rows[job_id].files, key=lambda one: one.name))

    def unnamed(self, digests):
        with self.lock:
            named = {one.blob.digest for row in self.rows.values() for one in row.files}
            return set(digests) - named

    def counts(self):
        with self.lock:
            states = [row.job.state for row in self.rows.values()]
            return {state: states.count(state) for state in JobState}

    def cancel(self, tenant, job_id):
        with self.lock:
            job = self.job(tenant, job_id)
            if job.state.ended:
                raise ConflictError("it has ended")
            if job.state is JobState.QUEUED:
                return self._end(job_id, JobState.CANCELLED)
            return self._change(job_id, cancel_asked=True)

    def claim(self, owner, lease_seconds):
        with self.lock:
            for row in self.rows.values():
                if row.job.state is JobState.QUEUED:
                    job = self._change(
                        row.job.id, state=JobState.RUNNING, attempt=row.job.attempt + 1,
                        started=time.time(),
                    )  # fmt: skip
                    row.owner, row.lease = owner, time.time() + lease_seconds
                    inputs = tuple(one for one in row.files if one.is_input)
                    return Claim(job, owner, inputs)
            return None

    def renew(self, claims, lease_seconds):
        with self.lock:
            held = {}
            for claim in claims:
                if self._held(claim):
                    row = self.rows[claim.job.id]
                    row.lease = time.time() + lease_seconds
                    held[claim.job.id] = row.job.cancel_asked
            return held

    def cancelled(self, claims):
        with self.lock:
            wanted = [one.job.id for one in claims if one.job.id in self.rows]
            return frozenset(one for one in wanted if self.rows[one].job.cancel_asked)

    def succeed(self, claim, files, summary):
        with self.lock:
            if not self._held(claim):
                return False
            self.rows[claim.job.id].files += tuple(files)
            self._end(claim.job.id, JobState.SUCCEEDED, summary=summary)
            return True

    def fail(self, claim, failure, *, final):
        with self.lock:
            if not self._held(claim):
                return None
            return self._failed(claim.job.id, failure, final).state

    def put_off(self, claim, failure):
        with self.lock:
            return self.rows[claim.job.id].job.state if self.release(claim) else None

    def end_cancelled(self, claim):
        with self.lock:
            held = self._held(claim)
            if held:
                self._end(claim.job.id, JobState.CANCELLED)
            return held

    def release(self, claim):
        with self.lock:
            held = self._held(claim)
            if held and self.rows[claim.job.id].job.cancel_asked:
                self._end(claim.job.id, JobState.CANCELLED)
            elif held:
                attempts = self.rows[claim.job.id].job.attempts + 1
                self._change(claim.job.id, state=JobState.QUEUED, attempts=attempts)
            return held

    def recover(self, failure, *, all_leases):
        with self.lock:
            now = time.time()
            lost = [
                row.job.id
                for row in self.rows.values()
                if row.job.state is JobState.RUNNING and (all_leases or row.lease < now)
            ]
            return [self._failed(job_id, failure, False) for job_id in lost]

    def _held(self, claim):
        row = self.rows.get(claim.job.id)
        return (
            row is not None
            and row.job.state is JobState.RUNNING
            and (row.owner, row.job.attempt) == (claim.owner, claim.job.attempt)
        )

    def _failed(self, job_id, failure, final):
        job = self.rows[job_id].job
        if job.cancel_asked:
            return self._end(job_id, JobState.CANCELLED)
        if final or job.attempt >= job.attempts:
            return self._end(job_id, JobState.FAILED, failure=failure)
        return self._change(job_id, state=JobState.QUEUED)

    def _end(self, job_id, state, **changes):
        self.endings.append(job_id)
        return self._change(job_id, state=state, ended=time.time(), **changes)

    def _change(self, job_id, **changes):
        row = self.rows[job_id]
        row.job = replace(row.job, **changes)
        return row.job


class FolderBlobs:
    """Files by digest in one folder; nothing is ever swept."""

    def __init__(self, folder):
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    @contextlib.contextmanager
    def keeping(self):
        yield self

    def put(self, source):
        data = source.read()
        blob = Blob(hashlib.sha256(data).hexdigest(), len(data))
        draft = self.folder / secrets.token_hex(8)
        draft.write_bytes(data)
        draft.replace(self.folder / blob.digest)
        return blob

    def put_file(self, path):
        data = path.read_bytes()
        blob = Blob(hashlib.sha256(data).hexdigest(), len(data))
        shutil.move(path, self.folder / blob.digest)
        return blob

    def adopt(self, blob):
        self.path(blob)

    def has(self, blob):
        return (self.folder / blob.digest).exists()

    def path(self, blob, must_exist=True):
        path = self.folder / blob.digest
        if must_exist and not path.exists():
            raise KeyError(blob.digest)
        return path

    def lay_out(self, blob, place):
        place.symlink_to(self.path(blob))

    def check(self, blob):
        if not self.has(blob):
            return False
        if self.path(blob).is_dir():  # stands for what cannot be read
            self.path(blob).rmdir()
            return False
        found = hashlib.sha256(self.path(blob).read_bytes()).hexdigest()
        if found != blob.digest:
            self.path(blob).unlink()
        return found == blob.digest

    def is_right(self, blob):
        return self.check(blob)

    def open(self, blob, start=0, stop=None):
        return io.BytesIO(self.path(blob).read_bytes()[start:stop])

    def digests(self):
        return iter(path.name for path in self.folder.iterdir())
