"""This end of the pair, in a process that works."""

from __future__ import annotations

import math
import threading
from multiprocessing import Pipe

import pytest

from service.engines import worker
from service.engines.messages import Task, TaskProgress, answer_of, instruction_bytes
from service.jobs.job import JobKind
from service.jobs.progress import READING, JobProgress
from simplifier import STAGES

TASK = Task(JobKind.OCCLUDER, "a.obj", {}, {"mesh": "/a"}, "r", "s", 2, 3, 4, {})


@pytest.fixture
def wire(monkeypatch):
    """It and the server's end, whose going ends no process; it is never time to tell more."""
    ended = threading.Event()
    monkeypatch.setattr(worker, "_TELL_SECONDS", math.inf)
    monkeypatch.setattr(worker, "end_group", ended.set)
    here, there = Pipe()
    with here, there:
        yield worker._Wire(there), here
        here.close()
        assert ended.wait(10.0)


def test_the_first_word_of_a_job_goes_at_once_and_others_soon_after_are_left_out(wire):
    ours, server = wire
    for stage in ("voxelize", "cut"):
        server.send_bytes(instruction_bytes(TASK))
        assert ours.next_task() == TASK
        ours.tell(JobProgress(stage, 0.25))
        ours.tell(JobProgress("refine", 0.5))
        told = answer_of(server.recv_bytes())
        assert isinstance(told, TaskProgress)
        assert told.progress.stage == stage
        assert not server.poll()


def test_the_end_of_reading_is_told_at_once(wire):
    ours, server = wire
    server.send_bytes(instruction_bytes(TASK))
    ours.next_task()
    for stage in ("load", "load", "voxelize", "cut"):
        ours.tell(JobProgress(stage, 0.25))
    assert [answer_of(server.recv_bytes()).progress.stage for _ in range(2)] == ["load", "voxelize"]
    assert not server.poll()


def test_the_first_stage_of_the_library_is_reading():
    assert STAGES[0] == READING
