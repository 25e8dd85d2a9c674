"""Shapes at the extremes, by name: what has no inside, no size, or too many insides.

``SHAPES`` holds them as data, each the same on every call.  Those that are measured against the
grid are in voxels of a grid of :data:`VOXELS` along the longest edge, the default.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import product

import numpy as np

from simplifier.geometry.mesh import TriangleMesh

VOXELS = 64
"""Edge of the shapes that are made in voxels: at the default resolution a voxel is one unit."""

HOLES = (0.1, 0.3, 0.5, 0.9, 1.0, 1.1, 1.5, 2.0, 3.0, 5.0, 10.0)
"""Widths of a hole, voxels."""

_CORNERS = np.array(list(product((0.0, 1.0), repeat=3)))
_SIDES = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
)  # -x, +x, -y, +y, -z, +z, wound outwards
_TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


def soup(points: Iterable[np.ndarray]) -> TriangleMesh:
    """Of (k, 3, 3) triangles, which share no vertices."""
    corners = np.concatenate(list(points)).reshape(-1, 3)
    return TriangleMesh.from_soup(corners, np.arange(len(corners)).reshape(-1, 3))


def quads(corners: np.ndarray) -> np.ndarray:
    """(2 k, 3, 3) triangles of (k, 4, 3) corners in turn."""
    return np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])


def cubes(lows: np.ndarray, extent: float | tuple[float, ...] = 1.0) -> np.ndarray:
    """(12 k, 3, 3) triangles of boxes of one size at (k, 3) low corners, wound outwards."""
    corners = np.asarray(lows, dtype=np.float64)[:, None] + _CORNERS * extent
    return quads(corners[:, _SIDES].reshape(-1, 4, 3))


def finer(mesh: TriangleMesh, times: int = 2) -> TriangleMesh:
    """Every triangle in four, so often, which share no vertices: more than a budget holds."""
    triangles = mesh.vertices[mesh.faces]
    for _ in range(times):
        a, b, c = triangles.transpose(1, 0, 2)
        ab, bc, ca = (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0
        parts = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        triangles = np.concatenate([np.stack(part, axis=1) for part in parts])
    return soup([triangles])


def box(extent: tuple[float, ...], low: tuple[float, ...] = (0.0, 0.0, 0.0)) -> TriangleMesh:
    return soup([cubes(np.array([low]), extent)])


def one_triangle() -> TriangleMesh:
    return soup([np.array([[[0.0, 0.0, 0.0], [1.0, 0.2, 0.1], [0.3, 0.9, 0.4]]])])


def crossing_quads() -> TriangleMesh:
    """Two squares that stand upright and cross in the y axis, as grass and far trees do."""
    square = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [-1.0, 2.0, 0.0]])
    return soup([quads(np.stack([square, square[:, [2, 1, 0]]]))])


def flat_sheet() -> TriangleMesh:
    """A floor without thickness, along the grid."""
    corners = np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, 0.0]]])
    return soup([quads(corners)])


def turned(mesh: TriangleMesh) -> TriangleMesh:
    """The same, along none of the grid's axes."""
    matrix, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))
    return TriangleMesh.from_soup(mesh.vertices @ matrix.T, mesh.faces)


def needle(length: float = 1e6) -> TriangleMesh:
    """So long, 1 wide and high, closed."""
    return box((length, 1.0, 1.0))


def holed_box(width: float) -> TriangleMesh:
    """A cube of :data:`VOXELS` with a square hole in its top, off the lattice."""
    low = VOXELS / 2.0 - width / 2.0 + 0.25
    cuts = np.array([0.0, low, low + width, VOXELS])
    around = [
        [[cuts[i], VOXELS, cuts[j]], [cuts[i], VOXELS, cuts[j + 1]],
         [cuts[i + 1], VOXELS, cuts[j + 1]], [cuts[i + 1], VOXELS, cuts[j]]]
        for i, j in product(range(3), repeat=2) if (i, j) != (1, 1)
    ]  # fmt: skip
    sides = (_CORNERS * VOXELS)[np.delete(_SIDES, 3, axis=0)]
    return soup([quads(sides), quads(np.array(around))])


