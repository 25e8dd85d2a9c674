"""Edge collapse beside a plain one that looks at every edge in every step."""

from __future__ import annotations

from collections import Counter
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.room import Room
from simplifier.kernels import decimate as decimation
from simplifier.kernels.decimate import decimate, mark_outline
from simplifier.kernels.voxelize import is_contained
from tests.solids import sphere

SIZE = 12  # voxels a side
EVEN, CLOSE = (1e-3, 1e-3), (1e-6, 1e-5)  # pull to the middle, and cost of an edge
FREE = None, 0.0  # vertices of a firm border, and how firm it is


def collapsed(points, faces, allowed, budget, manner=EVEN, firm=FREE):
    """The corners of what is left, as a sorted array (k, 3, 3)."""
    points, faces, alive = points.copy(), faces.copy(), np.zeros(len(faces), np.bool_)
    outline = np.zeros(len(points), np.bool_) if firm[0] is None else firm[0]
    decimate(points, faces, Room.of(allowed).voxels, budget, alive, *manner, outline, firm[1])
    assert np.count_nonzero(alive) <= max(budget, 0)
    kept = np.sort(faces[alive], axis=1)
    assert (np.diff(kept, axis=1) > 0).all()
    assert len(np.unique(kept, axis=0)) == len(kept)
    return points, faces[alive]


def plane(normal, point):
    row = np.append(normal, -normal @ point)
    return np.outer(row, row)


def plain_quadrics(points, faces, firm):
    outline, firmness = firm
    quadrics = np.zeros((len(points), 4, 4))
    for face in faces:
        p, q, r = points[face]
        normal = np.cross(q - p, r - p)
        area = np.linalg.norm(normal) / 2.0
        if area == 0.0:
            continue
        normal /= 2.0 * area
        quadrics[face] += area * plane(normal, p)
        for a, b in combinations(face, 2):
            if sum({a, b} <= set(other) for other in faces.tolist()) > 1:
                continue
            edge = points[b] - points[a]
            across = np.cross(edge, normal)
            across /= np.linalg.norm(across)
            quadrics[[a, b]] += decimation._BORDER * (edge @ edge) * plane(across, points[a])
            if outline[a] and outline[b]:
                length = np.linalg.norm(edge)
                aside = np.cross(edge, across) / length
                line = plane(across, points[a]) + plane(aside, points[a])
                quadrics[[a, b]] += firmness * length * line
    return quadrics


def contained(corners, allowed):
    return is_contained(*map(tuple, corners), Room.of(allowed).voxels)


def plain_place(points, quadrics, u, v, manner):
    quadric, middle = quadrics[u] + quadrics[v], (points[u] + points[v]) / 2.0
    squared = ((points[u] - points[v]) ** 2).sum()
    for to_middle in (manner[0], decimation._FIRMLY):
        pull = to_middle * np.trace(quadric[:3, :3]) + 1e-30
        place = np.linalg.solve(
            quadric[:3, :3] + pull * np.eye(3), pull * middle - quadric[:3, 3]
        )  # fmt: skip
        if ((place - middle) ** 2).sum() <= squared:
            break
    full = np.append(place, 1.0)
    return max(full @ quadric @ full, 0.0) + manner[1] * squared, place


def plain_weight(points, faces, u, v, place, allowed):
    folds = leaves = False
    for moved, partner in ((u, v), (v, u)):
        for face in faces:
            if moved in face and partner not in face:
                q, r = (points[i] for i in sorted(face - {moved}))
                before = np.cross(q - points[moved], r - points[moved])
                folds |= bool(before @ np.cross(q - place, r - place) < 0.0)
                leaves |= not contained((place, q, r), allowed)
    return (decimation._FOLDED if folds else 1.0) * (decimation._LEAVES if leaves else 1.0)


