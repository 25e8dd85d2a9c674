"""What a job goes through, one step at a time."""

from __future__ import annotations

import pytest

from service.errors import ConflictError, NotFoundError, QueueFullError
from service.jobs.job import Blob, Claim, Failure, Job, JobKind, JobState
from service.jobs.stores import JobFilter
from service.storage.database import Database
from service.storage.job_store import SqlJobStore
from tests.service.storage.samples import DIED, Clock, blob, mesh, results, submission, summary


def submit(jobs: SqlJobStore, text: str = "a cube", **changes: object) -> Job:
    return jobs.submit(submission(text, **changes), queue_limit=1000)[0]


def claim(jobs: SqlJobStore, owner: str = "one") -> Claim:
    found = jobs.claim(owner, 30.0)
    assert found is not None
    return found


def finish(jobs: SqlJobStore, text: str = "a cube", **changes: object) -> Job:
    """A job that was done."""
    job = submit(jobs, text, **changes)
    assert jobs.succeed(claim(jobs), results(), summary())
    return jobs.job(None, job.id)


def test_a_job_is_stored_as_it_was_asked_for(jobs: SqlJobStore, clock: Clock) -> None:
    asked = submission(options={"budget": 32, "viewers": None}, webhook="https://a.b", attempts=2)
    job, to_do = jobs.submit(asked, queue_limit=1)
    assert to_do
    assert job == jobs.job("studio", job.id)
    assert job.state is JobState.QUEUED
    assert (job.kind, job.name, job.version) == (JobKind.OCCLUDER, "cube.obj", "1.0")
    assert job.options == {"budget": 32, "viewers": None}
    assert (job.attempt, job.attempts, job.webhook) == (0, 2, "https://a.b")
    assert job.created == clock.now
    assert jobs.files(job.id) == (mesh(),)


def test_jobs_are_claimed_in_the_order_they_came(jobs: SqlJobStore) -> None:
    ids = [submit(jobs, text).id for text in "abc"]
    assert [claim(jobs).job.id for _ in ids] == ids
    assert jobs.claim("one", 30.0) is None


def test_a_claim_has_the_inputs_and_counts_the_attempt(jobs: SqlJobStore) -> None:
    submit(jobs)
    held = claim(jobs)
    assert held.inputs == (mesh(),)
    assert (held.job.state, held.job.attempt) == (JobState.RUNNING, 1)


def test_a_result_is_kept_with_the_job(jobs: SqlJobStore, clock: Clock) -> None:
    submit(jobs)
    held = claim(jobs)
    clock.now += 5.0
    assert jobs.succeed(held, results(), summary())
    job = jobs.job("studio", held.job.id)
    assert (job.state, job.summary) == (JobState.SUCCEEDED, summary())
    assert (job.started, job.ended) == (clock.now - 5.0, clock.now)
    assert [file.name for file in jobs.files(job.id)] == [
        "input/mesh.obj", "lod0.glb", "report.json",
    ]  # fmt: skip


def test_a_job_is_tried_again_before_others_until_no_attempt_is_left(
    jobs: SqlJobStore, monotonic: Clock
) -> None:
    poisonous = submit(jobs, "poison", attempts=2)
    submit(jobs, "sound")
    assert jobs.fail(claim(jobs), DIED, final=False) is JobState.QUEUED
    monotonic.now += 1.0
    again = claim(jobs)
    assert (again.job.id, again.job.attempt) == (poisonous.id, 2)
    assert jobs.fail(again, DIED, final=False) is JobState.FAILED
    assert jobs.job(None, poisonous.id).failure == DIED
    assert claim(jobs).job.id != poisonous.id


def test_an_attempt_that_was_released_does_not_count(jobs: SqlJobStore) -> None:
    job = submit(jobs, attempts=1)
    held = claim(jobs)
    assert jobs.release(held)
    assert not jobs.succeed(held, results(), summary())
    again = claim(jobs, "another")
    assert again.job.id == job.id
    assert again.job.attempt > held.job.attempt  # the fence
    assert jobs.fail(again, DIED, final=False) is JobState.FAILED


