"""Small generated meshes whose inside, outside and best occluder are known."""

from __future__ import annotations

import numpy as np

from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder

CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.float64)
QUADS = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
)
"""Corners of the sides -x, +x, -y, +y, -z, +z of the unit cube, wound outwards."""


NOTHING = Occluder(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32))


def as_occluder(mesh):
    return Occluder(mesh.vertices, mesh.faces)


def moved(mesh, scale=1.0, offset=0.0):
    return TriangleMesh.from_soup(mesh.vertices * scale + offset, mesh.faces)


def turned(mesh, turn):
    """About the origin, by a matrix (3, 3)."""
    return TriangleMesh.from_soup(mesh.vertices @ turn.T, mesh.faces)


def interior_of(touched, filled):
    """What is inside without touching the surface, of two solids of one grid."""
    return filled.with_inside(filled.inside & ~touched.inside)


def random_soup(seed, count, spread):
    """Triangles about random places of the unit cube, their corners so far away in the mean."""
    random = np.random.default_rng(seed)
    corners = random.random((count, 1, 3)) + random.normal(0.0, spread, (count, 3, 3))
    return as_soup(corners)


def triangles_of(quads):
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def box(extent=(1.0, 1.0, 1.0), low=(0.0, 0.0, 0.0), *, without=()):
    """A box of 12 triangles less the sides ``without`` (0 to 5: -x, +x, -y, +y, -z, +z)."""
    sides = [side for side in range(6) if side not in without]
    return TriangleMesh.from_soup(CORNERS * extent + low, triangles_of(QUADS[sides]))


def rubble(count, low, high, size, *, seed):
    """(count, 3, 3) small triangles of any direction that begin in a box."""
    generator = np.random.default_rng(seed)
    places = generator.uniform(low, high, (count, 1, 3))
    return places + generator.uniform(0.0, size, (count, 3, 3))


def as_soup(triangles):
    """A mesh of triangles (m, 3, 3) that share no corner."""
    faces = np.arange(3 * len(triangles)).reshape(-1, 3)
    return TriangleMesh.from_soup(triangles.reshape(-1, 3), faces)


def town(pieces=10_000):
    """A ground with a shallow hollow in its middle, which is full of ``pieces`` of all directions.

    The ground is ten of all triangles and nearly all of the surface.
    """
    full = as_soup(rubble(pieces, (940.0, 0.0, 940.0), (1060.0, 14.4, 1060.0), 3.0, seed=1))
    floor = box((120.0, 0.0, 120.0), (940.0, -4.0, 940.0), without=(0, 1, 2, 4, 5))
    edge = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    around = np.concatenate([2000.0 * edge, 940.0 + 120.0 * edge])
    here, there = np.arange(4), np.roll(np.arange(4), -1)
    quads = np.stack([here, here + 4, there + 4, there], axis=1)
    ring = TriangleMesh.from_soup(np.insert(around, 1, 0.0, axis=1), triangles_of(quads))
    return joined(full, ring, floor)


def sphere(radius=1.0, rings=16):
    """A closed sphere of latitudes and longitudes around the origin."""
    around = 2 * rings
    latitude = np.pi * np.arange(rings + 1) / rings
    longitude = 2.0 * np.pi * np.arange(around) / around
    ring, turn = np.meshgrid(latitude, longitude, indexing="ij")
    points = np.stack(
        [np.sin(ring) * np.cos(turn), np.cos(ring), np.sin(ring) * np.sin(turn)], axis=-1
    )
    i, j = np.meshgrid(np.arange(rings), np.arange(around), indexing="ij")
    i, j, k = i.ravel(), j.ravel(), (j.ravel() + 1) % around
    quads = np.stack(
        [i * around + j, i * around + k, (i + 1) * around + k, (i + 1) * around + j], axis=1
    )
    points, faces = radius * points.reshape(-1, 3), triangles_of(quads)
    # At a pole one of a quad's two triangles has no area.
    first, second = (points[faces[:, k]] - points[faces[:, 0]] for k in (1, 2))
    area = np.linalg.norm(np.cross(first, second), axis=1)
    return TriangleMesh.from_soup(points, faces[area > 1e-12 * radius**2])


def rounded_box(extent=(1.0, 0.6, 0.8), rings=40):
    """A sphere that is cut flat on six sides, its edges round."""
    ball = sphere(rings=rings)
    return TriangleMesh.from_soup(np.clip(1.6 * ball.vertices, -1.0, 1.0) * extent, ball.faces)


def torus(ring=1.0, tube=0.45, around=32, across=16):
    """A closed torus about the y axis."""
    roll = 2.0 * np.pi * np.arange(across) / across
    return _turned_about_y(ring + tube * np.cos(roll), tube * np.sin(roll), around)