def plain_decimate(points, faces, allowed, budget, manner, firm):
    points, quadrics = points.copy(), plain_quadrics(points, faces, firm)
    faces = {frozenset(face) for face in faces.tolist()}
    costs = {}  # of each edge, and whether its faces were looked at
    while len(faces) > budget:
        edges = {frozenset(edge) for face in faces for edge in combinations(face, 2)}
        costs = {edge: costs[edge] for edge in edges & costs.keys()}
        for edge in edges - costs.keys():
            costs[edge] = (plain_place(points, quadrics, *edge, manner)[0], False)
        edge = min(costs, key=lambda edge: costs[edge][0])
        u, v = edge
        place = plain_place(points, quadrics, u, v, manner)[1]
        cost, weighed = costs[edge]
        times = 1.0 if weighed else plain_weight(points, faces, u, v, place, allowed)
        if times > 1.0:
            costs[edge] = (cost * times, True)
            continue
        faces = {face - {u} | {v} if u in face else face for face in faces}
        faces = {face for face in faces if len(face) == 3}
        points[v] = place
        quadrics[v] += quadrics[u]
        costs = {other: costs[other] for other in costs if not other & edge}
    return points, faces


def outlines(points, faces):
    """Triangles as sorted corners, whatever the numbers of their vertices."""
    corners = [sorted(points[list(face)].round(6).tolist()) for face in faces]
    return np.array(sorted(corners)).reshape(-1, 3, 3)


@st.composite
def soups(draw):
    """Points in general position, so that no two edges cost the same; faces at random."""
    count = draw(st.integers(4, 14))
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    points = random.uniform(2.0, SIZE - 2.0, (count, 3))
    triples = np.array(list(combinations(range(count), 3)), dtype=np.int32)
    chosen = random.permutation(len(triples))[: draw(st.integers(1, 20))]
    return points, np.ascontiguousarray(triples[chosen])


@settings(max_examples=60)
@given(
    soups(), st.integers(0, 12), st.integers(0, 3), st.sampled_from([EVEN, CLOSE]),
    st.sampled_from([0.0, 30.0, 900.0]),
)  # fmt: skip
def test_as_the_plain_one(soup, budget, closed, manner, firmness):
    points, faces = soup
    allowed = np.ones((SIZE,) * 3, np.bool_)
    allowed[: 3 * closed] = False
    firm = np.arange(len(points)) % 3 > 0, firmness
    assert np.allclose(
        outlines(*collapsed(points, faces, allowed, budget, manner, firm)),
        outlines(*plain_decimate(points, faces, allowed, budget, manner, firm)),
        atol=2e-5,
    )


def plain_outline(points, faces):
    """By walking from vertex to vertex along edges that one face alone has."""
    area = sum(np.linalg.norm(np.cross(q - p, r - p)) / 2.0 for p, q, r in points[faces])
    count = Counter(frozenset(edge) for face in faces.tolist() for edge in combinations(face, 2))
    border = [tuple(edge) for edge, times in count.items() if times == 1]
    outline, waiting = np.zeros(len(points), np.bool_), set(range(len(points)))
    while waiting:
        reached = [waiting.pop()]
        for vertex in reached:
            for other in {b for edge in border if vertex in edge for b in edge} & waiting:
                waiting.remove(other)
                reached.append(other)
        length = sum(np.linalg.norm(points[a] - points[b]) for a, b in border if a in reached)
        outline[reached] = length**2 > 4.0 * area
    return outline


def marked(points, faces):
    outline = np.empty(len(points), np.bool_)
    mark_outline(points, np.ascontiguousarray(faces), outline)
    return outline


@settings(max_examples=60)
@given(soups())
def test_outlines_as_the_plain_ones(soup):
    assert np.array_equal(marked(*soup), plain_outline(*soup))


def net(rows, columns):
    """A level sheet of unit squares in two triangles each, and which vertices are on its edge."""
    points = np.array(list(np.ndindex(rows, columns, 1)), dtype=np.float64)
    place = np.arange(len(points), dtype=np.int32).reshape(rows, columns)
    p, q, r, s = (
        part.ravel() for part in (place[:-1, :-1], place[1:, :-1], place[1:, 1:], place[:-1, 1:])
    )
    faces = np.concatenate([np.stack([p, q, r], axis=1), np.stack([p, r, s], axis=1)])
    around = np.ones((rows, columns), np.bool_)
    around[1:-1, 1:-1] = False
    return points, faces, around.ravel()


def test_an_outline_is_around_all_of_it():
    points, faces, around = net(9, 9)
    assert np.array_equal(marked(points, faces), around)
    whole = np.delete(faces, [36, 100], axis=0)  # a hole, whose border is short
    assert np.array_equal(marked(points, whole), around)
    ball = sphere(3.0, rings=10)
    points, place = np.unique(ball.vertices.round(6), axis=0, return_inverse=True)
    faces = place.reshape(-1)[ball.faces].astype(np.int32)
    assert not marked(points, faces).any()
    assert not marked(points, faces[8:]).any()


