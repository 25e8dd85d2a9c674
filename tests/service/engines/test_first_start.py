"""With nothing compiled yet one process gets ready alone, and the others after it."""

from __future__ import annotations

import threading

import pytest

from service.engines.first_start import FirstStart
from service.engines.trouble import StoppedError
from service.jobs.job import JobState
from service.jobs.progress import PREPARING
from tests.service.engines.workplace import Workplace
from tests.waiting import until


def starts(file):
    """How many processes have begun to get ready."""
    return file.read_text().count("begin") if file.exists() else 0


def test_one_process_prepares_and_jobs_say_so(tmp_path, monkeypatch):
    note, compiled = tmp_path / "starts", tmp_path / "compiled"
    monkeypatch.setenv("TMPDIR", str(tmp_path))  # of little that workers are told by
    place = Workplace(tmp_path / "place", "tests.service.engines.works:start_when_compiled")
    with place.open():
        job_id = place.submit()
        until(lambda: starts(note) == 1)
        waiting = place.board.how_far(place.job(job_id))
        assert (waiting.stage, waiting.fraction) == (PREPARING, 0.0)
        until(lambda: place.board.preparing.seconds > 0.3)
        assert starts(note) == 1  # of two
        compiled.touch()
        assert place.end_of(job_id).state is JobState.SUCCEEDED
        assert place.board.preparing is None
        assert place.board.how_far(place.job(job_id)) is None
        until(lambda: note.read_text().count("end") == 2)
    assert note.read_text().split() == ["begin", "end", "begin", "end"]


def test_who_dies_at_it_leaves_it_to_the_next(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    place = Workplace(tmp_path / "place", "tests.service.engines.works:start_at_the_fourth_try")
    with place.open():
        assert place.end_of(place.submit()).state is JobState.SUCCEEDED
        assert place.board.preparing is None


def test_one_that_waits_ends_with_the_engine():
    first = FirstStart(lambda: None)

    def stop():
        raise StoppedError

    with first.turn(stop), pytest.raises(StoppedError), first.turn(stop):
        pytest.fail("two have begun at once")
    with first.turn(stop):
        pass  # it is free again


def test_all_begin_at_once_when_one_was_ready():
    told = []
    first = FirstStart(lambda: told.append("over"))
    both = threading.Barrier(3)

    def begin():
        with first.turn(lambda: None):
            both.wait(10.0)

    with first.turn(lambda: None):
        others = [threading.Thread(target=begin) for _ in range(2)]
        for one in others:
            one.start()
        first.end()
        first.end()
        both.wait(10.0)
    for one in others:
        one.join()
    assert told == ["over"]
