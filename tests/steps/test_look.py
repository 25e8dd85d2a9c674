"""Looks at the original: while sections are cut, with the same result, and over when the run is."""

from __future__ import annotations

import threading
import time

import pytest

from simplifier.errors import CancelledError
from simplifier.kernels import contours
from simplifier.kernels.contours import draw_by_contours
from simplifier.options.stages import make_options
from simplifier.pipeline import simplify_mesh
from simplifier.progress import Deadline, Stopwatch
from simplifier.steps import look as look_step
from simplifier.steps.look import StoppedError, looking
from simplifier.steps.room import open_room
from simplifier.steps.solid import solidify
from tests.solids import blob


class Asked:
    """A cancel that notes who asks, and is set after so many times."""

    def __init__(self, times=10**9):
        self.askers, self.times = [], times

    def is_set(self):
        self.askers.append(threading.get_ident())
        return len(self.askers) > self.times


def run(listener=None, cancel=None, **options):
    mesh = blob(rings=12)
    chosen = make_options(float(mesh.extent.max()), **{"budget": 12, "moves": 600, **options})
    return simplify_mesh(mesh, chosen, listener, cancel)


@pytest.fixture
def lookers(monkeypatch):
    """The threads that look, in a run on two."""
    found, real = [], look_step.look

    def look(*given):
        found.append(threading.get_ident())
        return real(*given)

    monkeypatch.setenv("OCCLUDER_THREADS", "2")
    monkeypatch.setattr(look_step, "look", look)
    return found


def test_a_time_limit_that_is_up_ends_the_look_of_a_run_that_nobody_hears():
    mesh = blob(rings=12)
    options = make_options(float(mesh.extent.max()), resolution=16, time_limit=0.5)
    solid = solidify(mesh, options.solid, Stopwatch())
    room = open_room(mesh, solid, options)
    deadline = Deadline(0.0, 0.5, clock=lambda: 1.0)
    looks = looking(mesh, solid, room, options, Stopwatch(), deadline)
    with looks as ahead, pytest.raises(StoppedError):
        ahead.result(lambda: deadline.is_up)


def test_who_looks_changes_nothing(lookers, monkeypatch):
    made = []
    for threads in ("1", "2"):
        monkeypatch.setenv("OCCLUDER_THREADS", threads)
        made.append(run(resolution=24).occluder)
    here = threading.get_ident()
    assert [one == here for one in lookers] == [True, False]
    assert made[0].vertices.tobytes() == made[1].vertices.tobytes()


def test_small_pictures_are_drawn_by_the_table_that_large_ones_pay_for(monkeypatch):
    mesh, drawn, tables = blob(rings=66), [], []
    assert len(mesh.faces) > 8192  # fewer are drawn one by one in pictures of 512 pixels

    def draw(table, views, columns, *others):
        drawn.append(columns)
        tables.append(table)
        return draw_by_contours(table, views, columns, *others)

    monkeypatch.setattr(contours, "draw_by_contours", draw)
    options = make_options(float(mesh.extent.max()), budget=12, resolution=16, moves=40)
    simplify_mesh(mesh, options)
    assert drawn[:2] == [512, 64]
    assert all(table is tables[0] for table in tables)


@pytest.mark.parametrize("options", [{"time_limit": 60.0, "moves": None}, {"moves": 0}])
def test_nobody_looks_ahead_where_the_cut_comes_first_or_is_all(lookers, options):
    run(cancel=Asked(240), resolution=16, **options)
    assert lookers == [threading.get_ident()] * len(lookers)
    assert len(lookers) == ("time_limit" in options)


def test_a_cancel_is_asked_on_the_callers_thread_alone(lookers):
    cancel = Asked()
    run(cancel=cancel, resolution=24)
    assert set(cancel.askers) == {threading.get_ident()} != set(lookers)


@pytest.mark.parametrize("error", [CancelledError, KeyboardInterrupt])
def test_who_ends_the_cut_ends_the_look(lookers, error):
    """Nothing works on when the run has ended, whoever ended it."""
    before = threading.active_count()

    def listen(progress):
        if progress.stage == "loops":
            raise error("enough")

    with pytest.raises(error):
        run(listen, resolution=24)
    assert lookers
    assert threading.active_count() == before


def test_what_fails_while_looking_is_told(monkeypatch):
    def fail(*given, **named):
        raise MemoryError("no room for pictures")

    for threads in ("1", "2"):
        monkeypatch.setenv("OCCLUDER_THREADS", threads)
        monkeypatch.setattr(look_step, "thinned", fail)
        with pytest.raises(MemoryError, match="no room"):
            run(resolution=16)


def test_a_cancel_while_there_is_nothing_to_refine_by_keeps_the_sections(lookers, monkeypatch):
    """Pictures take for ever: the caller asks to end while it waits for them."""
    cancel = Asked()

    def silhouettes(vertices, faces, projections, tell, device):
        while True:
            tell(0.0)
            time.sleep(0.001)

    def listen(progress):
        if progress.stage == "refine":
            cancel.times = 0

    monkeypatch.setattr(look_step, "silhouettes", silhouettes)
    result = run(listen, cancel, resolution=24)
    assert result.interrupted
    assert "not refined" in result.decisions[-1]
    assert len(result.occluder.faces) > 0