def test_an_outline_that_is_firm_stays():
    """A sheet of small squares in waves; firm, few triangles have the square that it is above."""
    points, faces, around = net(41, 41)
    points = points / 4.0 + 1.0
    points[:, 2] += 0.3 * np.sin(points[:, 0]) + 0.4 * np.cos(1.7 * points[:, 1])
    allowed = np.ones((SIZE,) * 3, np.bool_)

    def off(firmness):
        """The area that is lost or added, of a hundred."""
        left, corners = collapsed(points, faces, allowed, 24, CLOSE, (around, firmness))
        seen = left[corners][:, :, :2]
        lost = 100.0 - np.abs(np.linalg.det(seen[:, 1:] - seen[:, :1])).sum() / 2.0
        beside = ((seen < 0.9) | (seen > 11.1)).any()
        return np.inf if beside else abs(lost)

    assert off(300.0) < 0.2 < 0.5 < off(0.0)


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(1, 400), st.integers(0, 40))
def test_any_soup_comes_down_to_any_budget(seed, count, budget):
    """On a lattice: ties, needles without area, and many faces at an edge."""
    random = np.random.default_rng(seed)
    points = np.array(list(np.ndindex(4, 4, 4)), dtype=np.float64) * 3.0 + 1.0
    triples = np.unique(np.sort(random.integers(0, 64, (count, 3)), axis=1), axis=0)
    faces = triples[(np.diff(triples, axis=1) > 0).all(axis=1)].astype(np.int32)
    allowed = np.ones((SIZE,) * 3, np.bool_)
    moved, left = collapsed(points, faces, allowed, budget)
    assert np.isfinite(moved).all()
    again = collapsed(points, faces, allowed, budget)
    assert np.array_equal(moved, again[0])
    assert np.array_equal(left, again[1])


def test_sphere_stays_a_sphere():
    ball = sphere(5.0, rings=16)
    allowed = np.ones((16,) * 3, np.bool_)
    points, faces = collapsed(ball.vertices + 8.0, ball.faces.copy(), allowed, 64)
    radii = np.linalg.norm(points[np.unique(faces)] - 8.0, axis=1)
    assert len(faces) >= 60
    assert 4.8 < radii.min() <= radii.max() < 5.6


def test_flat_square_needs_two_triangles_and_keeps_its_corners():
    lattice, faces, _ = net(6, 6)
    allowed = np.ones((SIZE,) * 3, np.bool_)
    points, faces = collapsed(lattice + 3.0, faces, allowed, 2)
    corners = points[np.unique(faces)]
    assert len(faces) == 2
    assert np.allclose(corners.min(axis=0), 3.0, atol=0.1)
    assert np.allclose(corners.max(axis=0), [8.0, 8.0, 3.0], atol=0.1)


def test_small_component_goes_first():
    large, small = sphere(5.0, rings=6), sphere(0.5, rings=6)
    points = np.concatenate([large.vertices + 7.0, small.vertices + 1.0])
    faces = np.concatenate([large.faces, small.faces + np.int32(len(large.vertices))])
    points, faces = collapsed(points, faces, np.ones((16,) * 3, np.bool_), len(large.faces) // 2)
    left = points[np.unique(faces)]
    assert np.linalg.norm(left - 1.0, axis=1).min() > 2.0


@pytest.mark.parametrize("gap", [False, True])
def test_faces_keep_to_the_allowed_voxels_where_they_can(gap):
    """A ring in the plane: its hole is bridged where nothing forbids it."""
    turns = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    circle = np.stack([np.cos(turns), np.sin(turns), np.full(24, 0.0)], axis=1)
    points = np.concatenate([3.0 * circle, 5.0 * circle]) + np.array([6.0, 6.0, 6.5])
    i, j = np.arange(24), (np.arange(24) + 1) % 24
    faces = np.concatenate(
        [np.stack([i, j, i + 24], axis=1), np.stack([j, j + 24, i + 24], axis=1)]
    ).astype(np.int32)
    allowed = np.ones((SIZE,) * 3, np.bool_)
    if gap:
        allowed[5:7, 5:7] = False
    points, faces = collapsed(points, faces, allowed, 12)
    assert len(faces) >= 8
    if gap:
        assert all(contained(points[face], allowed) for face in faces)
