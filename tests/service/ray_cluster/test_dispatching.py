"""What a dispatcher offers and takes back, by a plain stand-in for Ray's few calls."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest

from service.engines.signals import Bell
from service.jobs.job import Claim, JobState
from service.jobs.turns import Shares
from service.ray_cluster.dispatching import Dispatcher
from service.settings import Settings
from service.storage.job_store import SqlJobStore
from service.storage.offer_store import SqlOffers
from service.storage.sqlite import SqliteDatabase
from tests.service.storage.fresh import fresh_database
from tests.service.storage.samples import results, submission, summary

LEASE = 30.0


class FakeRay:
    """Tasks that begin and end as a test says; ``cancelled`` are answers."""

    def __init__(self) -> None:
        self.tasks: list[FakeTask] = []
        self.cancelled: list[Any] = []

    def remote(self, function: Any) -> FakeFunction:
        return FakeFunction(self, {})

    def cancel(self, answer: Any, *, force: bool) -> None:
        assert force
        self.cancelled.append(answer)


class FakeFunction:
    def __init__(self, ray: FakeRay, chosen: dict[str, Any]) -> None:
        self._ray, self._chosen = ray, chosen

    def options(self, **chosen: Any) -> FakeFunction:
        return FakeFunction(self._ray, chosen)

    def remote(self, job_id: str, owner: str, release: str, places: int, threads: int) -> Any:
        self._ray.tasks.append(FakeTask(job_id, owner, self._chosen))
        return self._ray.tasks[-1]


class FakeTask:
    """Also the reference to its answer."""

    def __init__(self, job_id: str, owner: str, options: dict[str, Any]) -> None:
        self.job_id, self.owner, self.options = job_id, owner, options
        self._future: Future[None] = Future()

    def future(self) -> Future[None]:
        return self._future

    def end(self, error: Exception | None = None) -> None:
        if error is None:
            self._future.set_result(None)
        else:
            self._future.set_exception(error)


class FakeNodes:
    """As many processors as a test says."""

    processors, largest_memory = 2, 8 << 30

    def look(self) -> None:
        pass

    def placement(self) -> dict[str, Any]:
        return {}


class Farm:
    """``ray``, ``nodes`` and ``dispatcher`` on a database of its own."""

    def __init__(self, database: SqliteDatabase) -> None:
        self.jobs, self.offers = SqlJobStore(database), SqlOffers(database)
        self.ray, self.nodes = FakeRay(), FakeNodes()
        self.dispatcher = Dispatcher(
            self.ray, self.nodes, self.offers, Settings(), Bell()  # type: ignore[arg-type]
        )  # fmt: skip

    def submit(self) -> str:
        return self.jobs.submit(submission("a", may_reuse=False), 10**6)[0].id

    def step(self) -> list[FakeTask]:
        """The tasks that it gives."""
        before = len(self.ray.tasks)
        self.dispatcher.step(offering=True)
        return self.ray.tasks[before:]

    def begin(self, task: FakeTask) -> Claim:
        claim = self.offers.claim(task.job_id, task.owner, LEASE, Shares())
        assert claim is not None
        return claim

    def state(self, job_id: str) -> JobState:
        return self.jobs.job(None, job_id).state


@pytest.fixture
def farm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Farm]:
    monkeypatch.setattr("service.ray_cluster.dispatching._FIRST_PAUSE", 0.0)
    database = fresh_database(tmp_path / "occluder.db")
    yield Farm(database)
    database.close()


def test_few_more_are_offered_than_there_are_processors_each_once(farm: Farm) -> None:
    ids = [farm.submit() for _ in range(10)]
    assert [task.job_id for task in farm.step()] == ids[:4]
    assert not farm.step()
    first = farm.ray.tasks[0]
    farm.jobs.succeed(farm.begin(first), results(), summary())
    first.end()
    assert [task.job_id for task in farm.step()] == ids[4:5]
    assert len({task.owner for task in farm.ray.tasks}) == 5


def test_ray_is_told_what_a_job_needs_and_never_to_try_again(farm: Farm) -> None:
    farm.submit()
    (task,) = farm.step()
    assert (task.options["num_cpus"], task.options["num_gpus"]) == (1, 0)
    assert 0 < task.options["memory"] <= farm.nodes.largest_memory
    assert task.options["max_retries"] == 0


def test_a_job_whose_task_is_lost_is_taken_back_and_offered_again(farm: Farm) -> None:
    job_id = farm.submit()
    (task,) = farm.step()
    late = farm.begin(task)
    task.end(RuntimeError("the node died"))
    (again,) = farm.step()
    assert (again.job_id, again.owner != task.owner) == (job_id, True)
    claim = farm.begin(again)
    assert not farm.jobs.succeed(late, results("late"), summary())
    assert farm.jobs.succeed(claim, results(), summary())
    assert claim.job.attempt == 2


def test_a_job_that_was_done_before_its_task_was_lost_stays_done(farm: Farm) -> None:
    job_id = farm.submit()
    (task,) = farm.step()
    farm.jobs.succeed(farm.begin(task), results(), summary())
    task.end(RuntimeError("the node died as it was to answer"))
    assert not farm.step()
    assert farm.state(job_id) is JobState.SUCCEEDED


def test_a_job_whose_tasks_end_at_once_is_offered_ever_more_seldom(
    farm: Farm, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("service.ray_cluster.dispatching._FIRST_PAUSE", 60.0)
    farm.submit()
    (task,) = farm.step()
    task.end()
    assert not farm.step()


def test_where_it_does_not_lead_it_offers_nothing_and_sees_to_what_it_has_offered(
    farm: Farm,
) -> None:
    job_id = farm.submit()
    (task,) = farm.step()
    farm.submit()
    farm.begin(task)
    task.end(RuntimeError("the node died"))
    farm.dispatcher.step(offering=False)
    assert farm.state(job_id) is JobState.QUEUED
    assert len(farm.ray.tasks) == 1


def test_at_its_end_jobs_are_given_back_at_no_cost(farm: Farm) -> None:
    job_id = farm.submit()
    (task,) = farm.step()
    farm.begin(task)
    farm.dispatcher.give_back()
    job = farm.jobs.job(None, job_id)
    assert (job.state, job.attempts - job.attempt) == (JobState.QUEUED, 3)


def test_an_offer_that_no_node_has_room_for_any_more_is_made_anew(farm: Farm) -> None:
    job_id = farm.submit()
    (task,) = farm.step()
    farm.nodes.largest_memory = task.options["memory"] - 1
    (again,) = farm.step()
    assert farm.ray.cancelled == [task]
    assert (again.job_id, again.options["memory"]) == (job_id, farm.nodes.largest_memory)
