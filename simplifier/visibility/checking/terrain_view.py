"""Terrain and points -> which of its tiles they certainly see, by exact lines.

The surface is the scene's: each square of posts is split from its south-west to its north-east.
"""

from __future__ import annotations

import numpy as np

from simplifier.geometry.mesh import FloatArray
from simplifier.kernels.terrain_view import see_terrain
from simplifier.kernels.threads import run_chunks
from simplifier.progress import TellShare, silent
from simplifier.visibility.solid.terrain import Terrain

AZIMUTHS = 720
"""Even directions from each point, beside those to the highest posts of all tiles."""

_REACH = 1e-9  # of the extent: rounding is far below it


def terrain_seen_from(
    terrain: Terrain,
    eyes: FloatArray,
    azimuths: int = AZIMUTHS,
    *,
    margin: float = 0.0,
    tell: TellShare = silent,
) -> FloatArray:
    """(k, n) along which azimuth each eye sees each tile, radians from x to y; NaN if not proven.

    ``eyes``      (k, 3) world; one that is below the surface sees nothing.
    ``azimuths``  that are looked along, and then over the highest post of each tile.
    ``margin``    a length: so much of an edge must be seen.

    All that is said to be seen is seen; narrow gaps may be missed.
    """
    found = np.full((len(eyes), len(terrain.scene)), np.nan)
    spacing = np.array(terrain.elevation.spacing)
    squares = np.array(terrain.known.shape)
    extent = float(max(*(squares * spacing), np.ptp(terrain.heights)))
    golden = 0.5 * (np.sqrt(5.0) - 1.0)  # no row or column of posts is looked along
    angles = (np.arange(azimuths) + golden) * (2.0 * np.pi / max(azimuths, 1))
    tiles_x = np.arange(squares[0]) // terrain.tile
    tiles_y = (squares[1] - 1 - np.arange(squares[1])) // terrain.tile
    places = np.array(eyes, dtype=np.float64, order="C")
    places[:, :2] -= terrain.corner
    goals = _highest_posts(terrain)

    def work(begin: int, end: int) -> None:
        see_terrain(
            places, begin, end, angles, goals, terrain.heights, terrain.known, tiles_x, tiles_y,
            terrain.numbers, spacing, float(np.nanmax(terrain.elevation.heights)),
            max(margin, _REACH * extent), found,
        )  # fmt: skip

    run_chunks(work, len(eyes), tell=tell)
    return found


def _highest_posts(terrain: Terrain) -> FloatArray:
    """(n, 2) the place of the highest vertex of each tile, from the south-west post."""
    tops = [mesh.vertices[np.argmax(mesh.vertices[:, 2]), :2] for mesh in terrain.scene.meshes]
    return np.array(tops).reshape(-1, 2) - terrain.corner