def pipe(radius=0.5, wall=0.05, length=2.0, around=96):
    """A pipe along the y axis, open at both ends."""
    inner = radius - wall
    return _turned_about_y(
        np.array([inner, radius, radius, inner]), length * np.array([0.0, 0.0, 1.0, 1.0]), around
    )


def _turned_about_y(away, height, around):
    """A closed outline, counter-clockwise: (n,) from the axis and (n,) along it."""
    across = len(away)
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    turn = 2.0 * np.pi * i / around
    points = np.stack([away[j] * np.cos(turn), height[j], away[j] * np.sin(turn)], axis=-1)
    k, m = (i + 1) % around, (j + 1) % across
    quads = [i * across + j, i * across + m, k * across + m, k * across + j]
    return TriangleMesh.from_soup(
        points.reshape(-1, 3), triangles_of(np.stack(quads, axis=-1).reshape(-1, 4))
    )


def blob(seed=0, rings=20):
    """A closed sphere with bumps and hollows: neither convex nor smooth in the grid."""
    ball = sphere(rings=rings)
    waves = np.random.default_rng(seed).normal(size=(6, 3)) * 2.5
    bumps = np.sin(ball.vertices @ waves.T).sum(axis=1)
    return TriangleMesh.from_soup(ball.vertices * (1.0 + 0.09 * bumps[:, None]), ball.faces)


def hills(side=41):
    """An open sheet of so many vertices a side, of which planar sections show next to nothing."""
    x, y = _square(side)
    z = 0.06 * (np.sin(7.0 * x + 2.0 * y) + np.sin(9.0 * y - 4.0 * x) + 0.4 * np.cos(23.0 * x * y))
    return _height_field(x, y, z)


def waves(side=51):
    """An open sheet of so many vertices a side, with four waves each way, as of eggs in a box."""
    x, y = _square(side)
    return _height_field(x, y, 0.018 * (np.sin(25.0 * x) + np.sin(25.0 * y)))


def _square(side):
    return np.meshgrid(*[np.linspace(0.0, 1.0, side)] * 2, indexing="ij")


def _height_field(x, y, z):
    """Of places (side, side)."""
    side = len(x)
    place = np.arange(side**2).reshape(side, side)
    squares = np.stack([place[:-1, :-1], place[1:, :-1], place[1:, 1:], place[:-1, 1:]], axis=-1)
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    return TriangleMesh.from_soup(points, triangles_of(squares.reshape(-1, 4)))


def flower(corners=400):
    """A flat sheet with seven petals, whose outline has so many corners."""
    turns = np.linspace(0.0, 2.0 * np.pi, corners, endpoint=False)
    far = 1.0 + 0.3 * np.cos(7.0 * turns)
    rim = np.stack([far * np.cos(turns), far * np.sin(turns), np.zeros(corners)], axis=1)
    one = np.arange(corners)
    faces = np.stack([np.full(corners, corners), one, (one + 1) % corners], axis=1)
    return TriangleMesh.from_soup(np.concatenate([rim, np.zeros((1, 3))]), faces)


def joined(*meshes):
    """All triangles in one mesh."""
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    return TriangleMesh.from_soup(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]),
    )


def bar(begin, end, thick=0.05):
    """From one place (3,) to another, of a square section."""
    begin, along = np.array(begin, float), np.subtract(end, begin)
    length = np.linalg.norm(along)
    aside = np.cross(along, (0.3, 1.0, 0.2))
    aside /= np.linalg.norm(aside)
    axes = np.array([aside, np.cross(along / length, aside), along / length])
    mesh = box((thick, thick, length), low=(-0.5 * thick, -0.5 * thick, 0.0))
    return TriangleMesh.from_soup(mesh.vertices @ axes + begin, mesh.faces)


def truss(panels=4):
    """A row of squares of bars, each with one across."""
    corners = ((0, 0, 1, 0), (0, 1, 1, 1), (0, 0, 0, 1), (0, 0, 1, 1))
    return joined(
        *(bar((i + a, 0, b), (i + c, 0, d)) for i in range(panels) for a, b, c, d in corners)
    )


def ladder(rungs=14):
    """Upright bars, and rungs between them."""
    high = 0.3 * rungs
    return joined(
        *(box((0.05, 0.05, high), low=(x, 0.0, 0.0)) for x in (0.0, 0.5)),
        *(box((0.5, 0.05, 0.05), low=(0.0, 0.0, 0.3 * rung)) for rung in range(rungs)),
    )


def table():
    """A top on four legs: parts that touch, thin from most sides."""
    legs = [box((0.1, 0.7, 0.1), (x, 0.0, z)) for x in (0.0, 1.4) for z in (0.0, 0.7)]
    return joined(box((1.5, 0.1, 0.8), (0.0, 0.7, 0.0)), *legs)
