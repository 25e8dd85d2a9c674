"""Meshes to measure on: generated solids of any size, and stand-ins for the paper's five scenes.

A mesh has a name that a fresh process can make it from: ``bumpy-100000``, ``cube-10800``,
``castle``, or the name of a stand-in.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import isqrt
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import simplifier
from bench.machine import ROOT
from examples.castle import castle
from simplifier.geometry.mesh import FloatArray, IntArray, TriangleMesh
from simplifier.io.formats import readable_suffixes
from simplifier.options.simplify import Axis

ASSETS = Path(os.environ.get("OCCLUDER_ASSETS", ROOT.parent / "shared" / "assets"))

_BUMPS = np.array([[7.0, 2.0, 3.0, 1.0], [-3.0, 9.0, 5.0, 2.0], [5.0, -4.0, 13.0, 3.0]])
_HEIGHT = 0.08  # of a bump, in radii


@dataclass(frozen=True)
class StandIn:
    """A mesh in place of one of the scenes of the paper's Table 1.

    ``file``     name in the folder of assets.
    ``budget``   triangles, that of the table; ``up``, ``ground`` as the options of these names.
    ``printed``  precision and recall that the table prints for its own method, fractions.
    ``figure``   recall that this release must reach at 99 % precision; None where the paper's mesh
                 was another one, so that its figures are no measure for ours.
    """

    name: str
    file: str
    budget: int
    up: Axis
    ground: bool
    printed: tuple[float, float]
    figure: float | None

    @property
    def path(self) -> Path:
        return ASSETS / self.file

    @property
    def missing(self) -> str:
        """Why it has to be skipped, empty where it is there."""
        absent = f"{self.file} is not there (set OCCLUDER_ASSETS to the folder of real meshes)"
        return "" if self.path.exists() else absent

    @property
    def options(self) -> dict[str, Any]:
        """Keyword arguments of :func:`simplifier.simplify`."""
        return {"budget": self.budget, "up": self.up, "ground": self.ground}


STAND_INS = (
    StandIn("bunny_4968", "bunny_4968.ply", 53, "y", True, (0.999, 0.835), 0.72),
    StandIn("dragon_871k", "dragon_871k.ply", 36, "y", False, (0.999, 0.478), 0.45),
    StandIn("terrain", "terrain_jacksboro_60160.ply", 23, "z", True, (0.999, 0.823), None),
    StandIn("machine", "machine_anymal_kinova_395k.glb", 36, "z", False, (0.998, 0.564), None),
    StandIn("buddha_113k", "buddha_113k.ply", 30, "y", False, (0.999, 0.602), 0.52),
)


_STANDING_Z_UP = ("broken_lyon", "building", "city", "terrain")  # with an open base, as file names


def readable_assets(
    paths: Sequence[Path] | None = None,
) -> Iterator[tuple[Path, dict[str, Any]]]:
    """Every mesh file of the assets, or those of ``paths``, and how it stands.

    The options are ``up`` and ``ground`` of :func:`simplifier.simplify`.
    """
    for path in sorted(ASSETS.glob("*.*")) if paths is None else paths:
        if path.suffix in readable_suffixes():
            standing = path.name.startswith(_STANDING_Z_UP)
            ground = standing or "bunny" in path.name
            yield path, {"up": "z" if standing else "y", "ground": ground}


def load_stand_in(stand_in: StandIn) -> TriangleMesh:
    """The mesh as the library reads it."""
    return simplifier.load(stand_in.path)


def stand_in_named(name: str) -> StandIn:
    """One of :data:`STAND_INS`."""
    return next(stand_in for stand_in in STAND_INS if stand_in.name == name)


def mesh_named(name: str) -> TriangleMesh:
    """Make or load the mesh of that name; raises ValueError when there is none."""
    if any(name == stand_in.name for stand_in in STAND_INS):
        return load_stand_in(stand_in_named(name))
    kind, _, triangles = name.partition("-")
    if kind == "castle":
        return castle()
    if kind not in ("bumpy", "cube") or not triangles.isdigit():
        raise ValueError(f"no mesh is called {name}")
    return (bumpy_sphere if kind == "bumpy" else cube)(int(triangles))


def bumpy_sphere(triangles: int) -> TriangleMesh:
    """A closed solid with rolling bumps and exactly that many triangles, wound outwards.

    ``triangles`` is even (closed surfaces have no other counts) and at least 48.  Radius 0.76 to
    1.24 about the origin; the same shape, ever finer.
    """

    def bump(points: FloatArray) -> FloatArray:
        unit = points / np.linalg.norm(points, axis=1, keepdims=True)
        waves = np.sin(unit @ _BUMPS[:, :3].T + _BUMPS[:, 3]).sum(axis=1, keepdims=True)
        return np.asarray(unit * (1.0 + _HEIGHT * waves))

    return _shaped(triangles, bump)


def cube(triangles: int) -> TriangleMesh:
    """The cube from -1 to 1 with exactly that many triangles (even, 48 or more): a full grid."""
    return _shaped(triangles, lambda points: points)


def _shaped(triangles: int, shape: Callable[[FloatArray], FloatArray]) -> TriangleMesh:
    """Map the surface of the cube; the triangles that squares cannot give come from splits."""
    if triangles < 48 or triangles % 2:
        raise ValueError(f"{triangles} triangles: choose an even number of 48 or more")
    squares = isqrt(triangles // 12)
    points, faces = _cube_surface(squares)
    points, faces = _split(points, faces, (triangles - len(faces)) // 2)
    return TriangleMesh.from_soup(shape(points), faces)


def _cube_surface(squares: int) -> tuple[FloatArray, IntArray]:
    """The cube from -1 to 1, squares x squares squares a side, corners shared by index."""
    steps = np.arange(squares + 1)
    a, b = (grid.ravel() for grid in np.meshgrid(steps, steps, indexing="ij"))
    sides: list[NDArray[np.int64]] = []
    side_faces: list[IntArray] = []
    for axis in range(3):
        for end in (0, squares):
            # Cyclic axes: a x b points along +axis, so the side at the low end is turned round.
            lattice = np.roll(np.stack([np.full_like(a, end), a, b], axis=1), axis, axis=1)
            quads = lattice_faces(squares) + len(sides) * len(a)
            sides.append(lattice)
            side_faces.append(quads if end else quads[:, ::-1])
    lattice = np.concatenate(sides)
    keys = (lattice[:, 0] * (squares + 1) + lattice[:, 1]) * (squares + 1) + lattice[:, 2]
    _, first, shared = np.unique(keys, return_index=True, return_inverse=True)
    points = np.asarray(lattice[first] * (2.0 / squares) - 1.0, dtype=np.float64)
    return points, np.asarray(shared[np.concatenate(side_faces)], dtype=np.int32)


def lattice_faces(squares: int) -> IntArray:
    """(2 squares^2, 3) triangles of a lattice of (squares + 1)^2 points, a the slow axis."""
    place = np.arange((squares + 1) ** 2, dtype=np.int32).reshape(squares + 1, squares + 1)
    p, q, r, s = (
        corner.ravel()
        for corner in (place[:-1, :-1], place[1:, :-1], place[1:, 1:], place[:-1, 1:])
    )
    return np.concatenate([np.stack([p, q, r], axis=1), np.stack([p, r, s], axis=1)])


def _split(points: FloatArray, faces: IntArray, count: int) -> tuple[FloatArray, IntArray]:
    """Put a new vertex into the middle of ``count`` faces spread over all: two more each."""
    chosen = np.arange(count) * len(faces) // max(count, 1)
    a, b, c = faces[chosen].T
    middle = (len(points) + np.arange(count)).astype(np.int32)
    split = faces.copy()
    split[chosen, 2] = middle
    more = [np.stack([b, c, middle], axis=1), np.stack([c, a, middle], axis=1)]
    centres = points[faces[chosen]].mean(axis=1)
    return np.concatenate([points, centres]), np.concatenate([split, *more])
