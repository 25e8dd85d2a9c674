"""Jobs in real processes that succeed, fail, die, hang, grow, or are not wanted any more."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest

from service.errors import DatabaseDamagedError, DiskFullError, HoldLostError, NotReadyError
from service.jobs.job import Claim, JobState, Summary
from tests.service.engines.workplace import Workplace
from tests.service.storage.blobs.rot import flip
from tests.waiting import until

MIB = 1 << 20


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    """An engine of two workers that most tests share, as jobs in a server do."""
    with Workplace(tmp_path_factory.mktemp("shared"), job_memory=256 * MIB).open() as place:
        yield place


def pids(note):
    return [int(line) for line in note.read_text().split()] if note.exists() else []


def is_alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().split()[2] != "Z"
    except OSError:
        return False


def killed(pid):
    """Whether it was there to be killed: a process that has done its share ends by itself."""
    try:
        os.kill(pid, signal.SIGKILL)
    except ProcessLookupError:
        return False
    return True


def test_a_job_is_done_and_its_files_are_kept(shared):
    job = shared.end_of(shared.submit(text="hello"))
    assert job.state is JobState.SUCCEEDED
    assert (job.attempt, job.summary.recall, job.failure) == (1, 0.5, None)
    # By relative name; what is no plain file is not.
    assert shared.results(job.id) == {
        "lod0.obj": b"hello",
        "pictures/one.png": b"picture of hello",
    }
    types = {one.name: one.media_type for one in shared.jobs.files(job.id)}
    assert types["lod0.obj"] == "model/obj"
    until(lambda: job.id in [one.id for one in shared.ended])
    until(lambda: list((shared.folder / "scratch").iterdir()) == [])
    assert shared.board.latest(job.id) is None


def test_a_process_yields_and_keeps_to_itself(shared):
    job = shared.end_of(shared.submit("report_surroundings"))
    threads, nice, core, deaf, own_scratch, mode = eval(shared.results(job.id)["facts.json"])
    assert int(threads) == len(os.sched_getaffinity(0))  # the only job has all of them
    assert nice >= 5
    assert (core, deaf, own_scratch, mode) == ((0, 0), True, True, "0o600")


def test_a_reason_is_passed_on_and_costs_no_process(shared, tmp_path):
    note = tmp_path / "note"
    ids = [shared.submit("fail", note=str(note)) for _ in range(6)]
    jobs = [shared.end_of(one) for one in ids]
    assert {(job.failure.kind, job.failure.detail, job.attempt) for job in jobs} == {
        ("unreadable-mesh", "it is a cat", 1)
    }
    assert len(set(pids(note))) <= 2


def test_a_fault_of_the_program_is_told_without_its_words(shared):
    job = shared.end_of(shared.submit("fault"))
    assert (job.state, job.failure.kind, job.attempt) == (JobState.FAILED, "internal-error", 1)
    assert "ZeroDivisionError" in job.failure.detail
    assert "log alone" not in job.failure.detail


@pytest.mark.parametrize(
    ("deed", "how"), [("die", "signal 11 (SIGSEGV)"), ("exit_quietly", "exit status 7")]
)
def test_poison_fails_after_its_attempts_and_hurts_no_other(shared, deed, how):
    poison = shared.submit(deed)
    others = [shared.submit(text=str(number)) for number in range(4)]
    assert {shared.end_of(one).attempt for one in others} == {1}
    job = shared.end_of(poison)
    assert (job.state, job.failure.kind, job.attempt) == (JobState.FAILED, "process-died", 3)
    assert how in job.failure.detail
    assert shared.engine.problem is None


def test_a_killed_process_costs_one_attempt(shared, tmp_path):
    note = tmp_path / "note"
    id_ = shared.submit("wait", note=str(note))
    first = until(lambda: pids(note))[0]
    os.kill(first, signal.SIGKILL)
    until(lambda: len(pids(note)) == 2)
    assert shared.job(id_).attempt == 2
    assert shared.job(id_).state is JobState.RUNNING
    shared.jobs.cancel(None, id_)
    shared.engine.wake()
    assert shared.end_of(id_).state is JobState.CANCELLED


@pytest.mark.parametrize(("deed", "patience"), [("wait", 60.0), ("hang", 0.1)])
def test_cancel_ends_a_job_that_listens_and_one_that_does_not(
    shared, tmp_path, monkeypatch, deed, patience
):
    monkeypatch.setattr("service.engines.attempt._PATIENCE", patience)
    note = tmp_path / "note"
    id_ = shared.submit(deed, note=str(note))
    until(lambda: pids(note))
    shared.jobs.cancel(None, id_)
    shared.engine.wake()
    job = shared.end_of(id_)
    assert (job.state, job.failure) == (JobState.CANCELLED, None)
    # A process that answers is kept, one that does not is ended.
    assert is_alive(pids(note)[0]) == (deed == "wait")
    until(lambda: id_ in [one.id for one in shared.ended])


def test_memory_is_limited(shared):
    job = shared.end_of(shared.submit("allocate", bytes=300 * MIB))
    assert (job.state, job.failure.kind, job.attempt) == (JobState.FAILED, "out-of-memory", 1)
    assert "256 MiB" in job.failure.detail


def test_memory_of_children_counts_and_they_end_as_well(shared, tmp_path):
    note = tmp_path / "note"
    job = shared.end_of(shared.submit("allocate_in_children", note=str(note)))
    assert (job.state, job.failure.kind, job.attempt) == (JobState.FAILED, "out-of-memory", 1)
    assert len(pids(note)) == 2
    until(lambda: not any(map(is_alive, pids(note))))


def test_memory_within_the_limit_is_there(shared):
    assert shared.end_of(shared.submit("allocate", bytes=200 * MIB)).state is JobState.SUCCEEDED


def test_workers_are_counted(tmp_path):
    note = tmp_path / "note"
    place = Workplace(tmp_path / "place")
    with place.open():
        assert place.engine.busy == 0
        until(lambda: place.engine.live == 2)
        id_ = place.submit("wait", note=str(note))
        until(lambda: pids(note))
        assert (place.engine.live, place.engine.busy) == (2, 1)
        os.kill(pids(note)[0], signal.SIGSTOP)
        until(lambda: place.engine.live == 1)  # it is there, and does nothing
        os.kill(pids(note)[0], signal.SIGKILL)
        until(lambda: place.engine.live == 2)
        place.jobs.cancel(None, id_)
        place.engine.wake()
        place.end_of(id_)
        until(lambda: place.engine.busy == 0)
    assert place.engine.live == 0


def test_progress_is_told_while_a_job_runs(shared):
    id_ = shared.submit("wait")
    progress = until(lambda: shared.board.latest(id_))
    assert (progress.stage, progress.fraction) == ("voxelize", 0.5)
    shared.jobs.cancel(None, id_)
    shared.engine.wake()
    shared.end_of(id_)
    until(lambda: shared.board.latest(id_) is None)


@pytest.mark.parametrize("count", [80, pytest.param(200, marks=pytest.mark.slow)])
def test_many_jobs_end_exactly_once_whoever_is_killed(tmp_path, count):
    note = tmp_path / "note"
    place = Workplace(tmp_path / "place", attempts=3, jobs_per_process=40)
    with place.open():
        ids = [
            place.submit(text=str(number), note=str(note), attempts=20) for number in range(count)
        ]
        for goal in range(20, count, 30):
            until(lambda goal=goal: len(pids(note)) > goal)
            until(lambda: killed(pids(note)[-1]))
        jobs = [place.end_of(one, 60.0) for one in ids]
    assert {job.state for job in jobs} == {JobState.SUCCEEDED}
    assert sorted(place.jobs.endings) == sorted(ids)
    assert sorted(job.id for job in place.ended) == sorted(ids)
    assert [place.results(one)["lod0.obj"] for one in ids] == [b"%d" % i for i in range(count)]
    assert not any(map(is_alive, pids(note)))
    assert len(set(pids(note))) >= count // 40


def test_a_grown_process_is_replaced(tmp_path):
    place = Workplace(tmp_path / "place", workers=1, job_memory=256 * MIB)
    note = tmp_path / "note"
    with place.open():
        for size in (1, 140 * MIB, 1):
            place.end_of(place.submit("keep", bytes=size, note=str(note)))
    first, second, third = pids(note)
    assert first == second != third


def test_time_is_limited(tmp_path):
    place = Workplace(tmp_path / "place", workers=1, job_seconds=0.3)
    with place.open():
        job = place.end_of(place.submit("hang"))
    assert (job.state, job.failure.kind, job.attempt) == (JobState.FAILED, "out-of-time", 1)
    assert "0.3 seconds" in job.failure.detail


@pytest.mark.parametrize(
    ("deed", "kept"),
    [("read_for_ever", True), ("read_in_one_call", False), ("read_by_threads", False)],
)
def test_reading_has_a_limit_of_its_own_and_the_worker_is_free_at_once(tmp_path, deed, kept):
    """``kept``: the process goes on where its reading could be ended, else another takes over."""
    place = Workplace(tmp_path / "place", workers=1, read_seconds=0.3)
    note = tmp_path / "note"
    with place.open():
        place.end_of(place.submit(note=str(note)))  # warm
        begin = time.monotonic()
        job = place.end_of(place.submit(deed, note=str(note)))
        taken = time.monotonic() - begin
        after = place.end_of(place.submit(note=str(note)))
    assert (job.state, job.attempt) == (JobState.FAILED, 1)
    assert job.failure.kind == "out-of-time"
    assert "reading takes longer than the 0.3 seconds" in job.failure.detail
    assert "OCCLUDER_READ_SECONDS" in job.failure.remedy
    assert taken < 5.0
    assert after.state is JobState.SUCCEEDED
    first, second, third = pids(note)
    assert (first == second, second == third) == (True, kept)


def test_work_after_reading_may_take_longer_than_reading(tmp_path):
    place = Workplace(tmp_path / "place", workers=1, read_seconds=0.2)
    with place.open():
        job = place.end_of(place.submit("read_then_work", seconds=1.6))
    assert job.state is JobState.SUCCEEDED


def test_a_stopped_process_is_lost_within_a_lease_and_its_job_begun_again(tmp_path):
    note = tmp_path / "note"
    place = Workplace(tmp_path / "place", workers=1, lease_seconds=1.0)
    with place.open():
        job = place.end_of(place.submit("stop_once", note=str(note)))
    assert (job.state, job.attempt, job.attempts) == (JobState.SUCCEEDED, 2, 3)
    assert len(set(pids(note))) == 2


def test_a_process_that_is_stopped_while_idle_is_replaced_and_costs_no_attempt(tmp_path):
    note = tmp_path / "note"
    place = Workplace(tmp_path / "place", workers=1)
    with place.open():
        place.end_of(place.submit(note=str(note)))
        os.kill(pids(note)[0], signal.SIGSTOP)
        until(lambda: not is_alive(pids(note)[0]))
        assert place.end_of(place.submit(text="next", note=str(note))).attempt == 1


def test_a_deadlock_costs_attempts_and_is_told(tmp_path):
    place = Workplace(tmp_path / "place", workers=1, lease_seconds=1.0)
    with place.open():
        job = place.end_of(place.submit("lock_up", attempts=2))
    assert (job.state, job.failure.kind, job.attempt) == (JobState.FAILED, "process-died", 2)
    assert job.failure.detail == "its process gave no sign of life for 1 seconds"


def test_a_long_silent_computation_is_no_hanging(tmp_path):
    place = Workplace(tmp_path / "place", workers=1, lease_seconds=1.0)
    with place.open():
        job = place.end_of(place.submit("compute", steps=120_000_000))
    assert (job.state, job.attempt) == (JobState.SUCCEEDED, 1)
    assert job.ended - job.started > 1.0


def test_a_disk_that_fills_up_costs_the_job_no_attempt(tmp_path):
    place = Workplace(tmp_path / "place", workers=1)
    with place.open():
        job = place.end_of(place.submit("fill_once", note=str(tmp_path / "note"), attempts=1))
    assert (job.state, job.attempt, job.attempts) == (JobState.SUCCEEDED, 2, 2)


def test_processes_that_die_at_birth_are_told_and_started_again(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    place = Workplace(
        tmp_path / "place", "tests.service.engines.works:start_at_the_fourth_try", workers=1
    )
    with place.open():
        id_ = place.submit()
        until(lambda: place.engine.problem)
        assert place.end_of(id_).attempt == 1
        assert place.engine.problem is None


def test_an_engine_without_a_process_leaves_jobs_alone_and_stops(tmp_path, caplog):
    place = Workplace(tmp_path / "place", "tests.service.engines.works:start_never", workers=1)
    with place.open():
        id_ = place.submit()
        until(lambda: "exit status 3" in caplog.text)
    assert place.job(id_).state is JobState.QUEUED


def test_stopping_ends_processes_and_costs_no_attempt(tmp_path):
    place = Workplace(tmp_path / "place", workers=2)
    note = tmp_path / "note"
    with place.open():
        ids = [place.submit("hang", note=str(note)) for _ in range(3)]
        until(lambda: len(pids(note)) == 2)
    jobs = [place.job(one) for one in ids]
    assert [job.state for job in jobs] == [JobState.QUEUED] * 3
    assert {job.attempts - job.attempt for job in jobs} == {3}
    assert not any(map(is_alive, pids(note)))


def test_what_a_killed_server_left_is_taken_back_first(tmp_path):
    place = Workplace(tmp_path / "place", workers=1)
    place.engine = place
    place.wake = lambda: None
    once, spent = place.submit(), place.submit(attempts=1)
    assert place.jobs.claim("a dead server", 3600.0).job.id == once
    assert place.jobs.claim("a dead server", 3600.0).job.id == spent
    with place.open():
        assert place.end_of(once).attempt == 2
        job = place.end_of(spent)
    assert (job.state, job.failure.kind) == (JobState.FAILED, "process-died")
    assert sorted(one.id for one in place.ended) == sorted([once, spent])


def test_a_lost_lease_ends_the_work_and_its_result_is_dropped(tmp_path):
    place = Workplace(tmp_path / "place", workers=1, lease_seconds=1.0)
    note = tmp_path / "note"
    with place.open():
        id_ = place.submit("hang", note=str(note))
        pid = until(lambda: pids(note))[0]
        with place.jobs.lock:  # as if another server had taken it over and done it
            row = place.jobs.rows[id_]
            row.owner = "another"
            other = Claim(row.job, "another", ())
            assert place.jobs.succeed(other, [], Summary(9, 9, 9, 9.0))
        until(lambda: not is_alive(pid))
        place.end_of(place.submit())
    assert place.job(id_).summary.triangles == 9
    assert id_ not in [job.id for job in place.ended]


def test_leases_are_renewed_while_a_job_runs(tmp_path):
    place = Workplace(tmp_path / "place", workers=1, lease_seconds=1.0)
    with place.open():
        id_ = place.submit("wait")
        until(lambda: place.jobs.rows[id_].lease)
        first = place.jobs.rows[id_].lease
        until(lambda: place.jobs.rows[id_].lease > first + 0.5)
        assert place.job(id_).attempt == 1


@pytest.mark.parametrize(
    ("method", "error"),
    [("claim", DiskFullError), ("succeed", DiskFullError), ("succeed", DatabaseDamagedError),
     ("renew", DatabaseDamagedError), ("succeed", NotReadyError)],
)  # fmt: skip
def test_work_waits_while_the_stores_cannot_be_written(tmp_path, monkeypatch, method, error):
    place = Workplace(tmp_path / "place", workers=1, lease_seconds=1.0)
    well = getattr(place.jobs, method)
    failures = 2

    def ill(*arguments):
        nonlocal failures
        if failures:
            failures -= 1
            raise error("no room")
        return well(*arguments)

    monkeypatch.setattr(place.jobs, method, ill)
    with place.open():
        id_ = place.submit("wait" if method == "renew" else "copy")
        if method == "renew":
            until(lambda: place.board.latest(id_))
            place.jobs.cancel(None, id_)  # heard of at the next renewal
        assert "no room" in until(lambda: place.engine.problem)
        assert place.end_of(id_).attempt == 1
        until(lambda: place.engine.problem is None)
    assert place.jobs.endings == [id_]


def test_a_result_waits_for_room_and_a_lost_upload_is_told(tmp_path, monkeypatch):
    place = Workplace(tmp_path / "place", workers=1)
    well, failures = place.blobs.put_file, [DiskFullError("no room")]

    def ill(path):
        if failures:
            raise failures.pop()
        return well(path)

    monkeypatch.setattr(place.blobs, "put_file", ill)
    waiting = place.submit(wake=False)
    id_ = place.submit(text="lost", wake=False)
    place.blobs.path(place.jobs.files(id_)[0].blob).unlink()  # before an engine could take the job
    with place.open():
        assert place.end_of(waiting).state is JobState.SUCCEEDED
        job = place.end_of(id_)
        assert (job.failure.kind, job.failure.remedy) == ("upload-lost", "upload it again")


@pytest.mark.parametrize("method", ["lay_out", "put_file"])
def test_work_waits_while_files_cannot_be_read_or_stored(tmp_path, monkeypatch, method):
    """The server that has them is away for a while."""
    place = Workplace(tmp_path / "place", workers=1)
    well, failures = getattr(place.blobs, method), [NotReadyError("away")] * 2

    def ill(*arguments):
        if failures:
            raise failures.pop()
        return well(*arguments)

    monkeypatch.setattr(place.blobs, method, ill)
    with place.open():
        id_ = place.submit()
        assert "away" in until(lambda: place.engine.problem)
        job = place.end_of(id_)
        assert (job.state, job.attempt) == (JobState.SUCCEEDED, 1)
        until(lambda: place.engine.problem is None)


@pytest.mark.parametrize("when", ["put_file", "succeed"])
def test_a_result_that_was_given_up_is_made_again_at_no_cost(tmp_path, monkeypatch, when):
    """Its process was held up for so long that others removed what no job named yet."""
    place = Workplace(tmp_path / "place", workers=1)
    store = place.blobs if when == "put_file" else place.jobs
    well, failures = getattr(store, when), [HoldLostError("given up")]

    def ill(*arguments):
        if failures:
            raise failures.pop()
        return well(*arguments)

    monkeypatch.setattr(store, when, ill)
    with place.open():
        job = place.end_of(place.submit())
        assert job.state is JobState.SUCCEEDED
        assert job.attempts - job.attempt == 2  # as many are left as before


@pytest.mark.parametrize("way", ["rot", "unreadable"])
def test_a_damaged_upload_is_not_worked_at_and_the_process_goes_on(tmp_path, way):
    place = Workplace(tmp_path / "place", workers=1)
    note = tmp_path / "note"
    id_ = place.submit(text="rotten", note=str(note), wake=False)
    blob = place.jobs.files(id_)[0].blob
    if way == "rot":
        flip(place.blobs.path(blob))
    else:  # what the system says of it is no more than that it cannot be read
        place.blobs.path(blob).unlink()
        place.blobs.path(blob, must_exist=False).mkdir()
    with place.open():
        job = place.end_of(id_)
        assert (job.state, job.attempt) == (JobState.FAILED, 1)
        assert (job.failure.kind, job.failure.remedy) == ("upload-lost", "upload it again")
        assert not place.blobs.has(blob)
        assert pids(note) == []  # the work never began
        for number in range(2):
            place.end_of(place.submit(text=str(number), note=str(note)))
        assert len(set(pids(note))) == 1
        again = place.end_of(place.submit(text="rotten"))
    assert again.state is JobState.SUCCEEDED


def test_a_process_that_misreads_is_not_believed(tmp_path, monkeypatch):
    """The blob is right by then: the attempt counts, and the upload stays."""
    place = Workplace(tmp_path / "place", workers=1)
    id_ = place.submit(text="right", wake=False)
    blob = place.jobs.files(id_)[0].blob
    flip(place.blobs.path(blob))
    well = place.blobs.check

    def heal(found):
        flip(place.blobs.path(found))
        return well(found)

    monkeypatch.setattr(place.blobs, "check", heal)
    with place.open():
        job = place.end_of(id_)
    assert (job.state, job.attempt) == (JobState.SUCCEEDED, 2)


def test_nothing_that_a_listener_or_store_raises_ends_the_engine(tmp_path, monkeypatch, caplog):
    place = Workplace(tmp_path / "place", workers=1)
    place.ended = type("Deaf", (), {"append": lambda self, job: 1 / 0})()
    well, failures = place.jobs.claim, [RuntimeError("a fault")]

    def ill(*arguments):
        if failures:
            raise failures.pop()
        return well(*arguments)

    monkeypatch.setattr(place.jobs, "claim", ill)
    with place.open():
        for _ in range(2):
            assert place.end_of(place.submit()).state is JobState.SUCCEEDED
    assert "a fault" in caplog.text
    assert "ZeroDivisionError" in caplog.text
