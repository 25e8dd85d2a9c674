"""Jobs in processes that die, fail, hang or are not wanted any more."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from simplifier.errors import BackendUnavailableError
from simplifier.processes import DIED, run_jobs, run_jobs_here
from tests.acceptance.command import environment
from tests.hierarchy.jobs import dying, starter


@pytest.fixture(autouse=True)
def no_process_left():
    """Whatever happens, all processes have ended when the iteration has."""
    yield
    assert multiprocessing.active_children() == []


def answers(jobs, processes=2, folder=""):
    """(result, failure) of each job, in order; none is told twice."""
    outcomes = list(run_jobs(starter, (str(folder),), jobs, processes))
    places = [outcome.job for outcome in outcomes]
    assert sorted(places) == list(range(len(jobs)))
    by_place = {outcome.job: outcome.answer for outcome in outcomes}
    return [(by_place[i].result, by_place[i].failure) for i in range(len(jobs))]


def test_every_job_is_done_once_and_by_all(tmp_path):
    jobs = [("mark", value) for value in range(30)] + [
        ("threads", 0),
        ("sleep", 0.2),
        ("sleep", 0.2),
    ]
    done = answers(jobs, folder=tmp_path)
    assert len(list(tmp_path.iterdir())) == 30
    assert all(failure == "" for _, failure in done)
    assert done[30][0] == 1  # they share the processors


def test_a_worker_that_dies_costs_one_attempt(tmp_path):
    done = answers([("square", 3), ("die once", 0), ("square", 4)], folder=tmp_path)
    assert done == [(9, ""), ("die once", ""), (16, "")]


def test_what_fails_costs_no_other():
    jobs = [("die", 0), ("refuse", 0), ("memory", 0), ("fault", 7), ("unsendable", 0)]
    done = answers(jobs + [("square", value) for value in range(5)])
    assert [failure for _, failure in done[:5]] == [
        DIED,
        "it is no good; make it better",
        "out of memory",
        "IndexError: list index out of range",
        DIED,
    ]
    assert done[5:] == [(value * value, "") for value in range(5)]


def test_the_same_in_this_process():
    jobs = [("square", 3), ("refuse", 0), ("memory", 0), ("fault", 7), ("square", 5)]
    done = [(outcome.job, outcome.answer) for outcome in run_jobs_here(starter(), jobs, 2)]
    assert [place for place, _ in done] == list(range(5))
    assert [(answer.result, answer.failure) for _, answer in done] == answers(jobs)


def test_processes_that_never_begin_are_no_reason_to_try_forever():
    with pytest.raises(BackendUnavailableError, match="__main__"):
        list(run_jobs(dying, (), [("square", 1)] * 100, 2))


def test_processes_multiply_matrices_in_one_thread():
    before = dict(os.environ)
    (outcome,) = run_jobs(starter, (), [("variable", "OPENBLAS_NUM_THREADS")], 1)
    assert outcome.answer.result == "1"
    assert dict(os.environ) == before


def test_what_fine_meshes_need_is_compiled_before_there_are_processes():
    """And nothing is imported for that where nothing is to be done."""
    script = (
        "import sys\n"
        "import simplifier.builds.build\n"
        "from simplifier import processes\n"
        "from simplifier.kernels.compiled.waiting import waiting\n"
        "assert 'numpy' not in sys.modules\n"
        "from simplifier.kernels import front\n"
        "assert 'simplifier.kernels.front_contours' not in sys.modules\n"
        "front.load_imported = lambda: print(*waiting)\n"
        "list(processes.run_jobs(None, (), [], 2))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], env=environment(), capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    assert {"contours", "clusters", "front_contours"} <= set(done.stdout.split())


def test_no_job_needs_no_process():
    assert list(run_jobs(dying, (), [], 2)) == []


def test_cancel_ends_all_within_a_second():
    cancel = threading.Event()
    outcomes = run_jobs(starter, (), [("square", 1), ("sleep", 60.0), ("sleep", 60.0)], 2, cancel)
    assert next(outcomes).answer.result == 1
    begin = time.monotonic()
    cancel.set()
    assert list(outcomes) == []
    assert time.monotonic() - begin < 1.0
    assert multiprocessing.active_children() == []


def test_cancel_in_this_process():
    cancel = threading.Event()
    outcomes = run_jobs_here(starter(), [("square", 1), ("square", 2)], 2, cancel)
    next(outcomes)
    cancel.set()
    assert list(outcomes) == []


def test_a_caller_that_stops_early_ends_all():
    outcomes = run_jobs(starter, (), [("square", 1), ("sleep", 60.0), ("sleep", 60.0)], 2)
    next(outcomes)
    begin = time.monotonic()
    outcomes.close()
    assert time.monotonic() - begin < 1.0
    assert multiprocessing.active_children() == []


PROGRAM = """
import multiprocessing, sys
from contextlib import closing
from simplifier.processes import run_jobs
from tests.hierarchy.jobs import starter

if __name__ == "__main__":
    jobs = [("square", 1), ("sleep", 60.0), ("sleep", 60.0)]
    try:
        with closing(run_jobs(starter, (), jobs, 2)) as outcomes:  # Ctrl-C may come outside of it
            next(outcomes)
            print(*(child.pid for child in multiprocessing.active_children()), flush=True)
            next(outcomes)
    except KeyboardInterrupt:
        print("interrupted", len(multiprocessing.active_children()), flush=True)
"""


BLOCKED = """
import signal
from simplifier.processes import without_interrupts
from multiprocessing import resource_tracker

with without_interrupts():
    resource_tracker.getfd()  # as the start of any process does
    print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ()))
print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ()))
"""


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="there are no signal masks")
def test_the_first_process_is_started_without_interrupts_too():
    """The resource tracker, which starts with the first, unblocks what was blocked before it."""
    done = subprocess.run(
        [sys.executable, "-c", BLOCKED], env=environment(), capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    assert done.stdout.split() == ["True", "False"]


def is_alive(pid):
    """Of a process that may be nobody's child; a zombie is not."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        return state not in "ZX"
    except FileNotFoundError:
        return False


@pytest.fixture
def program(tmp_path):
    """A process whose children sleep, and their ids; in a group of its own, as in a terminal."""
    (tmp_path / "program.py").write_text(PROGRAM)
    with subprocess.Popen(
        [sys.executable, tmp_path / "program.py"], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        env=environment(), text=True, start_new_session=True,
    ) as process:  # fmt: skip
        children = list(map(int, process.stdout.readline().split()))
        assert len(children) == 2
        yield process, children
        process.kill()


def all_gone(children, seconds):
    end = time.monotonic() + seconds
    while time.monotonic() < end and any(map(is_alive, children)):
        time.sleep(0.02)
    return not any(map(is_alive, children))


@pytest.mark.skipif(sys.platform != "linux", reason="looks at /proc")
def test_ctrl_c_leaves_no_process(program):
    """A terminal sends it to all; the children say nothing of it."""
    process, children = program
    os.killpg(process.pid, signal.SIGINT)
    assert process.stdout.read() == "interrupted 0\n"
    assert process.stderr.read() == ""
    assert all_gone(children, 1.0)


@pytest.mark.skipif(sys.platform != "linux", reason="looks at /proc")
def test_processes_end_with_their_starter(program):
    """A starter that is killed can end none of them; what they are at may take hours."""
    process, children = program
    process.kill()
    assert all_gone(children, 10.0)
