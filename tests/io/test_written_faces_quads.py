"""Quads of pairs of triangles: as many as there can be, flat and convex, and the same surface."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.geometry.occluder import Occluder
from simplifier.io.written_faces import quads_and_triangles
from tests.solids import box


def as_sets(faces: np.ndarray) -> set[frozenset[int]]:
    return {frozenset(face) for face in np.asarray(faces).tolist()}


def cut(quads: np.ndarray) -> np.ndarray:
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def grid(columns: int, rows: int, *, flips: np.ndarray | None = None) -> Occluder:
    """A flat sheet of cells, each cut along either diagonal and wound either way."""
    x, y = np.meshgrid(np.arange(columns + 1.0), np.arange(rows + 1.0))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    faces = []
    for row in range(rows):
        for column in range(columns):
            a = row * (columns + 1) + column
            b, c, d = a + 1, a + columns + 2, a + columns + 1
            faces += [(a, b, c), (a, c, d)]
    made = np.array(faces, dtype=np.int32)
    if flips is not None:
        made[flips] = made[flips][:, ::-1]
    return Occluder(points, made)


def test_a_box_is_six_quads() -> None:
    mesh = box((1, 2, 3))
    quads, rest = quads_and_triangles(Occluder(mesh.vertices, mesh.faces))
    assert (len(quads), len(rest)) == (6, 0)
    assert as_sets(cut(quads)) == as_sets(mesh.faces)


@given(st.integers(1, 4), st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_a_sheet_pairs_up_whole_whatever_the_winding(columns: int, rows: int, seed: int) -> None:
    flips = np.random.default_rng(seed).random(2 * columns * rows) < 0.5
    sheet = grid(columns, rows, flips=flips)
    quads, rest = quads_and_triangles(sheet)
    assert len(rest) == 0
    assert as_sets(cut(quads)) == as_sets(sheet.faces)


def test_single_sided_triangles_pair_by_winding_alone() -> None:
    flips = np.array([False, True])
    sheet = grid(1, 1, flips=flips)
    assert len(quads_and_triangles(sheet)[0]) == 1
    alone = Occluder(sheet.vertices, sheet.faces, single_sided=True)
    assert len(quads_and_triangles(alone)[0]) == 0
    doubled = Occluder(
        sheet.vertices, np.concatenate([sheet.faces, sheet.faces[:, ::-1]]), single_sided=True
    )
    quads, rest = quads_and_triangles(doubled)
    assert (len(quads), len(rest)) == (2, 0)


@pytest.mark.parametrize(("lift", "count"), [(0.0, 1), (1e-7, 1), (1e-5, 0), (0.5, 0)])
def test_only_what_is_flat(lift: float, count: int) -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, lift]])
    bent = Occluder(points, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32))
    assert len(quads_and_triangles(bent)[0]) == count


@pytest.mark.parametrize("fourth", [(0.9, 0.1, 0.0), (0.5, 0.5, 0.0), (2.0, 0.0, 0.0)])
def test_only_what_is_convex(fourth: tuple[float, float, float]) -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], fourth])
    made = Occluder(points, np.array([[0, 1, 2], [1, 2, 3]], dtype=np.int32))
    quads, rest = quads_and_triangles(made)
    assert (len(quads), len(rest)) == (0, 2)


def greatest(occluder: Occluder) -> int:
    """The most pairs, by trying all choices."""
    pairs = []
    for a, b in combinations(range(len(occluder.faces)), 2):
        two = Occluder(occluder.vertices, occluder.faces[[a, b]])
        if len(quads_and_triangles(two)[0]):
            pairs.append({a, b})
    best = 0
    for size in range(1, len(occluder.faces) // 2 + 1):
        for chosen in combinations(pairs, size):
            if len(set().union(*chosen)) == 2 * size:
                best = size
                break
    return best


@given(st.integers(0, 2**32 - 1))
def test_there_are_as_many_as_there_can_be(seed: int) -> None:
    random = np.random.default_rng(seed)
    sheet = grid(3, 2)
    kept = np.sort(random.permutation(len(sheet.faces))[:9])
    part = Occluder(sheet.vertices, sheet.faces[kept])
    quads, rest = quads_and_triangles(part)
    assert 2 * len(quads) + len(rest) == len(part.faces)
    assert len(quads) == greatest(part)
    assert as_sets(np.concatenate([cut(quads), rest])) == as_sets(part.faces)


def test_a_triangle_that_repeats_a_corner_was_a_traceback() -> None:
    sheet = grid(1, 1)
    faces = np.array([[0, 0, 1], *sheet.faces.tolist()], dtype=np.int32)
    quads, rest = quads_and_triangles(Occluder(sheet.vertices, faces))
    assert as_sets(cut(quads)) == as_sets(sheet.faces)
    assert rest.tolist() == [[0, 0, 1]]
