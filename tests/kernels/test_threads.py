"""Chunks cover the range once, on any number of threads, and exceptions come back; and what is made
ahead is made once, whoever makes it."""

from __future__ import annotations

import gc
import os
import threading
import time
import weakref
from contextlib import closing

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.kernels.threads import Ahead, run_both, run_chunks, run_each, running, thread_count

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


def test_the_caller_works_as_soon_as_one_other_does(monkeypatch):
    """On sixteen processors it waited for fifteen starts before: twice what small work takes."""
    monkeypatch.setenv("OCCLUDER_THREADS", "16")
    starters, begun = [], []
    first_start = threading.Thread.start

    def start(thread):
        starters.append(threading.current_thread())
        first_start(thread)

    def work(begin, end):
        begun.append((threading.current_thread(), starters.count(caller)))
        time.sleep(0.01)

    monkeypatch.setattr(threading.Thread, "start", start)
    caller = threading.current_thread()
    run_chunks(work, 64, chunks_per_thread=4)
    assert next(starts for thread, starts in begun if thread is caller) == 1
    assert len(starters) == 15
    assert len({thread for thread, _ in begun}) == 16
    assert set(starters) - {caller}


def wait_until_there_are(threads):
    until = time.monotonic() + 20.0
    while threading.active_count() > threads:
        assert time.monotonic() < until
        time.sleep(0.001)


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


@pytest.mark.parametrize("threads", ["1", "3"])
def test_each_is_made_in_order_and_an_error_comes_back(monkeypatch, threads):
    monkeypatch.setenv("OCCLUDER_THREADS", threads)
    assert run_each(lambda text: text.upper(), "abcdefghijklmnop") == list("ABCDEFGHIJKLMNOP")
    assert run_each(str, []) == []
    with pytest.raises(ZeroDivisionError):
        run_each(lambda number: 1 / number, [2, 1, 0, 4])


@pytest.mark.parametrize("threads", ["1", "2"])
def test_both_are_made_this_thread_at_the_first(monkeypatch, threads):
    monkeypatch.setenv("OCCLUDER_THREADS", threads)
    begun = threading.Barrier(int(threads), timeout=20.0)

    def made_by():
        begun.wait()
        return threading.get_ident()

    first, second = run_both(made_by, made_by)
    assert first == threading.get_ident()
    assert (first == second) == (threads == "1")
    with pytest.raises(ZeroDivisionError):
        run_both(lambda: 1 / 0, lambda: "made")


def test_a_nested_call_gets_no_third_thread_while_two_are_at_work(monkeypatch):
    """With three on two processors, two of them shared one for ten milliseconds."""
    monkeypatch.setenv("OCCLUDER_THREADS", "2")
    inner_done, workers = threading.Event(), set()

    def work(which):
        if which == "long":
            assert inner_done.wait(timeout=20.0)
        else:
            run_chunks(lambda begin, end: workers.add(threading.get_ident()), 40)
            inner_done.set()

    run_each(work, ["long", "nested"])
    assert len(workers) == 1


@pytest.mark.parametrize("calls", [["short", "nested"], ["nested", "short"]])
def test_who_has_nothing_left_to_do_helps_a_nested_call(monkeypatch, calls):
    """A terrain's surface was decimated in two manners by one thread, where the other was done."""
    monkeypatch.setenv("OCCLUDER_THREADS", "2")
    begun = threading.Event()
    together = threading.Barrier(2, timeout=20.0)

    def work(which):
        if which == "short":
            assert begun.wait(timeout=20.0)
        else:
            # The first chunk is begun while both threads are at work, so nobody helps yet.
            begun.set()
            run_each(lambda place: together.wait(), range(2))

    run_each(work, calls)


def test_who_waits_for_what_is_made_ahead_lets_it_have_help(monkeypatch):
    monkeypatch.setenv("OCCLUDER_THREADS", "2")
    alone, helped = set(), threading.Barrier(2, timeout=20.0)
    asked = threading.Event()

    def make(stopped):
        run_chunks(lambda begin, end: alone.add(threading.get_ident()), 40)
        asked.set()
        run_each(lambda place: helped.wait(), range(2))
        return "made"

    with closing(Ahead(make)) as ahead, running():
        ahead.begin()
        assert asked.wait(timeout=20.0)
        assert ahead.result() == "made"
    assert len(alone) == 1
    assert threading.get_ident() not in alone


def test_within_a_run_one_thread_helps_again_and_again_and_is_gone_behind_it(monkeypatch):
    """Its start took twice as long as to wake it; and a service counts what a job leaves behind."""
    monkeypatch.setenv("OCCLUDER_THREADS", "2")
    before = threading.active_count()
    workers = set()

    def work(place):
        together.wait()
        workers.add(threading.get_ident())

    with running():
        for _ in range(5):
            together = threading.Barrier(2, timeout=20.0)
            run_each(work, range(2))
    assert len(workers) == 2
    assert threading.active_count() == before


