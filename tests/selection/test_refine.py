"""Refinement: stays inside, never gets worse, and its bookkeeping is that of a fresh drawing."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.deadline import Deadline
from simplifier.geometry.views import hemisphere_directions, image_axes
from simplifier.kernels.coverage import covered
from simplifier.kernels.refinement import BLOCK, TRIES, draw_all
from simplifier.kernels.voxels import contained, mark_triangles
from simplifier.options import RefineOptions
from simplifier.selection.measure import search_projections
from simplifier.selection.refine import RefineViews, _by_time, pulled_in, refine

SIZE = 24  # voxels a side


def ball(radius=9.0):
    """A ball of voxels in the middle of the grid."""
    centres = np.indices((SIZE,) * 3) + 0.5 - SIZE / 2
    return np.ascontiguousarray((centres**2).sum(axis=0) < radius**2)


def views_of(voxels, count=16):
    """Search views whose originals are the pictures of the solid's voxel centres, as a sphere."""
    projections = search_projections(
        image_axes(hemisphere_directions(count)), np.full(3, SIZE / 2), SIZE / 2
    )
    rng = np.random.default_rng(5)
    points = rng.normal(size=(4000, 3))
    radius = np.cbrt(3.0 * voxels.sum() / (4.0 * np.pi))
    points = SIZE / 2 + radius * points / np.linalg.norm(points, axis=1, keepdims=True)
    faces = np.array([[i, i + 1, i + 2] for i in range(0, 3999, 3)], dtype=np.int32)
    return RefineViews(projections, covered(points, faces, projections, 64, 64)[:, :, 0].copy())


def crossed_quads(half=4.0):
    """Three squares through the centre: 6 triangles, 12 vertices."""
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * half
    vertices, faces = [], []
    for axis in range(3):
        faces += [[4 * axis, 4 * axis + 1, 4 * axis + 2], [4 * axis, 4 * axis + 2, 4 * axis + 3]]
        vertices.append(np.insert(square, axis, 0.0, axis=1) + SIZE / 2 + 0.25)
    return np.concatenate(vertices), np.array(faces, dtype=np.int32)


