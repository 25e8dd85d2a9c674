"""Open sheets with an outline in few triangles: ``python -m bench.sheets [NAME ...]``.

Seven terrains, of which six are noise; eleven other sheets: cloths, domes, pipes and the like; and
a town on a ground.
The table is that of :mod:`bench.by_budget`; ``--presets draft,balanced``, ``--budgets 12,16,24``
and ``--seeds 2`` say what is run; names after that, which sheets.  If none is named, each preset's
rows go to ``bench/results/sheets_PRESET.csv`` and to ``sheets.md``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from bench.by_budget import Shapes, arguments, run
from bench.meshes import lattice_faces, load_stand_in, stand_in_named
from bench.quality import RESULTS
from simplifier.geometry.mesh import FloatArray, TriangleMesh
from tests.solids import hills, town

BUDGETS = (12, 16, 24, 32, 40, 48, 64)
TERRAIN, TOWN = "terrain", "town"

Shape = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray, FloatArray]]
"""From a square (n, n), u and v from 0 to 1, to places x, y and z."""

_NOISE = ((1, 180, 2.5), (2, 180, 3.2), (3, 120, 2.2), (4, 180, 3.8), (5, 60, 3.0), (6, 250, 2.8))
"""Seed, vertices a side, and how fast waves get lower the shorter they are."""

_QUARTER, _HALF, _TURN = np.pi / 2.0, np.pi, 2.0 * np.pi


def _dome(u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    down = _QUARTER * (0.05 + 0.95 * u)
    return np.sin(down) * np.cos(_TURN * v), np.sin(down) * np.sin(_TURN * v), np.cos(down)


def _peak(u: FloatArray, v: FloatArray, x: float, y: float, steep: float) -> FloatArray:
    return np.asarray(np.exp(-steep * ((u - x) ** 2 + (v - y) ** 2)))


SHAPES: dict[str, tuple[int, Shape]] = {
    "flat": (180, lambda u, v: (u, v, 0.0 * u)),
    "cloth": (180, lambda u, v: (u, v, 0.06 * np.sin(9.0 * u) * np.cos(7.0 * v))),
    "flag": (150, lambda u, v: (u, 0.7 * v, 0.1 * np.sin(7.0 * u + 2.0 * v) * u)),
    "dome": (180, _dome),
    "half pipe": (150, lambda u, v: (np.cos(_HALF * u), np.sin(_HALF * u), 3.0 * v)),
    "saddle": (180, lambda u, v: (u, v, 1.2 * ((u - 0.5) ** 2 - (v - 0.5) ** 2))),
    "helicoid": (
        180, lambda u, v: ((0.1 + 0.9 * u) * np.cos(5.0 * v), (0.1 + 0.9 * u) * np.sin(5.0 * v),
                           0.5 * v),
    ),
    "two peaks": (
        180, lambda u, v: (u, v, 0.5 * _peak(u, v, 0.4, 0.6, 40.0)
                           + 0.3 * _peak(u, v, 0.8, 0.2, 60.0)),
    ),
    "disc": (
        160, lambda u, v: (u * np.cos(_TURN * v), u * np.sin(_TURN * v), 0.1 * np.sin(6.0 * u)),
    ),
}  # fmt: skip
"""Vertices a side, and their places."""


def _sheet(x: FloatArray, y: FloatArray, z: FloatArray) -> TriangleMesh:
    """Of places (n, n)."""
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    return TriangleMesh.from_soup(points, lattice_faces(len(x) - 1))


def shaped(side: int, shape: Shape) -> TriangleMesh:
    u, v = np.meshgrid(*[np.linspace(0.0, 1.0, side)] * 2, indexing="ij")
    return TriangleMesh.from_soup(
        np.stack(shape(u, v), axis=-1).reshape(-1, 3), lattice_faces(side - 1)
    )


def noise(seed: int, side: int, smooth: float) -> TriangleMesh:
    """A height field whose waves get lower with that power of their number, 0.15 sides high."""
    waves = np.fft.fftfreq(side)
    squares = waves[:, None] ** 2 + waves[None] ** 2
    squares[0, 0] = 1.0
    white = np.random.default_rng(seed).standard_normal((side, side))
    spectrum = np.fft.fft2(white) * squares ** (-smooth / 2.0)
    spectrum[0, 0] = 0.0
    height = np.real(np.fft.ifft2(spectrum))
    height *= 0.15 * side / np.ptp(height)
    x, y = np.meshgrid(*[np.arange(side, dtype=np.float64)] * 2, indexing="ij")
    return TriangleMesh.from_soup(
        np.stack([x, y, height], axis=-1).reshape(-1, 3), lattice_faces(side - 1)
    )


def cut_out(mesh: TriangleMesh) -> TriangleMesh:
    """Without a quarter of it: an L."""
    middle = mesh.vertices[mesh.faces].mean(axis=1)
    return TriangleMesh.from_soup(mesh.vertices, mesh.faces[(middle[:, :2] < 0.5).any(axis=1)])


def sheets() -> Iterator[tuple[str, TriangleMesh | None]]:
    """Each by its name; None where an asset is not there."""
    stand_in = stand_in_named(TERRAIN)
    yield TERRAIN, None if stand_in.missing else load_stand_in(stand_in)
    for seed, side, smooth in _NOISE:
        yield f"{TERRAIN} {seed}", noise(seed, side, smooth)
    for name, (side, shape) in SHAPES.items():
        yield name, shaped(side, shape)
    yield "L", cut_out(shaped(*SHAPES["cloth"]))
    yield "hills", hills(120)
    yield TOWN, town()


def kind_of(name: str) -> str:
    if name == TOWN:
        return "grounds"
    return "terrains" if name.startswith(TERRAIN) else "others"


def standing(name: str) -> dict[str, Any]:
    return {"up": "y" if name == TOWN else "z", "ground": name.startswith(TERRAIN)}


def main(words: Sequence[str] | None = None) -> None:
    shapes = Shapes("sheets", sheets, kind_of, standing)
    given = arguments(__doc__, BUDGETS, words)
    run(shapes, given, RESULTS, stand_in_named(TERRAIN).missing)


if __name__ == "__main__":
    main()
