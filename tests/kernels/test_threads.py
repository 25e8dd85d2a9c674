"""Chunks cover the range once, on any number of threads, and exceptions come back."""

from __future__ import annotations

import os
import threading
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.kernels.threads import run_chunks, thread_count

sizes = st.integers(0, 200)


@settings(max_examples=80, deadline=None)
@given(sizes, st.integers(0, 50), st.integers(1, 8), st.integers(1, 9))
def test_each_place_is_visited_once(count, least, per_thread, threads):
    visits = np.zeros(count, dtype=np.int64)
    chunks = []

    def work(begin, end):
        chunks.append((begin, end))
        visits[begin:end] += 1

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("OCCLUDER_THREADS", str(threads))
        run_chunks(work, count, least=least, chunks_per_thread=per_thread)
    assert (visits == 1).all()
    assert all(begin < end for begin, end in chunks)
    assert len(chunks) <= max(threads * per_thread, 1)
    assert len(chunks) == 1 or all(end - begin >= least for begin, end in chunks) or count == 0


def test_one_thread_is_the_caller(monkeypatch):
    monkeypatch.setenv("OCCLUDER_THREADS", "1")
    seen = []
    run_chunks(lambda begin, end: seen.append((begin, end, threading.current_thread())), 100)
    assert seen == [(0, 100, threading.current_thread())]


def test_chunks_run_at_the_same_time(monkeypatch):
    # Each waits for all others: with fewer threads than chunks the barrier would break.
    monkeypatch.setenv("OCCLUDER_THREADS", "4")
    together = threading.Barrier(4, timeout=20.0)
    run_chunks(lambda begin, end: together.wait(), 4, chunks_per_thread=1)


def test_nothing_to_do(monkeypatch):
    for threads in ("1", "3"):
        monkeypatch.setenv("OCCLUDER_THREADS", threads)
        run_chunks(lambda begin, end: pytest.fail("called"), 0)


@pytest.mark.parametrize("threads", ["1", "3"])
def test_the_first_exception_comes_back(monkeypatch, threads):
    monkeypatch.setenv("OCCLUDER_THREADS", threads)

    def work(begin, end):
        raise KeyError(begin)

    with pytest.raises(KeyError) as caught:
        run_chunks(work, 30)
    assert caught.value.args == (0,)


def test_after_an_exception_nobody_works_any_more(monkeypatch):
    monkeypatch.setenv("OCCLUDER_THREADS", "2")
    begun, ended = [], []

    def work(begin, end):
        begun.append(begin)
        if begin == 0:
            raise ValueError
        time.sleep(0.05)
        ended.append(begin)

    with pytest.raises(ValueError):
        run_chunks(work, 60, chunks_per_thread=30)
    assert sorted(ended) == sorted(set(begun) - {0})
    assert len(begun) < 30  # those that had not begun are left out


@settings(max_examples=30, deadline=None)
@given(sizes, st.integers(0, 50), st.integers(1, 3))
def test_a_watcher_hears_shares_that_grow_to_one(count, least, threads):
    visits, shares = np.zeros(count, dtype=np.int64), []

    def work(begin, end):
        visits[begin:end] += 1

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("OCCLUDER_THREADS", str(threads))
        run_chunks(work, count, least=least, tell=shares.append)
    assert (visits == 1).all()
    assert shares == sorted(shares)
    assert shares[-1:] == [1.0] * (count > 0)


@pytest.mark.parametrize("threads", ["1", "3"])
def test_a_watcher_hears_of_one_long_chunk(monkeypatch, threads):
    monkeypatch.setenv("OCCLUDER_THREADS", threads)
    heard = threading.Event()
    shares = []

    def tell(share):
        shares.append(share)
        if len(shares) == 3:
            heard.set()

    run_chunks(lambda begin, end: heard.wait(timeout=20.0), 1, tell=tell)
    assert shares[:3] == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("threads", ["1", "3"])
def test_what_a_watcher_raises_ends_the_work(monkeypatch, threads):
    monkeypatch.setenv("OCCLUDER_THREADS", threads)
    begun, working = [], []

    def work(begin, end):
        begun.append(begin)
        working.append(begin)
        time.sleep(0.02)
        working.remove(begin)

    def tell(share):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_chunks(work, 1000, chunks_per_thread=100, tell=tell)
    assert working == []
    assert len(begun) < 20


@pytest.mark.parametrize("setting", ["", "0", "-2", "many", "1.5", " "])
def test_settings_that_are_no_count_are_passed_over(monkeypatch, setting):
    monkeypatch.setenv("OCCLUDER_THREADS", setting)
    assert thread_count() == len(os.sched_getaffinity(0))


def test_the_setting_counts(monkeypatch):
    monkeypatch.setenv("OCCLUDER_THREADS", "7")
    assert thread_count() == 7


def test_without_a_setting_there_are_as_many_as_processors_that_may_be_used(monkeypatch):
    """Those of the process, where the system tells, and else the machine's."""
    monkeypatch.delenv("OCCLUDER_THREADS", raising=False)
    assert thread_count() == len(os.sched_getaffinity(0))
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {1, 4, 6})
    assert thread_count() == 3
    monkeypatch.delattr(os, "sched_getaffinity")
    monkeypatch.setattr(os, "cpu_count", lambda: 5)
    assert thread_count() == 5
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert thread_count() == 1
