"""Threads that last as long as a block."""

from __future__ import annotations

import threading

import pytest

from service.background import in_background


def test_it_runs_while_the_block_lasts_and_is_waited_for():
    began, ended = threading.Event(), threading.Event()

    def run(stop: threading.Event) -> None:
        began.set()
        stop.wait()
        ended.set()

    with in_background(run, "of a test"):
        assert began.wait(10.0)
        assert "of a test" in {one.name for one in threading.enumerate()}
        assert not ended.is_set()
    assert ended.is_set()
    assert "of a test" not in {one.name for one in threading.enumerate()}


def test_it_ends_with_a_block_that_fails():
    ended = threading.Event()

    def run(stop: threading.Event) -> None:
        stop.wait()
        ended.set()

    with pytest.raises(ValueError, match="of the block"), in_background(run, "of a test"):
        raise ValueError("of the block")
    assert ended.is_set()