def test_a_job_that_was_to_be_cancelled_ends_when_it_is_released(jobs: SqlJobStore) -> None:
    job = submit(jobs)
    held = claim(jobs)
    jobs.cancel(None, job.id)
    assert jobs.release(held)
    assert jobs.job(None, job.id).state is JobState.CANCELLED


def test_a_final_failure_leaves_no_further_attempt(jobs: SqlJobStore) -> None:
    submit(jobs)
    unreadable = Failure("unreadable-mesh", "no triangle in it", "export it again")
    assert jobs.fail(claim(jobs), unreadable, final=True) is JobState.FAILED
    assert jobs.claim("one", 30.0) is None


@pytest.mark.parametrize("successor", ["one", "two"])
def test_who_lost_the_claim_is_not_heard(jobs: SqlJobStore, successor: str) -> None:
    submit(jobs)
    old = claim(jobs, "one")
    jobs.recover(DIED, all_leases=True)
    new = claim(jobs, successor)
    assert not jobs.succeed(old, results("stale"), summary())
    assert jobs.fail(old, DIED, final=True) is None
    assert not jobs.end_cancelled(old)
    assert jobs.renew([old, new], 30.0) == {new.job.id: False}
    assert jobs.succeed(new, results("fresh"), summary())
    assert jobs.unnamed([blob("stale").digest, blob("fresh").digest]) == {blob("stale").digest}


def test_nothing_is_heard_after_the_end(jobs: SqlJobStore) -> None:
    submit(jobs)
    held = claim(jobs)
    assert jobs.succeed(held, results(), summary())
    assert not jobs.succeed(held, results(), summary())
    assert jobs.fail(held, DIED, final=True) is None
    assert jobs.recover(DIED, all_leases=True) == []


def test_a_queued_job_is_cancelled_at_once(jobs: SqlJobStore) -> None:
    job = submit(jobs)
    assert jobs.cancel("studio", job.id).state is JobState.CANCELLED
    assert jobs.claim("one", 30.0) is None


def test_a_running_job_is_asked_to_end(jobs: SqlJobStore) -> None:
    submit(jobs)
    held = claim(jobs)
    assert jobs.renew([held], 30.0) == {held.job.id: False}
    asked = jobs.cancel("studio", held.job.id)
    assert (asked.state, asked.cancel_asked) == (JobState.RUNNING, True)
    assert jobs.renew([held], 30.0) == {held.job.id: True}
    assert jobs.end_cancelled(held)
    assert jobs.job(None, held.job.id).state is JobState.CANCELLED


def test_a_job_that_was_to_be_cancelled_is_not_tried_again(jobs: SqlJobStore) -> None:
    first, second = submit(jobs, "a"), submit(jobs, "b")
    held = claim(jobs)
    claim(jobs)
    jobs.cancel(None, first.id)
    jobs.cancel(None, second.id)
    assert jobs.fail(held, DIED, final=False) is JobState.CANCELLED
    taken_back = jobs.recover(DIED, all_leases=True)
    assert [(job.id, job.state) for job in taken_back] == [(second.id, JobState.CANCELLED)]


def test_what_has_ended_cannot_be_cancelled(jobs: SqlJobStore) -> None:
    job = finish(jobs)
    with pytest.raises(ConflictError, match="has succeeded already"):
        jobs.cancel("studio", job.id)


def test_another_tenant_sees_nothing(jobs: SqlJobStore) -> None:
    job = submit(jobs)
    for call in (jobs.job, jobs.cancel):
        with pytest.raises(NotFoundError, match=job.id):
            call("rival", job.id)
    assert jobs.jobs("rival", JobFilter(), before=None, limit=10).jobs == ()
    assert jobs.job(None, job.id) == job


