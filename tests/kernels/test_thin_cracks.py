"""Cracks along T-junctions beside a plain search over all edges and vertices."""

from __future__ import annotations

from collections import Counter
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.kernels.thin import border_places, crack_triangles, whole_faces

CELLS = 12


def chosen_of(points):
    """The first vertex of each cell stands for all in it."""
    cells = points.astype(np.int64) @ [CELLS * CELLS, CELLS, 1]
    return np.unique(cells, return_inverse=True)[1].astype(np.int32)


def moved_of(faces, chosen):
    corners = chosen[faces]
    a, b, c = corners.T
    return np.ascontiguousarray(corners[(a != b) & (b != c) & (c != a)])


def border_of(faces, chosen):
    return border_places(moved_of(faces, chosen), chosen.max() + 1)


def cracks(points, faces):
    chosen = chosen_of(points)
    border = border_of(faces, chosen)
    if not border.any():
        return np.empty((0, 3), dtype=np.int32)
    numbers = np.zeros(3 * [CELLS], dtype=np.int32)
    numbers[tuple(points.astype(np.int32).T)] = chosen + 1
    step = 0.25  # a power of two: no bit is lost
    return crack_triangles(points * step, np.zeros(3), step, faces, chosen, numbers, border)


def lies_on(p, a, b):
    share = (p - a) @ (b - a) / ((b - a) @ (b - a))
    return 0.0 < share < 1.0 and np.linalg.norm(p - a - share * (b - a)) < 1e-3


@given(st.integers(0, 2**32 - 1), st.integers(1, 12), st.integers(1, 4))
def test_chains_hold_one_vertex_of_each_cell_that_an_edge_passes(seed, count, on_each):
    random = np.random.default_rng(seed)
    triangles = random.random((count, 3, 3)) * (CELLS - 0.01)
    triangles[0] = random.random((3, 3)) + np.diag([0, 11, 10])  # alone out there
    triangles = np.minimum(triangles, CELLS - 0.01)
    a, b = triangles[:, 0], triangles[:, 1]
    shares = random.random((count, on_each, 1))
    extra = (a[:, None] + shares * (b - a)[:, None]).reshape(-1, 3)
    spikes = np.concatenate([extra, extra + random.normal(size=extra.shape)])
    points = np.clip(np.concatenate([triangles.reshape(-1, 3), spikes]), 0.0, CELLS - 0.01)
    faces = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    # The vertices on the edges are corners of faces beyond, of spikes out of the edge.
    base = 3 * count + np.arange(len(extra), dtype=np.int32)
    faces = np.concatenate(
        [faces, np.stack([base, base + len(extra), np.roll(base, 1) + len(extra)], axis=1)]
    )
    cells = points.astype(np.int64)
    found = cracks(points, faces)
    chosen = chosen_of(points)
    border = border_of(faces, chosen)
    by_end = {}
    for before, on, end in found.tolist():
        assert chosen[on] != chosen[end]
        assert chosen[on] != chosen[before]
        by_end.setdefault(end, []).append((before, on))
    # All of an edge, from its lower end on: those of the first edge of each of the triangles.
    for index in range(count):
        begin, end = 3 * index, 3 * index + 1
        passed = {
            int(chosen[p])
            for p in range(len(points))
            if lies_on(points[p], points[begin], points[end])
        } - {int(chosen[begin]), int(chosen[end])}
        if not (border[chosen[begin]] and border[chosen[end]]):
            passed = set()  # of a face that vanished, so that nothing is parted from it
        on_edge = {
            int(chosen[on])
            for _, on in by_end.get(end, [])
            if lies_on(points[on], points[begin], points[end])
        }
        assert on_edge == passed, cells[[begin, end]]


def test_a_mesh_without_t_junctions_gets_no_triangle():
    steps = np.arange(10)
    points = np.stack([*np.meshgrid(steps, steps, indexing="ij"), np.zeros((10, 10))], axis=-1)
    points = points.reshape(-1, 3) * 1.1 + 0.05
    corner = (steps[:-1, None] * 10 + steps[:-1]).reshape(-1)
    quads = np.stack([corner, corner + 10, corner + 11, corner + 1], axis=1)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.int32)
    assert len(cracks(points, faces)) == 0
    assert cracks(points, faces).dtype == np.int32


def test_nothing_is_left_of_nothing():
    points = np.full((3, 3), 0.5)
    faces = np.array([[0, 1, 2]], dtype=np.int32)
    assert cracks(points, faces).shape == (0, 3)


def test_a_slit_is_filled_from_one_end_to_the_other():
    # One triangle below a long edge, three above it that meet its inside at two vertices.
    points = np.array(
        [[0.5, 2.5, 0.5], [9.5, 2.5, 0.5], [5.0, 0.5, 0.5], [3.5, 2.5, 0.5], [6.5, 2.5, 0.5],
         [5.0, 5.5, 0.5]]
    )  # fmt: skip
    faces = np.array([[0, 1, 2], [0, 3, 5], [3, 4, 5], [4, 1, 5]], dtype=np.int32)
    assert cracks(points, faces).tolist() == [[0, 3, 1], [3, 4, 1]]


@pytest.mark.parametrize(("off", "count"), [(0.0, 1), (5e-4, 1), (5e-3, 0)])
def test_a_vertex_lies_on_an_edge_within_a_thousandth_of_a_cell(off, count):
    points = np.array([
        [0.5, 0.5, 0.5], [8.5, 0.5, 0.5], [4.5, 8.5, 0.5], [4.5, 0.5 + off, 0.5], [2.5, 0.5, 8.5],
    ])  # fmt: skip
    faces = np.array([[0, 1, 2], [0, 3, 4]], dtype=np.int32)
    assert len(cracks(points, faces)) == count


@given(st.integers(0, 2**32 - 1), st.integers(1, 60), st.integers(3, 12), st.booleans())
def test_a_border_is_where_one_face_alone_has_an_edge(seed, count, places, sides_as_one):
    faces = np.random.default_rng(seed).integers(0, places, (count, 3)).astype(np.int32)
    faces = faces[[len(set(face)) == 3 for face in faces.tolist()]]
    counted = [frozenset(face) for face in faces.tolist()]
    if sides_as_one:
        counted = list(set(counted))
    uses = Counter(edge for face in counted for edge in combinations(sorted(face), 2))
    expected = {place for edge, count in uses.items() if count == 1 for place in edge}
    found = border_places(faces, places, sides_as_one=sides_as_one)
    assert set(np.flatnonzero(found).tolist()) == expected


@pytest.mark.parametrize("count", [1, 1 << 16, 3 << 16])
def test_faces_stay_in_order_on_any_number_of_threads(count):
    generator = np.random.default_rng(count)
    faces = generator.integers(0, 99, (count, 3)).astype(np.int32)
    chosen = generator.integers(0, 40, 99).astype(np.int32)
    assert whole_faces(faces, chosen).tolist() == moved_of(faces, chosen).tolist()