def test_what_was_worked_on_is_let_go_of_at_once(monkeypatch):
    """A cycle of references kept it until the next collection: 55 MiB of a bunny's run."""
    monkeypatch.setenv("OCCLUDER_THREADS", "2")

    def call():
        held = np.zeros(3)
        together = threading.Barrier(2, timeout=20.0)

        def work(place):
            together.wait()
            held[place] = 1.0

        run_each(work, range(2))
        return weakref.ref(held)

    gc.collect()
    gc.disable()
    try:
        with running():
            assert call()() is None
    finally:
        gc.enable()


def test_a_helper_that_nobody_needs_soon_ends_and_another_comes(monkeypatch):
    monkeypatch.setenv("OCCLUDER_THREADS", "2")
    before = threading.active_count()
    with running():
        test_chunks_run_at_the_same_time(monkeypatch)
        wait_until_there_are(before)
        test_chunks_run_at_the_same_time(monkeypatch)
    assert threading.active_count() == before


@pytest.mark.parametrize("threads", ["2", "3"])
def test_many_callers_at_once_each_get_all_of_theirs(monkeypatch, threads):
    monkeypatch.setenv("OCCLUDER_THREADS", threads)
    before = threading.active_count()
    sums = []

    def total(size):
        parts = np.zeros(size, dtype=np.int64)

        def work(begin, end):
            parts[begin:end] += 1
            if size > 4:
                parts[begin:end] += total(size // 4)

        run_chunks(work, size)
        return int(parts.sum())

    def call():
        sums.extend(total(24) for _ in range(60))

    callers = [threading.Thread(target=call) for _ in range(4)]
    for caller in callers:
        caller.start()
    for caller in callers:
        caller.join(timeout=60.0)
        assert not caller.is_alive()
    assert sums == [24 * (1 + 6 * (1 + 1))] * 240
    wait_until_there_are(before)


def test_an_interrupt_leaves_nobody_at_work(monkeypatch):
    """Else there would be fewer threads from then on."""
    monkeypatch.setenv("OCCLUDER_THREADS", "2")

    def interrupt(share):
        raise KeyboardInterrupt

    for _ in range(3):
        with pytest.raises(KeyboardInterrupt):
            run_chunks(lambda begin, end: time.sleep(0.02), 100, tell=interrupt)
    test_chunks_run_at_the_same_time(monkeypatch)


def test_a_helper_that_cannot_be_started_is_an_error_and_not_waited_for(monkeypatch):
    monkeypatch.setenv("OCCLUDER_THREADS", "2")

    def start(thread):
        raise RuntimeError("can't start new thread")

    with monkeypatch.context() as patch:
        patch.setattr(threading.Thread, "start", start)
        with pytest.raises(RuntimeError, match="new thread"):
            run_each(str, range(8))
    test_chunks_run_at_the_same_time(monkeypatch)


def made_by(thread_idents):
    """What notes who makes it."""

    def make(stopped):
        thread_idents.append(threading.get_ident())
        return len(thread_idents)

    return make


def test_what_is_begun_is_made_while_the_caller_goes_on(monkeypatch):
    monkeypatch.setenv("OCCLUDER_THREADS", "2")
    together = threading.Barrier(2, timeout=20.0)
    with closing(Ahead(lambda stopped: together.wait())) as ahead:
        ahead.begin()
        ahead.begin()  # is begun already
        together.wait()
        assert ahead.result() in (0, 1)
        assert ahead.result() == ahead.result()


@pytest.mark.parametrize(("threads", "begins"), [("1", True), ("2", False)])
def test_else_the_caller_makes_it_when_it_asks_and_once(monkeypatch, threads, begins):
    monkeypatch.setenv("OCCLUDER_THREADS", threads)
    makers = []
    with closing(Ahead(made_by(makers))) as ahead:
        if begins:
            ahead.begin()
        assert makers == []
        assert (ahead.result(), ahead.result()) == (1, 1)
    assert makers == [threading.get_ident()]
    with closing(Ahead(made_by(makers))):
        pass
    assert len(makers) == 1  # nobody asked


@pytest.mark.parametrize("begins", [False, True])
def test_an_error_in_making_is_the_callers(monkeypatch, begins):
    monkeypatch.setenv("OCCLUDER_THREADS", "2")

    def make(stopped):
        raise LookupError

    with closing(Ahead(make)) as ahead:
        if begins:
            ahead.begin()
        with pytest.raises(LookupError):
            ahead.result()


def test_who_leaves_tells_the_maker_and_waits_for_it(monkeypatch):
    monkeypatch.setenv("OCCLUDER_THREADS", "2")
    seen = []

    def make(stopped):
        while not stopped():
            time.sleep(0.001)
        seen.append(True)

    def leave():
        with closing(Ahead(make)) as ahead:
            ahead.begin()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        leave()
    assert seen == [True]


@pytest.mark.parametrize("begins", [False, True])
def test_whether_to_stop_is_asked_on_the_callers_thread(monkeypatch, begins):
    monkeypatch.setenv("OCCLUDER_THREADS", "2")
    askers = []

    def stopped():
        askers.append(threading.get_ident())
        return len(askers) == 3

    def make(asked):
        while not asked():
            time.sleep(0.001)
        return "given up"

    with closing(Ahead(make)) as ahead:
        if begins:
            ahead.begin()
        assert ahead.result(stopped) == "given up"
    assert set(askers) == {threading.get_ident()}
