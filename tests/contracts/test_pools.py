"""What every pool promises of a run's jobs; that of a cluster is held to it where there is one."""

from __future__ import annotations

import json
import threading
import time
from contextlib import closing, contextmanager
from importlib.util import find_spec

import numpy as np
import pytest

from simplifier.pools import DIED, LocalPool, PoolJob, Shared
from tests.contracts.pool_work import EMPTY, NUMBERS
from tests.waiting import until

WORK = "tests.contracts.pool_work:starter"


@contextmanager
def on_this_machine():
    yield LocalPool(2)


@contextmanager
def on_a_cluster():
    if find_spec("ray") is None:  # it is imported when its settings are there, which it reads then
        pytest.skip("Ray is not installed")
    from tests.cluster.pool_nodes import ray_cluster

    with ray_cluster(nodes=2) as cluster, cluster.pool() as pool:
        yield pool


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(on_this_machine, id="processes"),
        pytest.param(on_a_cluster, id="ray", marks=pytest.mark.cluster),
    ],
)
def pool(request):
    with request.param() as opened:
        yield opened


@pytest.fixture
def shared(tmp_path):
    settings = json.dumps({"folder": str(tmp_path)}).encode()
    return Shared(settings, {"numbers": NUMBERS, "empty": EMPTY})


def jobs_of(*jobs):
    return [PoolJob(json.dumps(job).encode()) for job in jobs]


def answers(pool, shared, *jobs):
    """(result, failure) of each job, in order; none is told twice."""
    outcomes = list(pool.run_jobs(WORK, shared, jobs_of(*jobs)))
    assert sorted(one.job for one in outcomes) == list(range(len(jobs)))
    by_place = {one.job: one.answer for one in outcomes}
    told = [by_place[place] for place in range(len(jobs))]
    return [(json.loads(one.result) if one.result else None, one.failure) for one in told]


def test_jobs_read_what_is_shared(pool, shared):
    whole = np.concatenate(NUMBERS)
    done = answers(pool, shared, *(("sum", place) for place in range(12)))
    assert done == [(float(whole[place:].sum()), "") for place in range(12)]


def test_arrays_arrive_as_they_were(pool, shared):
    done = answers(pool, shared, ("shape", "numbers"), ("shape", "empty"))
    assert [result for result, _ in done] == [
        [[15], "float64", True],
        [[0, 3], "int32", True],
    ]


def test_none_writes_what_others_read(pool, shared):
    done = answers(pool, shared, ("write", 0), ("sum", 0))
    assert "read-only" in done[0][1]
    assert done[1] == (float(np.concatenate(NUMBERS).sum()), "")


def test_workers_share_the_processors(pool, shared):
    assert answers(pool, shared, ("threads", 0)) == [("1", "")]


def test_work_is_started_once_in_a_process(pool, shared, tmp_path):
    answers(pool, shared, *(("mark", place) for place in range(20)))
    processes = [path.name.split("-")[1] for path in tmp_path.glob("start-*")]
    assert len(set(processes)) == len(processes) <= 4
    assert len(list(tmp_path.glob("begun-*"))) == 20


def test_what_fails_costs_no_other(pool, shared):
    done = answers(pool, shared, ("refuse", 0), ("fault", 7), ("sum", 14))
    assert [failure for _, failure in done] == [
        "it is no good; make it better",
        "IndexError: list index out of range",
        "",
    ]


def test_a_worker_that_dies_costs_one_attempt(pool, shared):
    done = answers(pool, shared, ("sum", 14), ("die once", 0), ("sum", 13))
    assert done == [(2.0, ""), ("die once", ""), (3.0, "")]


def test_a_job_that_kills_its_workers_is_given_up(pool, shared):
    done = answers(pool, shared, ("sum", 14), ("die", 0))
    assert done == [(2.0, ""), (None, DIED)]


def test_no_job_is_no_work(pool, shared, tmp_path):
    assert list(pool.run_jobs(WORK, shared, [])) == []


def under_way(folder):
    return [int(path.name.rpartition("-")[2]) for path in folder.glob("begun-60*")]


@pytest.mark.parametrize("how", ["cancel", "close"])
def test_what_is_not_wanted_any_more_ends_soon(pool, shared, tmp_path, how):
    from tests.test_processes import all_gone

    cancel = threading.Event()
    outcomes = pool.run_jobs(WORK, shared, jobs_of(("sum", 14), *[("sleep", 60)] * 3), cancel)
    with closing(outcomes):
        assert next(outcomes).answer.result == b"2.0"
        threading.Timer(2.0, cancel.set).start() if how == "cancel" else None
        begin = time.monotonic()
        if how == "cancel":
            assert list(outcomes) == []
            assert time.monotonic() - begin < 4.0
    until(lambda: all_gone(under_way(tmp_path), 0.1), 5.0)
