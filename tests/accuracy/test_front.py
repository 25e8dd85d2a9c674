"""What an occluder stands before: bowls by hand, what is none, other sizes, places and turns."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import simplifier
from simplifier.accuracy.front import measure_front
from simplifier.errors import MeshError, OptionError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.views import random_directions
from tests.schema import check_report
from tests.solids import NOTHING, as_occluder, blob, box, joined, moved, sphere

LINES = random_directions(12, 3)
DOWN = np.array([[0.0, -1.0, 0.0]])
TOP, GROUND = 3, 2  # sides of a box
BOWL = box(without=[TOP])


def test_none_has_none():
    mesh = blob()
    for occluder in (NOTHING, as_occluder(mesh)):
        found = measure_front(mesh, occluder, LINES)
        assert (found.by_view == 0.0).all()
        assert (found.mean, found.worst, found.worst_view) == (0.0, 0.0, 0)


@settings(max_examples=20, deadline=None)
@given(st.integers(1, 20), st.integers(0, 2**32 - 1))
def test_what_lies_within_a_convex_mesh_stands_before_nothing(triangles, seed):
    corners = np.random.default_rng(seed).uniform(-0.57, 0.57, (triangles, 3, 3))
    soup = Occluder.of(corners, 0.0, {})
    assert measure_front(sphere(1.0), soup, LINES).worst == 0.0


@settings(max_examples=15, deadline=None)
@given(st.floats(0.0, 0.2), st.floats(0.0, 0.2), st.integers(0, 11))
def test_pushed_inward_it_stands_before_no_more(one, other, view):
    """Away from the viewer, so that it shows in the same pixels."""
    mesh, line = blob(), LINES[view]
    fronts = [
        measure_front(mesh, as_occluder(moved(mesh, 1.1, depth * line)), line[None]).mean
        for depth in sorted((one, other))
    ]
    assert fronts[0] >= fronts[1]


@pytest.mark.parametrize("larger", [1.0, 1.005, 1.015, 1.021, 3.0])
def test_a_shell_counts_where_the_ray_goes_far_through_it(larger):
    """A ray that meets the unit sphere at depth -a has gone sqrt(l^2 - 1 + a^2) - a through the
    shell: over 0.02, a hundredth of the diameter, where a is below the edge, whose square is the
    share."""
    found = measure_front(sphere(1.0, rings=64), as_occluder(sphere(larger, rings=64)), LINES)
    edge = np.clip((larger**2 - 1.0 - 0.02**2) / (2.0 * 0.02), 0.0, 1.0)
    assert found.by_view == pytest.approx(np.full(12, edge**2), abs=0.01)


def test_a_bowl_that_is_filled():
    """Straight down nothing of its ground is seen any more; from all other sides all is as it was,
    but what the viewer sees past its edge."""
    aslant = np.array([[0.0, -1.0, 1.0]]) / np.sqrt(2.0)
    lines = np.concatenate([DOWN, -DOWN, [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], aslant])
    found = measure_front(BOWL, as_occluder(box()), lines)
    assert found.by_view[0] > 0.99
    assert found.by_view[1:4].tolist() == [0.0, 0.0, 0.0]
    # At 45 degrees half of what is seen is the opening.  A ray that enters it so far before the
    # wall ahead goes the square root of 2 times as far until it meets it.
    beyond = 1.0 - 0.02 * (np.sqrt(3.0) / 2.0) / np.sqrt(2.0)
    assert found.by_view[4] == pytest.approx(0.5 * beyond, abs=0.01)
    assert (found.worst_view, found.worst) == (0, found.by_view[0])
    assert found.mean == pytest.approx(found.by_view.mean())


@pytest.mark.parametrize(("height", "filled"), [(0.013, False), (0.016, True)])
def test_a_tray_is_a_bowl_once_it_is_a_hundredth_deep(height, filled):
    """Of its diagonal, the square root of 2."""
    tray = box((1.0, height, 1.0), without=[TOP])
    found = measure_front(tray, as_occluder(box((1.0, height, 1.0))), DOWN)
    assert found.mean == (pytest.approx(1.0, abs=0.02) if filled else 0.0)


def test_a_room_behind_a_window():
    """Two thirds by a half of the wall is open, and filled flush with it."""
    room = box((3.0, 2.0, 2.0), without=[4])
    sill, lintel = (box((3.0, 0.5, 0.0), (0.0, y, 0.0), without=[1, 2, 3, 4, 0]) for y in (0, 1.5))
    posts = [box((0.5, 1.0, 0.0), (x, 0.5, 0.0), without=[1, 2, 3, 4, 0]) for x in (0, 2.5)]
    mesh = joined(room, sill, lintel, *posts)
    ahead = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    found = measure_front(mesh, as_occluder(box((3.0, 2.0, 2.0))), ahead)
    assert found.by_view == pytest.approx([2.0 / 6.0, 0.0], abs=0.01)
    assert measure_front(mesh, as_occluder(room), ahead).worst == 0.0


def test_what_stands_beside_is_no_front():
    spike = box((1.0, 5.0, 1.0), (1.1, 0.0, 0.0))
    line = np.array([[0.0, 0.0, 1.0]])
    assert measure_front(box(), as_occluder(spike), line).mean == 0.0
    assert measure_front(box(), as_occluder(moved(spike, 1.0, (-1.1, 0.0, -2.0))), line).mean == 1.0


def test_where_the_original_shows_nothing_there_is_none():
    sheet = box((1.0, 1.0, 0.0), without=[0, 1, 2, 3, 4])
    assert measure_front(sheet, as_occluder(box()), np.array([[1.0, 0.0, 0.0]])).mean == 0.0


@pytest.mark.parametrize(("scale", "offset"), [(2.0**-30, 0.0), (2.0**40, 0.0), (1.0, 1024.0)])
def test_any_size_and_place(scale, offset):
    here = measure_front(BOWL, as_occluder(box()), LINES)
    there = measure_front(
        moved(BOWL, scale, offset), as_occluder(moved(box(), scale, offset)), LINES
    )
    assert there.by_view == pytest.approx(here.by_view, abs=1e-3)
    assert here.mean > 0.1


@pytest.mark.parametrize("seed", range(3))
def test_turned_with_its_directions_it_is_the_same_but_for_rounding(seed):
    turn, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    # Rounder than a box: its sphere, by the box around it, would not stay the same.
    mesh = joined(sphere(1.0, rings=64), moved(BOWL, 0.8, (-0.4, 0.55, -0.4)))
    lid = moved(box(), 0.8, (-0.4, 0.55, -0.4))

    def turned(one):
        return TriangleMesh.from_soup(one.vertices @ turn.T, one.faces)

    here = measure_front(mesh, as_occluder(lid), LINES)
    there = measure_front(turned(mesh), as_occluder(turned(lid)), LINES @ turn.T)
    assert there.by_view == pytest.approx(here.by_view, abs=0.01)
    assert here.worst > 0.1


def test_threads_change_nothing(monkeypatch):
    mesh, occluder = blob(), as_occluder(sphere(1.05))
    results = []
    for threads in ("1", "2", "5"):
        monkeypatch.setenv("OCCLUDER_THREADS", threads)
        results.append(measure_front(mesh, occluder, LINES).by_view.tobytes())
    assert len(set(results)) == 1


def test_what_cannot_be_drawn_is_refused():
    wrong = Occluder(np.full((3, 3), np.nan), np.array([[0, 1, 2]], dtype=np.int32))
    with pytest.raises(MeshError, match="occluder"):
        measure_front(sphere(), wrong, LINES)
    with pytest.raises(OptionError, match="length 1"):
        measure_front(sphere(), NOTHING, 2.0 * LINES)


@pytest.mark.sweep(2)
@pytest.mark.parametrize("viewers", ["all", "above"])
def test_a_report_tells_it_from_where_viewers_are(viewers):
    """A bowl that is open below, of which those above see nothing but what is closed."""
    bowl = box(without=[GROUND])
    judged = simplifier.evaluate(bowl, as_occluder(box()), views=32, viewers=viewers)
    report = judged.report()
    check_report(report)
    front = report["front"]
    found = measure_front(bowl, as_occluder(box()), judged.accuracy.directions)
    assert (front["share"], front["worst_view"]["share"]) == (found.mean, found.worst)
    assert front["worst_view"]["index"] == found.worst_view
    assert front["worst_view"]["direction"] == found.directions[found.worst_view].tolist()
    if viewers == "above":
        assert found.worst == 0.0
    else:
        assert 0.1 < found.mean < found.worst


def test_what_is_made_tells_it():
    made = simplifier.simplify(sphere(1.0), budget=24, resolution=16, preset="draft", views=16)
    measured = made.measure()
    front = measure_front(sphere(1.0), made.occluder, random_directions(16, 0))
    assert measured.report()["front"]["share"] == measured.front.mean == front.mean
    inside = simplifier.simplify(
        sphere(1.0), budget=24, resolution=16, preset="draft", conservative=True
    )
    assert inside.measure().front.worst == 0.0
