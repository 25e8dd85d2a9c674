"""Corners of a sheet where they are worth most: together, inside, and never worth less."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import binary_dilation

from simplifier.geometry.room import Room
from simplifier.geometry.views import image_axes
from simplifier.refinement.containment import are_inside
from simplifier.refinement.finalists import FineViews, Judge, Outlines
from simplifier.refinement.settle import settled
from tests.pictures import sphere_projections
from tests.refinement.soups import SIZE
from tests.solids import hills

LOW, LONG = np.array([3.0, 3.0, 12.0]), 18.0
REACH = 3  # cells around the hills that are room
FLAWLESS = 0.99


def placed(mesh):
    return mesh.vertices * LONG + LOW, mesh.faces


def sheet(sigma, seed=1, side=8, wide=1.0):
    """Triangles (m, 3, 3) of hills in few, each vertex off by so many cells; and so much wider."""
    vertices, faces = placed(hills(side))
    off = np.random.default_rng(seed).normal(scale=sigma, size=len(vertices))
    middle = LOW + np.array([LONG / 2.0, LONG / 2.0, 0.0])
    vertices = middle + (vertices - middle) * [wide, wide, 1.0] + off[:, None] * [0.0, 0.0, 1.0]
    return np.ascontiguousarray(vertices[faces])


@pytest.fixture(scope="module")
def judge():
    mesh = tuple(map(np.array, placed(hills(41))))
    directions = np.random.default_rng(2).normal(size=(16, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    maps = sphere_projections(image_axes(directions), np.full(3, SIZE / 2), 14.0)
    return Judge(FineViews.of(*mesh, maps, Outlines.of(*mesh, maps)), 0.99, 0.005)


@pytest.fixture(scope="module")
def room():
    vertices, _ = placed(hills(4 * SIZE))
    cells = np.zeros((SIZE,) * 3, dtype=np.bool_)
    cells[tuple(np.floor(vertices).astype(int).T)] = True
    return Room.of(binary_dilation(cells, iterations=REACH), 0.0, REACH)


def corners(triangles):
    """Which corners are at one place: (m, 3), numbered by the first of each."""
    _, first, number = np.unique(
        triangles.reshape(-1, 3), axis=0, return_index=True, return_inverse=True
    )
    return first[number.ravel()]


def test_what_sticks_out_is_put_back_and_nothing_opens(judge, room):
    """In such a state a decimated terrain stayed: a search moves one triangle at a time."""
    before = sheet(0.3)
    assert are_inside(before, room).all()
    assert judge.recall(before) > 0.9
    assert judge.worth(before) < 0.65
    after = settled(before, room, judge, FLAWLESS)
    assert judge.worth(after) > 0.94
    assert judge.recall(after) > judge.recall(before)
    assert judge.score(after).worst < judge.score(before).worst / 2.0
    assert are_inside(after, room).all()
    assert np.array_equal(corners(after), corners(before))


@given(seed=st.integers(0, 1000), sigma=st.floats(0.0, 1.5), side=st.integers(2, 7))
def test_it_is_never_worth_less_nor_outside(judge, room, seed, sigma, side):
    before = sheet(sigma, seed, side)
    before = before[are_inside(before, room)]
    after = settled(before, room, judge, FLAWLESS)
    assert judge.worth(after) >= judge.worth(before)
    assert are_inside(after, room).all()
    assert after.shape == before.shape


def test_the_same_on_any_number_of_threads(judge, room, monkeypatch):
    made = []
    for threads in ("1", "2", "5"):
        monkeypatch.setenv("OCCLUDER_THREADS", threads)
        made.append(settled(sheet(0.3), room, judge, FLAWLESS))
    assert all(np.array_equal(one, made[0]) for one in made[1:])


def tries(monkeypatch):
    """Of how many triangles each try is, from now on."""
    tried, score_above = [], Judge.score_above

    def counted(self, least, triangles):
        tried.append(len(triangles))
        return score_above(self, least, triangles)

    monkeypatch.setattr(Judge, "score_above", counted)
    return tried


@pytest.mark.parametrize(
    ("sigma", "enough", "stopped"),
    [(0.0, FLAWLESS, False), (0.3, 0.0, False), (0.3, FLAWLESS, True)],
    ids=["without faults", "worth enough", "stopped"],
)
def test_nothing_is_tried_where_nothing_is_to_gain_or_no_time(
    judge, room, monkeypatch, sigma, enough, stopped
):
    before = sheet(sigma, side=12 if sigma == 0.0 else 8)
    if enough < FLAWLESS:
        enough = judge.worth(before) - 0.05  # by pictures of half the size, a little less
    tried = tries(monkeypatch)
    assert settled(before, room, judge, enough, lambda: stopped) is before
    assert tried == []


def test_it_gives_up_what_a_turn_of_all_corners_hardly_mends(judge, room, monkeypatch):
    """What lies beside the sheet stays there: no normal leads back."""
    before = sheet(0.0, wide=1.25)
    cells = np.ones((SIZE,) * 3, dtype=np.bool_)
    tried = tries(monkeypatch)
    settled(before, Room.of(cells), judge, FLAWLESS)
    assert 0 < len(tried) <= 2 * 64


def test_it_ends_after_some_hundred_tries(judge, room, monkeypatch):
    tried = tries(monkeypatch)
    settled(sheet(0.4, side=24), room, judge, 2.0)
    assert 250 <= len(tried) <= 251
