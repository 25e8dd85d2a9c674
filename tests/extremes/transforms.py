"""Changes of a mesh whose effect on its occluder is known, as data.

A :class:`Placement` puts the same surface elsewhere, at another size, turned; a :class:`Rewriting`
writes the same surface down in other arrays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from simplifier.geometry.mesh import FloatArray, TriangleMesh

Generator = np.random.Generator
Indices = NDArray[np.int32]

AWAY = np.array([1.0, -0.7, 0.3])
"""The direction of all offsets; every coordinate changes."""


@dataclass(frozen=True)
class Placement:
    """Points p go to ``scale * (turn p + offset * longest edge * AWAY)``.

    ``offset``  in longest edges of the mesh.
    ``turn``    rotation vector, degrees.
    """

    name: str
    scale: float = 1.0
    offset: float = 0.0
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def place(self, points: FloatArray, longest: float) -> FloatArray:
        """``longest`` edge of the mesh that the points belong to."""
        turned = points if self.turn == (0.0, 0.0, 0.0) else points @ self.rotation.T
        return np.asarray((turned + self.offset * longest * AWAY) * self.scale)

    def of(self, mesh: TriangleMesh) -> TriangleMesh:
        """The mesh there."""
        placed = self.place(mesh.vertices, float(mesh.extent.max()))
        return TriangleMesh.from_soup(placed, mesh.faces)

    @property
    def rotation(self) -> FloatArray:
        """(3, 3)."""
        return np.asarray(Rotation.from_rotvec(self.turn, degrees=True).as_matrix())


POWERS = tuple(Placement(f"scale 2^{power}", 2.0**power) for power in (-300, -40, -1, 40, 300))
"""Every operation on lengths is exact, so all must follow bit by bit."""

SCALES = tuple(Placement(f"scale {scale:g}", scale) for scale in (1e-12, 1e-6, 1e6, 1e12))

OFFSETS = tuple(
    Placement(f"offset {offset:g} extents", offset=offset) for offset in (1e3, 1e6, 1e9)
)

SCALED_AWAY = tuple(
    Placement(f"scale {scale:g}, offset 1e9 extents", scale, 1e9) for scale in (1e-12, 1e12)
)


def turns(up: str) -> tuple[Placement, ...]:
    """About the upward axis: a mesh that stands on the ground goes on standing on it."""
    x, y, z = (float(axis == up) for axis in "xyz")
    return tuple(
        Placement(f"turned {angle:g} degrees", turn=(x * angle, y * angle, z * angle))
        for angle in (1e-6, 7.0, 45.0, 110.0)
    )


TILTS = tuple(
    Placement(f"tilted {angle:g} degrees", turn=(0.6 * angle, 0.0, -0.8 * angle))
    for angle in (1e-6, 7.0, 45.0, 110.0)
)
"""About a level axis: for closed meshes, which need no ground."""


@dataclass(frozen=True)
class Rewriting:
    """The same points of space in other arrays.

    ``rewrite``  vertices (n, 3), faces (m, 3) and a source of chance to such vertices and faces.
    ``rounds``   whether a corner of the result may be off its triangle by a rounding error.
    """

    name: str
    rewrite: Callable[[FloatArray, Indices, Generator], tuple[FloatArray, Indices]] = field(
        repr=False
    )
    rounds: bool = False

    def of(self, mesh: TriangleMesh, seed: int = 0) -> TriangleMesh:
        """The mesh written anew."""
        made = self.rewrite(mesh.vertices, mesh.faces, np.random.default_rng(seed))
        return TriangleMesh.from_soup(*made)


def _shuffled_triangles(
    points: FloatArray, faces: Indices, chance: Generator
) -> tuple[FloatArray, Indices]:
    return points, chance.permutation(faces)


def _shuffled_vertices(
    points: FloatArray, faces: Indices, chance: Generator
) -> tuple[FloatArray, Indices]:
    order = chance.permutation(len(points))
    return points[order], np.argsort(order).astype(np.int32)[faces]


def _turned_corners(
    points: FloatArray, faces: Indices, chance: Generator
) -> tuple[FloatArray, Indices]:
    first = chance.integers(0, 3, (len(faces), 1))
    return points, np.take_along_axis(faces, (np.arange(3) + first) % 3, axis=1)


def _flipped(points: FloatArray, faces: Indices, chance: Generator) -> tuple[FloatArray, Indices]:
    return points, faces[:, ::-1]


def _half_flipped(
    points: FloatArray, faces: Indices, chance: Generator
) -> tuple[FloatArray, Indices]:
    chosen = chance.random((len(faces), 1)) < 0.5
    return points, np.where(chosen, faces[:, ::-1], faces)


def _doubled(points: FloatArray, faces: Indices, chance: Generator) -> tuple[FloatArray, Indices]:
    return points, np.concatenate([faces, faces])


def _double_sided(
    points: FloatArray, faces: Indices, chance: Generator
) -> tuple[FloatArray, Indices]:
    return points, np.concatenate([faces, faces[:, ::-1]])


def _unshared(points: FloatArray, faces: Indices, chance: Generator) -> tuple[FloatArray, Indices]:
    return points[faces].reshape(-1, 3), np.arange(faces.size, dtype=np.int32).reshape(-1, 3)


def _slivers(share: float) -> Callable[..., tuple[FloatArray, Indices]]:
    """Every triangle cut in two at a point of its first edge, ``share`` of the way."""

    def cut(points: FloatArray, faces: Indices, chance: Generator) -> tuple[FloatArray, Indices]:
        a, b, c = faces.T
        middles = points[a] + share * (points[b] - points[a])
        middle = (len(points) + np.arange(len(faces))).astype(np.int32)
        halves = [np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)]
        return np.concatenate([points, middles]), np.concatenate(halves)

    return cut


REWRITINGS = (
    Rewriting("triangles shuffled", _shuffled_triangles),
    Rewriting("vertices shuffled", _shuffled_vertices),
    Rewriting("corners turned", _turned_corners),
    Rewriting("all flipped", _flipped),
    Rewriting("half flipped", _half_flipped),
    Rewriting("every triangle twice", _doubled),
    Rewriting("every triangle on both sides", _double_sided),
    Rewriting("no vertex shared", _unshared),
    Rewriting("cut in halves", _slivers(0.5), rounds=True),
    Rewriting("cut at a thousandth", _slivers(1e-3), rounds=True),
    Rewriting("cut at a billionth", _slivers(1e-9), rounds=True),
)