def nested_shells() -> TriangleMesh:
    """Five closed boxes, each within the next: what counts is the outermost."""
    edges = np.linspace(1.0, 0.2, 5)
    return soup(cubes(np.full((1, 3), -edge / 2.0), edge) for edge in edges)


def thin_walls() -> TriangleMesh:
    """A closed cube around a hollow, its walls a tenth of a voxel thick."""
    hollow = cubes(np.full((1, 3), 0.1), VOXELS - 0.2)[:, ::-1]
    return soup([cubes(np.zeros((1, 3)), VOXELS), hollow])


def specks() -> TriangleMesh:
    """10,000 tetrahedra in a cube, each a thousandth of it in size, no two of them joined."""
    random = np.random.default_rng(0)
    corners = random.uniform(size=(10_000, 1, 3)) + random.normal(size=(10_000, 4, 3)) * 5e-4
    return soup([corners[:, _TETRAHEDRON].reshape(-1, 3, 3)])


def checkerboard() -> TriangleMesh:
    """8 x 8 x 8 cells, every other a cube: neighbours touch along whole edges."""
    cells = np.array([cell for cell in product(range(8), repeat=3) if sum(cell) % 2 == 0])
    return soup([cubes(cells)])


def chessboard() -> TriangleMesh:
    """8 x 8 cells, every other a cube: a screen that one looks through."""
    cells = np.array([(*cell, 0) for cell in product(range(8), repeat=2) if sum(cell) % 2 == 0])
    return soup([cubes(cells)])


def menger_sponge() -> TriangleMesh:
    """The third step: 8,000 cubes of the 27^3, touching by whole faces; a soup of all of them."""
    cells = np.array(list(product(range(27), repeat=3)))
    solid = np.ones(len(cells), dtype=bool)
    for step in (1, 3, 9):
        solid &= (cells // step % 3 == 1).sum(axis=1) < 2
    return soup([cubes(cells[solid])])


def full_grid() -> TriangleMesh:
    """A box of 64 x 32 x 16 voxels: no voxel of its grid is outside."""
    return box((VOXELS, VOXELS // 2, VOXELS // 4))


def voxel_faces() -> TriangleMesh:
    """Stairs of eight blocks, every face in a face of voxels."""
    lows = [(8.0 * step, 0.0, 0.0) for step in range(8)]
    return soup(
        cubes(np.array([low]), (8.0, 8.0 * (step + 1), 32.0)) for step, low in enumerate(lows)
    )


SHAPES: dict[str, Callable[[], TriangleMesh]] = {
    "cube": lambda: finer(box((1.0, 1.0, 1.0))),
    "one triangle": one_triangle,
    "two crossing quads": crossing_quads,
    "flat sheet": lambda: finer(flat_sheet(), 4),
    "flat sheet, turned": lambda: turned(finer(flat_sheet(), 4)),
    "needle": needle,
    "needle of 192 triangles": lambda: turned(finer(needle())),
    "rod of 100 : 1": lambda: turned(finer(needle(100.0), 3)),
    **{f"hole of {width} voxels": lambda width=width: finer(holed_box(width)) for width in HOLES},
    "nested shells": lambda: finer(nested_shells()),
    "nested shells, few triangles": nested_shells,
    "walls of 0.1 voxel": lambda: finer(thin_walls()),
    "10,000 specks": specks,
    "checkerboard": checkerboard,
    "chessboard": chessboard,
    "Menger sponge": menger_sponge,
    "full grid": lambda: finer(full_grid()),
    "voxel faces": lambda: finer(voxel_faces(), 1),
}
"""The undisturbed case first."""

OPEN = ("one triangle", "two crossing quads", "flat sheet", "flat sheet, turned")
"""Those that enclose nothing, as all with a hole do; the rest has no opening."""

CLOSED = tuple(name for name in SHAPES if name not in OPEN and not name.startswith("hole"))
