"""Any order of calls: the store does as a plain model of it in memory."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, field
from pathlib import Path

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    Bundle,
    RuleBasedStateMachine,
    consumes,
    initialize,
    invariant,
    multiple,
    precondition,
    rule,
)

from service.errors import ConflictError, NotFoundError, QueueFullError
from service.jobs.job import Claim, JobState, Submission
from service.jobs.stores import JobFilter
from service.storage.job_store import SqlJobStore
from tests.service.storage.fresh import fresh_database
from tests.service.storage.samples import DIED, FULL, Clock, results, submission, summary

LEASE = 30.0
QUEUE_LIMIT = 4

meshes = st.sampled_from(["cube", "sphere"])
assets = st.sampled_from([None, "castle"])
keys = st.sampled_from([None, None, "k1", "k2"])


@dataclass
class Modelled:
    """What the store should say of a job."""

    asked: Submission
    state: JobState = JobState.QUEUED
    attempt: int = 0
    cancel_asked: bool = False
    spared: int = 0
    """Attempts that have cost none."""
    ended: float | None = None
    due: float = 0.0
    """When it may be claimed, by the monotonic clock."""
    seen: float = 0.0
    """When its holder last gave a sign of life, by the monotonic clock."""
    digests: set[str] = field(default_factory=set)

    def end_attempt(self, now: float, *, final: bool = False) -> None:
        if self.cancel_asked and not final:
            self.end(JobState.CANCELLED, now)
        elif self.attempt < self.asked.attempts + self.spared and not final:
            self.state = JobState.QUEUED
        else:
            self.end(JobState.FAILED, now)

    def end(self, state: JobState, now: float) -> None:
        self.state, self.ended = state, now


class JobStoreMachine(RuleBasedStateMachine):
    claims = Bundle("claims")
    jobs = Bundle("jobs")

    @initialize(target=claims)
    def open(self) -> object:
        """Begin where most can happen: with jobs that are worked at."""
        self.folder = tempfile.TemporaryDirectory()
        self.database = fresh_database(Path(self.folder.name) / "occluder.db")
        self.clock, self.monotonic = Clock(), Clock()
        self.store = SqlJobStore(self.database, self.clock, self.monotonic)
        self.ever_named: set[str] = set()
        self.model: dict[str, Modelled] = {}
        """By id, in the order in which jobs were taken in."""
        for mesh in ("cube", "sphere"):
            self.submit(mesh, None, attempts=2)
        return multiple(self.claim("one"), self.claim("one"))

    def teardown(self) -> None:
        self.database.close()
        self.folder.cleanup()

    @rule(target=jobs, mesh=meshes, asset=assets, attempts=st.integers(1, 2))
    def submit(self, mesh: str, asset: str | None, attempts: int) -> object:
        asked = submission(mesh, asset=asset, attempts=attempts)
        done = [
            one
            for one in self.model.values()
            if one.state is JobState.SUCCEEDED and one.asked.work_key == asked.work_key
        ]
        try:
            job, to_do = self.store.submit(asked, QUEUE_LIMIT)
        except QueueFullError:
            assert not done
            assert len(self.those(JobState.QUEUED)) == QUEUE_LIMIT
            return multiple()
        assert to_do == (not done)
        inputs = {file.blob.digest for file in asked.inputs}
        made = self.model[job.id] = Modelled(asked, digests=inputs)
        if done:
            made.end(JobState.SUCCEEDED, self.clock.now)
            made.digests |= done[0].digests
        return job.id

    @precondition(lambda machine: machine.claimable())
    @rule(target=claims, owner=st.sampled_from(["one", "one", "two"]))
    def claim(self, owner: str) -> Claim:
        job_id, job = self.claimable()[0]
        claim = self.store.claim(owner, LEASE)
        assert claim is not None
        assert claim.job.id == job_id
        job.state, job.attempt, job.seen = JobState.RUNNING, job.attempt + 1, self.monotonic.now
        assert claim.job.attempt == job.attempt
        return claim

    @rule(claim=claims)
    def renew(self, claim: Claim) -> None:
        job = self.held(claim)
        expected = {claim.job.id: job.cancel_asked} if job else {}
        assert self.store.renew([claim], LEASE) == expected
        if job:
            job.seen = self.monotonic.now

    @rule(claim=consumes(claims))
    def succeed(self, claim: Claim) -> None:
        job = self.held(claim)
        files = results(f"{claim.job.id} {claim.job.attempt}")
        assert self.store.succeed(claim, files, summary()) == bool(job)
        if job:
            job.end(JobState.SUCCEEDED, self.clock.now)
            job.digests |= {file.blob.digest for file in files}

    @rule(claim=consumes(claims), final=st.booleans())
    def fail(self, claim: Claim, final: bool) -> None:
        job = self.held(claim)
        if job:
            job.end_attempt(self.clock.now, final=final)
            job.due = self.monotonic.now + 0.5 * 2.0 ** (job.attempt - 1)
        assert self.store.fail(claim, DIED, final=final) == (job.state if job else None)

    @precondition(lambda machine: not machine.claimable())
    @rule(owner=st.sampled_from(["one", "two"]))
    def claim_nothing(self, owner: str) -> None:
        assert self.store.claim(owner, LEASE) is None

    @rule(claim=consumes(claims))
    def put_off(self, claim: Claim) -> None:
        job = self.held(claim)
        if job and job.cancel_asked:
            job.end(JobState.CANCELLED, self.clock.now)
        elif job:
            job.state, job.spared = JobState.QUEUED, job.spared + 1
            job.due = self.monotonic.now + 5.0 * 2.0 ** (job.attempt - 1)
        assert self.store.put_off(claim, FULL) == (job.state if job else None)

    @rule(claim=consumes(claims))
    def end_cancelled(self, claim: Claim) -> None:
        job = self.held(claim)
        assert self.store.end_cancelled(claim) == bool(job)
        if job:
            job.end(JobState.CANCELLED, self.clock.now)

    @rule(claim=claims)
    def cancel_what_was_claimed(self, claim: Claim) -> None:
        self.cancel(claim.job.id)

    @rule(job_id=jobs)
    def cancel(self, job_id: str) -> None:
        job = self.model.get(job_id)
        try:
            self.store.cancel("studio", job_id)
        except NotFoundError:
            assert job is None
        except ConflictError:
            assert job is not None
            assert job.state.ended
        else:
            assert job is not None
            if job.state is JobState.QUEUED:
                job.end(JobState.CANCELLED, self.clock.now)
            job.cancel_asked = job.state is JobState.RUNNING

    @rule(all_leases=st.booleans())
    def recover(self, all_leases: bool) -> None:
        lost = [
            job_id
            for job_id, job in self.those(JobState.RUNNING)
            if all_leases or self.monotonic.now - job.seen > LEASE
        ]
        for job_id in lost:
            self.model[job_id].end_attempt(self.clock.now)
            self.model[job_id].due = self.monotonic.now
        if all_leases:  # a server that starts forgets the pauses of the one before
            for _, job in self.those(JobState.QUEUED):
                job.due = self.monotonic.now
        found = self.store.recover(DIED, all_leases=all_leases)
        assert [(job.id, job.state) for job in found] == [
            (job_id, self.model[job_id].state) for job_id in lost
        ]

    @rule(age=st.sampled_from([0.0, 60.0]))
    def expire(self, age: float) -> None:
        before = self.clock.now - age
        latest = {
            job.asked.asset: job_id for job_id, job in self.those(JobState.SUCCEEDED)
        }  # the last of each asset stays
        old = [
            job_id
            for job_id, job in self.model.items()
            if job.ended is not None and job.ended < before
            if job.asked.asset is None or latest.get(job.asked.asset) != job_id
        ]
        assert self.store.expire(before) == len(old)
        for job_id in old:
            del self.model[job_id]

    @rule(
        seconds=st.sampled_from([1.0, LEASE + 1.0]), jump=st.sampled_from([0.0, 3600.0, -86400.0])
    )
    def wait(self, seconds: float, jump: float) -> None:
        self.monotonic.now += seconds
        self.clock.now += seconds + jump

    @invariant()
    def says_what_the_model_says(self) -> None:
        page = self.store.jobs(None, JobFilter(), before=None, limit=1000)
        said = {job.id: (job.state, job.attempt, job.cancel_asked, job.ended) for job in page.jobs}
        assert said == {
            job_id: (job.state, job.attempt, job.cancel_asked, job.ended)
            for job_id, job in self.model.items()
        }
        assert [job.id for job in page.jobs] == list(self.model)[::-1]
        named = set[str]().union(*(job.digests for job in self.model.values()))
        self.ever_named |= named
        assert self.store.unnamed(self.ever_named) == self.ever_named - named

    def those(self, state: JobState) -> list[tuple[str, Modelled]]:
        return [(job_id, job) for job_id, job in self.model.items() if job.state is state]

    def claimable(self) -> list[tuple[str, Modelled]]:
        return [one for one in self.those(JobState.QUEUED) if one[1].due <= self.monotonic.now]

    def held(self, claim: Claim) -> Modelled | None:
        """The job of a claim that still holds.  An attempt begins once, so its number is enough."""
        job = self.model.get(claim.job.id)
        holds = job and job.state is JobState.RUNNING and job.attempt == claim.job.attempt
        return job if holds else None


TestJobStore = JobStoreMachine.TestCase
TestJobStore.settings = settings(max_examples=16, stateful_step_count=40)