def score(vertices, faces, views, overcover):
    """The objective, drawn afresh."""
    count = len(views.projections)
    images = np.zeros((len(faces), count, 64), np.uint64)
    blocks = np.zeros((-(-len(faces) // BLOCK), count, 64), np.uint64)
    scores = np.zeros(count, np.int64)
    return draw_all(
        np.ascontiguousarray(vertices), faces, views.projections, views.originals,
        round(2 * overcover), images, blocks, scores,
    )  # fmt: skip


def voxels_touched(vertices, faces):
    """The voxels that the faces touch, by the voxelizer."""
    touched = np.zeros((SIZE,) * 3, dtype=np.bool_)
    mark_triangles(vertices, faces, np.zeros(3), 1.0, 0, len(faces), touched)
    return touched


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_it_raises_the_score_and_touches_allowed_voxels_only(seed):
    allowed = ball()
    views = views_of(allowed)
    vertices, faces = crossed_quads()
    options = RefineOptions(moves=3000, searches=2, overcover=8.0)
    before = score(vertices, faces, views, options.overcover)
    refined, kept = refine(vertices, faces, allowed, views, options, seed)
    assert np.array_equal(kept, faces)
    assert score(refined, kept, views, options.overcover) > 1.3 * before
    assert not (voxels_touched(refined, kept) & ~allowed).any()


def test_it_never_ends_below_its_start():
    allowed = ball()
    views = views_of(allowed)
    vertices, faces = crossed_quads()
    for moves in (6, 60, 600):
        options = RefineOptions(moves=moves, searches=1, overcover=8.0)
        refined, kept = refine(vertices, faces, allowed, views, options, 7)
        assert score(refined, kept, views, 8.0) >= score(vertices, faces, views, 8.0)


def test_no_move_leaves_it_as_it_is():
    vertices, faces = crossed_quads()
    allowed = ball()
    same, kept = refine(vertices, faces, allowed, views_of(allowed), RefineOptions(moves=0), 0)
    assert np.array_equal(same, vertices)
    assert np.array_equal(kept, faces)


def test_same_on_any_number_of_threads(monkeypatch):
    allowed = ball()
    views = views_of(allowed)
    vertices, faces = crossed_quads()
    results = []
    for threads in ("1", "2", "5"):
        monkeypatch.setenv("OCCLUDER_THREADS", threads)
        options = RefineOptions(moves=1200, searches=3)
        results.append(refine(vertices, faces, allowed, views, options, 3)[0].tobytes())
    assert len(set(results)) == 1


def test_it_can_be_stopped_and_tells_how_far_it_is():
    allowed = ball()
    vertices, faces = crossed_quads()
    views, options = views_of(allowed), RefineOptions(moves=6000)
    shares, scores = [], []

    def stop(share, best):
        shares.append(share)
        scores.append(best)
        return len(shares) == 3

    refined, kept = refine(vertices, faces, allowed, views, options, 0, stop)
    assert len(shares) == 3
    assert shares == sorted(shares)
    assert shares[-1] < 0.5
    assert scores == sorted(scores)
    assert scores[-1] == score(refined, kept, views, options.overcover)


class StepClock:
    """Goes on by a step whenever it is looked at, so that a slice never seems too short."""

    def __init__(self, step):
        self.now, self._step = 0.0, step

    def __call__(self):
        self.now += self._step
        return self.now


def test_a_deadline_takes_the_place_of_the_moves():
    allowed = ball()
    vertices, faces = crossed_quads()
    views = views_of(allowed)
    clock, shares = StepClock(0.006), []

    def stop(share, best):
        shares.append(share)
        return False

    deadline = Deadline.after(1.0, clock)
    for moves in (6, 100_000_000):
        options = RefineOptions(moves=moves, searches=1, overcover=8.0)
        refined, kept = refine(vertices, faces, allowed, views, options, 0, stop, deadline)
        assert 1.0 <= clock.now < 1.04
        assert shares == sorted(shares)
        assert len(shares) > 30
        assert shares[-1] == 1.0
        assert score(refined, kept, views, 8.0) > 1.1 * score(vertices, faces, views, 8.0)
        clock.now, shares = 0.0, []


def test_a_deadline_that_is_up_leaves_it_as_it_is():
    allowed = ball()
    vertices, faces = crossed_quads()
    deadline = Deadline.after(0.0)
    options = RefineOptions(moves=600)
    same, _ = refine(vertices, faces, allowed, views_of(allowed), options, 0, deadline=deadline)
    assert np.array_equal(same, vertices)


@pytest.mark.parametrize("cost", [1e-6, 3e-4, 2e-2])
def test_slices_fit_what_a_move_costs(cost):
    clock = StepClock(0.0)
    made = []
    for moves, (first, last) in _by_time(Deadline.after(2.0, clock)):
        assert moves % TRIES == 0
        assert 0.0 <= first < last <= 1.0
        clock.now += moves * cost
        made.append(moves)
    aim = 0.02
    assert max(made) * cost <= 2.0 * max(aim, TRIES * cost)
    assert made[-1] * cost >= min(0.5 * aim, TRIES * cost)
    assert clock.now <= 2.0 + max(aim, TRIES * cost)


def test_faces_outside_are_pulled_in_or_left_out():
    allowed = ball()
    vertices, faces = crossed_quads(half=9.0)  # the corners stick out
    far = np.concatenate([vertices, [[1.0, 1.0, 1.0], [2.0, 1.0, 1.0], [1.0, 2.0, 1.0]]])
    extra = np.concatenate([faces, [[12, 13, 14]]]).astype(np.int32)
    inside, kept = pulled_in(far, extra, allowed)
    assert len(kept) == len(faces)
    assert kept.max() == len(inside) - 1
    assert not (voxels_touched(inside, kept) & ~allowed).any()


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32), st.floats(0.3, 12.0))
def test_containment_is_that_of_the_voxelizer(seed, size):
    rng = np.random.default_rng(seed)
    voxels = rng.random((SIZE,) * 3) < 0.9
    triangle = rng.uniform(size, SIZE - size, 3) + rng.uniform(-size, size, (3, 3))
    corners = [tuple(corner) for corner in triangle.tolist()]
    touched = voxels_touched(triangle, np.array([[0, 1, 2]], dtype=np.int32))
    strays = (triangle.min() <= 0.0) or (triangle.max() >= SIZE)
    expected = not strays and not (touched & ~voxels).any()
    assert contained(*corners, voxels) == expected
