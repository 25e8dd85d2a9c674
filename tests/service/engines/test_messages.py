"""What the server hears from a process is checked."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.engines.messages import (
    Cancelled,
    CancelTask,
    Done,
    Failed,
    Ready,
    Task,
    TaskProgress,
    answer_bytes,
    answer_of,
    instruction_bytes,
    instruction_of,
)
from service.jobs.job import Failure, JobKind, Summary
from service.jobs.progress import JobProgress, Snapshot

SUMMARY = Summary(1, 2, 3, 0.1, recall=0.2, timings={"cut": 0.1}, warnings=("a", "ä\n"))
PICTURELESS = (
    b'{"type":"told","progress":{"stage":"cut","fraction":0,"picture":{"number":1,"png":"!"}}}'
)
numbers = st.floats(allow_nan=False, allow_infinity=False)
options = st.dictionaries(
    st.text(), st.none() | st.booleans() | st.integers(-(2**53), 2**53) | numbers | st.text()
    | st.lists(numbers),
)  # fmt: skip


@settings(max_examples=30)
@given(st.text(), options)
def test_orders_arrive_as_they_were_sent(name, options):
    task = Task(JobKind.SCENE, name, options, {"scene": "/a/b"}, "r", "s", 2, 3, 4, {"scene": name})
    assert instruction_of(instruction_bytes(task)) == task
    assert instruction_of(instruction_bytes(CancelTask())) == CancelTask()


@pytest.mark.parametrize(
    "answer",
    [
        Ready(),
        TaskProgress(JobProgress("cut", 0.5, 0.25, 1, 3, 2.0)),
        TaskProgress(JobProgress("refine", 0.5, picture=Snapshot(2, bytes(range(256))))),
        Done(SUMMARY),
        Failed(Failure("out-of-time", "a", "b"), odd=True),
        Cancelled(),
    ],
)
def test_answers_arrive_as_they_were_sent(answer):
    assert answer_of(answer_bytes(answer)) == answer


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"null",
        b"{}",
        PICTURELESS,
        b'{"type":"task"}',
        b'{"type":"done"}',
        b"\x80\x04N.",
        b"[" * 9999,
    ],
)
def test_all_else_is_refused(data):
    with pytest.raises(ValueError):
        answer_of(data)
