"""When pictures are drawn, and that drawing never takes much of the time."""

from __future__ import annotations

import numpy as np
import pytest

from service.engines.work.occluder import BestSoFar
from simplifier import Progress, picture_of
from tests.solids import box

MESH = box()
TRIANGLES = MESH.vertices[MESH.faces[:4]]


class Clock:
    """Stands still but for what drawing takes."""

    def __init__(self, drawing):
        self.now, self.drawing, self.drawn = 0.0, drawing, 0

    def __call__(self):
        return self.now

    def best(self):
        self.now += self.drawing
        self.drawn += 1
        return TRIANGLES


def refining(clock, draw):
    return draw(Progress("refine", 0.5, clock.now, 0.5, best=clock.best))


def test_a_picture_a_second_numbered_from_one():
    clock = Clock(0.001)
    draw, told = BestSoFar(MESH, "z", clock), []
    for _ in range(100):
        clock.now += 0.05
        told.append(refining(clock, draw))
    pictures = [one for one in told if one]
    assert told.index(pictures[0]) == pytest.approx(20, abs=1)
    assert [one.number for one in pictures] == list(range(1, len(pictures) + 1))
    assert len(pictures) == clock.drawn == 5 - 1
    assert {one.png for one in pictures} == {picture_of(MESH, TRIANGLES, up="z")}


@pytest.mark.parametrize("drawing", [0.001, 0.1, 3.0])
def test_drawing_takes_a_twentieth_of_the_time_at_most(drawing):
    clock = Clock(drawing)
    draw = BestSoFar(MESH, "y", clock)
    while clock.now < 600.0:
        clock.now += 0.1
        refining(clock, draw)
    assert clock.drawn > 1
    assert (clock.drawn - 1) * drawing <= 0.05 * clock.now


def test_nothing_is_drawn_before_there_is_a_best():
    clock = Clock(0.0)
    draw = BestSoFar(MESH, "y", clock)
    clock.now = 100.0
    assert draw(Progress("cut", 0.5, clock.now)) is None
    assert refining(clock, draw).png == picture_of(MESH, np.asarray(TRIANGLES))
