"""Corners fitted into a room, beside plain loops, to the last bit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.meshes import lattice_faces
from simplifier.geometry.room import Room
from simplifier.kernels.fitting import _DEEP, _PARTS, fit
from simplifier.refinement.containment import are_inside
from simplifier.refinement.fields import depths_in

SIDE = 12  # cells of the room
STEPS = np.array([0.5, 1.0, 0.25])


def bent(random, height=2.0):
    """A room of a bent layer, some cells thick, and its depth."""
    x, y, z = np.indices((SIDE,) * 3)
    a, b = random.uniform(-1.0, 1.0, 2)
    middle = SIDE / 2 + height * (np.sin(a * x / 2.0) + np.cos(b * y / 2.0)) / 2.0
    cells = np.abs(z - middle) <= random.uniform(1.0, 2.5)
    cells[[0, -1]] = cells[:, [0, -1]] = False
    return Room.of(cells), depths_in(cells)


def sheet(random, side=3):
    """A grid of triangles across it: vertices (n, 3) and faces (m, 3) int32."""
    along = np.linspace(1.5, SIDE - 1.5, side + 1)
    x, y = np.meshgrid(along, along, indexing="ij")
    points = np.stack([x, y, random.normal(SIDE / 2, 0.7, x.shape)], axis=-1).reshape(-1, 3)
    return points, random.permutation(lattice_faces(side))


def shallowness(triangle, depth, size):
    total = 0.0
    for i in range(_PARTS + 1):
        for j in range(_PARTS + 1 - i):
            u, v = i / _PARTS, j / _PARTS
            w = 1.0 - u - v
            cell = tuple(
                min(max(int((u * p + v * q + w * r) / size), 0), count - 1)
                for p, q, r, count in zip(*triangle.tolist(), depth.shape, strict=True)
            )
            total += max(_DEEP - float(depth[cell]), 0.0) ** 2
    return total


def normal(triangles):
    total = np.zeros(3)
    for p, q, r in triangles:
        for axis in range(3):
            i, j = (axis + 1) % 3, (axis + 2) % 3
            total[axis] += (q[i] - p[i]) * (r[j] - p[j]) - (q[j] - p[j]) * (r[i] - p[i])
    length = np.sqrt(total[0] ** 2 + total[1] ** 2 + total[2] ** 2)
    return total / length if length > 0.0 else total


def fitted(points, faces, room, depth, size, steps, turns):
    """What the kernel does, slowly."""
    least, most = 1e-6, np.array(room.shape) - 1e-6
    points = np.minimum(np.maximum(points, least), most)

    def state(star):
        triangles = points[faces[star]]
        lacks = [shallowness(one, depth, size) for one in triangles]
        return int(are_inside(triangles, room).sum()), sum(lacks, 0.0)

    for step in steps:
        for _ in range(turns):
            if are_inside(points[faces], room).all():
                return points
            for point in range(len(points)):
                star = np.flatnonzero((faces == point).any(axis=1))
                if are_inside(points[faces[star]], room).all():
                    continue
                up = normal(points[faces[star]])
                ways = [up, -up]
                for axis in np.eye(3):
                    ways += [axis, -axis]
                for way in ways:
                    inside, lack = state(star)
                    before = points[point].copy()
                    there = before + step * way
                    points[point] = np.minimum(np.maximum(there, least), most)
                    after, less = state(star)
                    if not (after > inside or (after == inside and less < lack - 1e-9)):
                        points[point] = before
    return points


@given(seed=st.integers(0, 10_000), size=st.sampled_from([1.0, 2.0]), turns=st.integers(0, 2))
def test_it_is_what_plain_loops_give(seed, size, turns):
    random = np.random.default_rng(seed)
    room, depth = bent(random)
    points, faces = sheet(random)
    points[0] = -1.0, SIDE + 3.0, SIDE / 2
    found = points.copy()
    fit(found, faces, room.voxels, depth, size, STEPS, turns)
    assert np.array_equal(found, fitted(points, faces, room, depth, size, STEPS, turns))


@given(seed=st.integers(0, 10_000))
def test_no_fewer_are_inside_and_all_stay_in_the_grid(seed):
    random = np.random.default_rng(seed)
    room, depth = bent(random, height=5.0)
    points, faces = sheet(random, side=5)
    points += random.normal(0.0, 3.0, points.shape)
    found = points.copy()
    fit(found, faces, room.voxels, depth, 1.0, np.array([8.0, 1.0]), 2)
    assert are_inside(found[faces], room).sum() >= are_inside(points[faces], room).sum()
    assert (found > 0.0).all()
    assert (found < SIDE).all()


@pytest.mark.parametrize("count", [0, 1])
def test_points_without_faces_stay(count):
    room, depth = bent(np.random.default_rng(1))
    points = np.full((count, 3), 3.0)
    fit(points, np.empty((0, 3), dtype=np.int32), room.voxels, depth, 1.0, STEPS, 2)
    assert (points == 3.0).all()


def test_a_sheet_across_a_hollow_gets_in():
    """Chords of a hollow left the room, and were detached: a sheet with a hole hides next to
    nothing."""
    random = np.random.default_rng(3)
    room, depth = bent(random)
    points, faces = sheet(random)
    outside = len(faces) - int(are_inside(points[faces], room).sum())
    fit(points, faces, room.voxels, depth, 1.0, STEPS, 2)
    assert outside > 3
    assert are_inside(points[faces], room).all()
