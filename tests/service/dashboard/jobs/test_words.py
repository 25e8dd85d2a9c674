"""Jobs in words."""

from __future__ import annotations

from dataclasses import replace

from service.dashboard.jobs.best_so_far import polyline
from service.dashboard.jobs.job_lines import line_of, progress_words
from service.dashboard.jobs.live_job import state_words
from service.dashboard.jobs.words import (
    KINDS,
    STATE_CLASSES,
    STATES,
    failure_title,
    sentence,
    stage_words,
)
from service.jobs.job import Failure, Job, JobKind, JobState
from service.jobs.progress import PREPARING, JobProgress
from simplifier import STAGES

JOB = Job(
    id="j", number=1, tenant="t", kind=JobKind.OCCLUDER, state=JobState.RUNNING, name="a.obj",
    options={}, version="1", created=0.0, attempt=1, attempts=3,
)  # fmt: skip


def test_everything_has_words() -> None:
    assert set(KINDS) == set(JobKind)
    assert set(STATES) == set(STATE_CLASSES) == set(JobState)
    assert all(stage_words(stage) != stage for stage in (*STAGES, PREPARING, "occluders", "runs"))


def test_options_that_fail_need_not_contradict_each_other() -> None:
    failure = Failure("invalid-options", "error bound: 1e-300 is too small", "choose more")
    assert failure_title(failure) == "The options cannot be used"


def test_sentences_leave_names_as_they_are() -> None:
    assert sentence("the disk is full") == "The disk is full."
    assert sentence("a.obj: no face") == "a.obj: no face."
    assert sentence("") == ""


def test_progress_counts_levels_from_one_and_runs_that_are_done() -> None:
    assert (
        progress_words(JobProgress("refine", 0.5, None, 1, 3)) == "refining triangles, level 2 of 3"
    )
    assert progress_words(JobProgress("refine", 0.5)) == "refining triangles"
    assert progress_words(JobProgress("runs", 0.5, None, 4, 9)) == "running settings, 4 of 9 done"


def test_a_job_that_waits_for_the_first_start_says_so() -> None:
    waiting = replace(JOB, state=JobState.QUEUED, attempt=0)
    line = line_of(waiting, JobProgress(PREPARING, 0.0, seconds=12.0), place=3)
    assert state_words(line) == ("place 3 in the queue; preparing: compiling, once, 12.00 s")
    assert state_words(line_of(waiting, place=1)) == "place 1 in the queue"


def test_a_failed_job_says_why_and_what_to_do() -> None:
    failed = replace(
        JOB, state=JobState.FAILED, failure=Failure("out-of-memory", "too much", "send less")
    )
    line = line_of(failed, JobProgress("refine", 0.5))
    assert (line.reason, line.remedy) == ("Too much.", "Send less.")
    assert line.title == "The job needed more memory than is allowed"
    assert line.fraction == 0.0  # progress that was told before counts no more


def test_the_line_spans_its_box_and_rises_upwards() -> None:
    assert polyline([(1.0, 0.2), (2.0, 0.6), (3.0, 0.4)]) == "0.0,38.0 100.0,2.0 200.0,20.0"
    assert polyline([(1.0, 0.5)]) == "0.0,38.0"