def test_a_full_queue_takes_no_job_but_gives_stored_results(jobs: SqlJobStore) -> None:
    finish(jobs, "done before")
    submit(jobs, "waiting")
    with pytest.raises(QueueFullError) as refused:
        jobs.submit(submission("too many"), queue_limit=1)
    assert refused.value.headers["Retry-After"] == "1"  # as the last one took no time
    again, to_do = jobs.submit(submission("done before"), queue_limit=1)
    assert (again.state, to_do) == (JobState.SUCCEEDED, False)
    assert sum(jobs.counts().values()) == 3


def test_the_same_work_is_not_done_twice(jobs: SqlJobStore) -> None:
    done = finish(jobs)
    job = submit(jobs, name="again.obj")
    assert (job.state, job.reused, job.name) == (JobState.SUCCEEDED, done.id, "again.obj")
    assert job.summary == done.summary
    assert jobs.files(job.id) == jobs.files(done.id)
    assert jobs.claim("one", 30.0) is None


def test_a_result_that_has_lost_a_file_is_made_again(database: Database) -> None:
    lost: set[Blob] = set()
    jobs = SqlJobStore(database, is_stored=lambda blob: blob not in lost)
    first = finish(jobs)
    copies = [submit(jobs) for _ in range(3)]
    assert {copy.reused for copy in copies} == {first.id}

    report = results()[1].blob
    lost.add(report)
    again = submit(jobs)
    assert (again.state, again.reused) == (JobState.QUEUED, None)
    jobs.succeed(claim(jobs), results("made again"), summary())
    later = submit(jobs)
    assert (later.state, later.reused) == (JobState.SUCCEEDED, again.id)
    assert [one.blob for one in jobs.files(later.id) if not one.is_input] == [
        one.blob for one in results("made again")
    ]

    lost.clear()  # as where a backup was put back
    assert submit(jobs).reused == first.id


def test_a_lost_result_is_looked_at_once_however_often_it_was_given(database: Database) -> None:
    asked: list[Blob] = []

    def is_stored(blob: Blob) -> bool:
        asked.append(blob)
        return len(asked) <= 40

    jobs = SqlJobStore(database, is_stored=is_stored)
    finish(jobs)
    for _ in range(20):
        submit(jobs)
    assert len(asked) == 40
    assert submit(jobs).state is JobState.QUEUED
    assert len(asked) == 41


def test_an_input_that_is_lost_does_not_spoil_a_result(database: Database) -> None:
    """It has just been sent again."""
    jobs = SqlJobStore(database, is_stored=lambda blob: blob != mesh().blob)
    done = finish(jobs)
    assert submit(jobs).reused == done.id


@pytest.mark.parametrize(
    "changes",
    [
        {"options": {"budget": 65}},
        {"version": "1.1"},
        {"kind": JobKind.SCENE},
        {"tenant": "rival"},
        {"may_reuse": False},
        {"inputs": (mesh("another"),)},
    ],
)
def test_other_work_is_done(jobs: SqlJobStore, changes: dict[str, object]) -> None:
    finish(jobs)
    assert submit(jobs, **changes).state is JobState.QUEUED


def test_the_list_has_each_job_once_over_its_pages(jobs: SqlJobStore) -> None:
    ids = [submit(jobs, str(number)).id for number in range(7)]
    seen: list[str] = []
    cursor: int | None = None
    while True:
        page = jobs.jobs("studio", JobFilter(), before=cursor, limit=3)
        seen += [job.id for job in page.jobs]
        submit(jobs, f"meanwhile {len(seen)}")  # newer ones do not shift the pages
        cursor = page.cursor
        if cursor is None:
            break
    assert seen == ids[::-1]


