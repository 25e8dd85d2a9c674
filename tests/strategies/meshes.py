"""Triangle soups: each kind is one that has broken some mesh program, and any can be disturbed.

All are small, so that a failing one is read and thought through.  They are plain arrays: what
``TriangleMesh.from_soup`` makes of them is for the test to see.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.solids import box, joined, sphere, table, torus

Soup = tuple[NDArray[np.float64], NDArray[np.int64]]

_MOST = 24  # triangles of a random soup

seeds = st.integers(0, 2**32 - 1)


def random_soups(coordinates: st.SearchStrategy[float]) -> st.SearchStrategy[Soup]:
    """Triangles between any of a few points, crossing and sharing vertices as it happens."""

    def with_points(points: list[tuple[float, float, float]]) -> st.SearchStrategy[Soup]:
        corner = st.integers(0, len(points) - 1)
        faces = st.lists(st.tuples(corner, corner, corner), min_size=1, max_size=_MOST)
        return faces.map(lambda some: (np.array(points), np.array(some, dtype=np.int64)))

    points = st.lists(st.tuples(coordinates, coordinates, coordinates), min_size=3, max_size=_MOST)
    return points.flatmap(with_points)


def _from(make: Callable[[np.random.Generator], Soup]) -> st.SearchStrategy[Soup]:
    return seeds.map(lambda seed: make(np.random.default_rng(seed)))


def _arrays(mesh) -> Soup:
    return mesh.vertices.copy(), mesh.faces.astype(np.int64)


def _boxes(random: np.random.Generator) -> Soup:
    """Closed boxes, apart, touching or through each other, some with a side left out."""
    parts = []
    for _ in range(random.integers(1, 5)):
        extent = random.choice([0.05, 0.5, 1.0, 2.0], 3)
        low = random.choice([-1.0, -0.5, 0.0, 0.25, 1.0], 3)
        without = [int(random.integers(6))] if random.random() < 0.2 else []
        parts.append(box(extent, low, without=without))
    return _arrays(joined(*parts))


def _closed(random: np.random.Generator) -> Soup:
    """Closed and without doubt about it."""
    shapes = (box, lambda: sphere(rings=5), lambda: torus(around=9, across=6), table)
    return _arrays(shapes[random.integers(len(shapes))]())


def _sheet(random: np.random.Generator) -> Soup:
    """A height field, flat or rough, as terrains are."""
    count = int(random.integers(2, 8))
    x, z = np.meshgrid(np.arange(count), np.arange(count), indexing="ij")
    y = random.choice([0.0, 0.01, 1.0, 30.0]) * random.random((count, count))
    place = np.arange(count**2).reshape(count, count)
    a, b, c, d = (
        part.ravel() for part in (place[:-1, :-1], place[1:, :-1], place[1:, 1:], place[:-1, 1:])
    )
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return np.stack([x, y, z], axis=-1).reshape(-1, 3).astype(np.float64), faces


def _planar(random: np.random.Generator) -> Soup:
    """All in one plane, which may lie askew and through the origin or not."""
    points = random.choice([0.0, 0.5, 1.0, 2.0], (int(random.integers(3, 12)), 3))
    points[:, 1] = random.choice([0.0, 1.0, 0.1]) + random.choice([0.0, 1.0]) * points[:, 0]
    return points, random.integers(0, len(points), (int(random.integers(1, 12)), 3))


def _needles(random: np.random.Generator) -> Soup:
    """Triangles that are nearly lines, and nearly points."""
    count = int(random.integers(1, 10))
    ends = random.normal(size=(count, 2, 3))
    share = random.random((count, 1))
    width = 10.0 ** random.integers(-17, -2, (count, 1))
    third = ends[:, 0] * share + ends[:, 1] * (1 - share) + width * random.normal(size=(count, 3))
    points = np.concatenate([ends, third[:, None]], axis=1).reshape(-1, 3)
    return points, np.arange(3 * count).reshape(-1, 3)


def _near_duplicates(random: np.random.Generator) -> Soup:
    """A closed solid whose triangles miss each other's corners by the last bits."""
    points, faces = _closed(random)
    corners = points[faces].reshape(-1, 3)
    ulps = random.integers(-2, 3, corners.shape)
    return corners + ulps * np.spacing(np.abs(corners)), np.arange(len(corners)).reshape(-1, 3)