def test_a_list_shows_what_is_asked_for(jobs: SqlJobStore, clock: Clock) -> None:
    scene = finish(jobs, "1", kind=JobKind.SCENE, asset="castle")
    clock.now += 10.0
    failed = submit(jobs, "2", asset="castle")
    jobs.fail(claim(jobs), DIED, final=True)
    clock.now += 10.0
    rivals = submit(jobs, "3", tenant="rival")
    queued = submit(jobs, "4")

    def found(tenant: str | None = "studio", **wanted: object) -> list[str]:
        page = jobs.jobs(tenant, JobFilter(**wanted), before=None, limit=10)  # type: ignore[arg-type]
        return [job.id for job in page.jobs]

    assert found() == [queued.id, failed.id, scene.id]
    assert found(None) == [queued.id, rivals.id, failed.id, scene.id]
    assert found(states=frozenset([JobState.FAILED])) == [failed.id]
    both = frozenset([JobState.FAILED, JobState.QUEUED])
    assert found(states=both) == [queued.id, failed.id]
    assert found(None, states=both) == [queued.id, rivals.id, failed.id]
    assert found(states=frozenset(JobState)) == [queued.id, failed.id, scene.id]
    assert found(kinds=frozenset([JobKind.SCENE])) == [scene.id]
    assert found(asset_id=scene.asset_id) == [failed.id, scene.id]
    assert found("rival", asset_id=scene.asset_id) == []
    assert found(created_from=clock.now - 10.0, created_before=clock.now) == [failed.id]


def test_expired_jobs_are_forgotten_with_all_they_name(jobs: SqlJobStore, clock: Clock) -> None:
    old = finish(jobs, "old", webhook="https://a.b")
    waiting = submit(jobs, "waits for long")
    clock.now += 100.0
    fresh = submit(jobs, "fresh")
    jobs.cancel(None, fresh.id)
    assert jobs.expire(ended_before=clock.now) == 1
    with pytest.raises(NotFoundError):
        jobs.job(None, old.id)
    assert jobs.files(old.id) == ()
    names = {blob(name).digest: name for name in ("old", "waits for long", "fresh")}
    assert {names[one] for one in jobs.unnamed(names)} == {"old"}
    assert jobs.job(None, waiting.id).state is JobState.QUEUED


def test_the_latest_run_of_an_asset_never_expires(jobs: SqlJobStore, clock: Clock) -> None:
    finish(jobs, "first", asset="castle")
    latest = finish(jobs, "second", asset="castle")
    submit(jobs, "third", asset="castle")
    jobs.fail(claim(jobs), DIED, final=True)
    assert jobs.expire(ended_before=clock.now + 1.0) == 2
    assert [job.id for job in jobs.jobs(None, JobFilter(), before=None, limit=9).jobs] == [
        latest.id
    ]


def test_more_jobs_expire_than_one_transaction_takes(
    jobs: SqlJobStore, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("service.storage.job_store._EXPIRED_AT_ONCE", 10)
    finish(jobs)
    for _ in range(25):
        submit(jobs)
    assert jobs.expire(ended_before=clock.now + 1.0) == 26
    assert sum(jobs.counts().values()) == 0


def test_counts_name_every_state(jobs: SqlJobStore) -> None:
    assert jobs.counts() == dict.fromkeys(JobState, 0)
    finish(jobs, "a")
    submit(jobs, "b")
    assert jobs.counts() == dict.fromkeys(JobState, 0) | {
        JobState.QUEUED: 1,
        JobState.SUCCEEDED: 1,
    }


def test_numbers_are_not_given_again(jobs: SqlJobStore, clock: Clock) -> None:
    last = finish(jobs)
    jobs.expire(ended_before=clock.now + 1.0)
    assert submit(jobs).number > last.number


def test_the_queue_tells_places_among_all_tenants(jobs: SqlJobStore) -> None:
    submit(jobs, "begun")
    claim(jobs)
    mine = [submit(jobs, text) for text in "ab"]
    theirs = submit(jobs, "c", tenant="rival")  # who had no turn yet
    mine.append(submit(jobs, "d"))
    assert jobs.queue("studio", 10) == ((2, mine[0]), (3, mine[1]), (4, mine[2]))
    assert jobs.queue("studio", 2) == ((2, mine[0]), (3, mine[1]))
    assert jobs.queue("rival", 10) == ((1, theirs),)
    assert [place for place, _ in jobs.queue(None, 2)] == [1, 2]
    assert [jobs.place(job.number) for job in (*mine, theirs)] == [2, 3, 4, 1]
    assert jobs.place(mine[0].number - 1) is None  # it runs