def _lattice(random: np.random.Generator) -> Soup:
    """Cubes that fill cells of a lattice: faces coincide, edges and corners touch."""
    cells = [cell for cell in product(range(3), repeat=3) if random.random() < 0.3] or [(0, 0, 0)]
    return _arrays(joined(*(box((1.0, 1.0, 1.0), cell) for cell in cells)))


def _star(random: np.random.Generator) -> Soup:
    """Large triangles that all cross each other near the middle."""
    points = random.normal(size=(int(random.integers(2, 12)), 3, 3))
    points -= points.mean(axis=1, keepdims=True)
    return points.reshape(-1, 3), np.arange(points.size // 3).reshape(-1, 3)


def _splinters(random: np.random.Generator) -> Soup:
    """A solid, and dust far around it."""
    points, faces = _closed(random)
    far = 10.0 ** random.uniform(0, 4) * random.normal(size=(6, 3)) + 0.01 * random.normal(
        size=(6, 3)
    )
    return np.concatenate([points, far]), np.concatenate(
        [faces, len(points) + np.arange(6).reshape(2, 3)]
    )


KINDS = {
    "boxes": _from(_boxes),
    "closed": _from(_closed),
    "sheet": _from(_sheet),
    "planar": _from(_planar),
    "needles": _from(_needles),
    "near duplicates": _from(_near_duplicates),
    "lattice": _from(_lattice),
    "star": _from(_star),
    "splinters": _from(_splinters),
    "whole numbers": random_soups(st.integers(-4, 4).map(float)),
    "any numbers": random_soups(st.floats(-1.0, 1.0)),
    "wild numbers": random_soups(st.floats()),
}
"""By name; the last may hold NaN, infinities and anything in between."""

_MESHES = ("boxes", "closed", "sheet", "lattice", "near duplicates", "splinters")


def _moved(soup: Soup, scale: float, offset: float) -> Soup:
    points, faces = soup
    with np.errstate(over="ignore", invalid="ignore"):
        return points * scale + offset * np.array([1.0, -0.7, 0.3]), faces


def _unshared(soup: Soup) -> Soup:
    points, faces = soup
    return points[faces].reshape(-1, 3), np.arange(faces.size).reshape(-1, 3)


def _doubled(soup: Soup) -> Soup:
    """Every triangle twice, the second time turned over."""
    points, faces = soup
    return points, np.concatenate([faces, faces[:, ::-1]])


def _thinned(soup: Soup) -> Soup:
    points, faces = soup
    return points, faces[:: 2 if len(faces) > 1 else 1]


def _broken(soup: Soup) -> Soup:
    """One coordinate is no number."""
    points, faces = soup
    points = points.copy()
    points[len(points) // 2, 1] = np.nan
    return points, faces


scales = st.one_of(
    st.sampled_from([1.0, 1.0, 1.0, 1e-3, 1e3, 1e6, 1e-9]),
    st.integers(-300, 99).map(lambda power: float(f"1e{power}")),
)
offsets = st.sampled_from([0.0, 0.0, 0.0, 1.0, -1e3, 1e7, 1e12, 1e90])
_disturbances = st.lists(
    st.sampled_from([_unshared, _doubled, _thinned, _broken]), max_size=2, unique=True
)


@st.composite
def soups(draw: st.DrawFn) -> Soup:
    """A mesh of any kind, as it is or disturbed, at any scale and place."""
    soup: Soup = draw(st.sampled_from([*_MESHES, *KINDS]).flatmap(lambda kind: KINDS[kind]))
    for disturb in draw(_disturbances):
        soup = disturb(soup)
    if draw(st.booleans()):
        soup = _moved(soup, draw(scales), draw(offsets))
    return soup


ordinary_soups = st.sampled_from(_MESHES).flatmap(lambda kind: KINDS[kind])
"""Meshes as users have them, at a usual size."""
