"""Elevation -> tiles as the objects of a scene, and their HeightField.

The surface between four posts is one of two pairs of triangles, and an elevation model does not say
which.  What is found holds for both: heights that hide are bounds from below, heights that are
seen bounds from above.  A terrain is solid below its surface.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.elevation import Elevation
from simplifier.geometry.mesh import FloatArray, IntArray, TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.geometry.solid import BoolArray
from simplifier.kernels.terrain import measure_pixels
from simplifier.visibility.solid.height_field import HeightField, raster_over
from simplifier.visibility.solid.object_heights import rounded_down, rounded_up

_DEEP = 0.01  # of the spacing: so far below the lowest post the sides of tiles reach


@dataclass(frozen=True, eq=False)
class Terrain:
    """An elevation model in square tiles of so many posts.

    ``tile``     squares of four posts along a tile's side; neighbours share the posts between.
    ``numbers``  (k, l) int32: the object of each tile, k from west to east, l from north to south;
                 -1 for those without any surface.
    ``holed``    (n,) bool: objects that lack samples.
    ``scene``    the tiles that have a surface, named ``tile_<row>_<column>``; z is up, and each has
                 sides down to below the lowest post where the terrain ends, at holes too.
    """

    elevation: Elevation
    tile: int
    numbers: IntArray
    holed: BoolArray
    scene: Scene

    @classmethod
    def of(cls, elevation: Elevation, tile: int) -> Terrain:
        squares = elevation.squares
        rows, columns = (-(-length // tile) for length in squares.shape)
        base = float(np.nanmin(elevation.heights)) - _DEEP * max(elevation.spacing)
        meshes: list[TriangleMesh] = []
        names, holed = [], []
        numbers = np.full((columns, rows), -1, dtype=np.int32)
        for row in range(rows):
            for column in range(columns):
                place = (
                    slice(row * tile, (row + 1) * tile), slice(column * tile, (column + 1) * tile)
                )  # fmt: skip
                if not squares[place].any():
                    continue
                numbers[column, row] = len(meshes)
                meshes.append(_tile_mesh(elevation, squares, place, base))
                names.append(f"tile_{row}_{column}")
                holed.append(not squares[place].all())
        count = len(meshes)
        scene = Scene(
            tuple(meshes), tuple(names), np.arange(count, dtype=np.int32),
            np.tile(np.eye(4), (count, 1, 1)),
            tuple(_warnings(elevation, sum(holed), numbers.size - count, tile)),
        )  # fmt: skip
        return cls(elevation, tile, numbers, np.array(holed, dtype=np.bool_), scene)

    @cached_property
    def heights(self) -> FloatArray:
        """(nx, ny) float64 of the posts from west to east and south to north, 0 where missing."""
        heights = np.nan_to_num(self.elevation.heights[::-1].T, nan=0.0)
        return np.ascontiguousarray(heights)

    @cached_property
    def known(self) -> BoolArray:
        """(nx - 1, ny - 1) the squares that have a surface, in that order."""
        return np.ascontiguousarray(self.elevation.squares[::-1].T)

    @property
    def posts(self) -> BoolArray:
        """(nx, ny) the posts whose height is known, in the order of ``heights``."""
        return np.asarray(~np.isnan(self.elevation.heights[::-1].T))

    @property
    def corner(self) -> FloatArray:
        """(2,) x and y of the south-west post."""
        x, y = self.elevation.origin
        return np.array([x, y - (len(self.elevation.heights) - 1) * self.elevation.spacing[1]])


def _warnings(elevation: Elevation, holed: int, absent: int, tile: int) -> Iterator[str]:
    missing, whole = elevation.missing, elevation.heights.size
    if missing == 0:
        return
    noun = "post has" if missing == 1 else "posts have"
    told = f"{missing:,} of {whole:,} {noun} no height; nothing is hidden there"
    if holed:
        told += f", and {holed:,} tile{'s' if holed > 1 else ''} with such posts always visible"
    if absent:
        told += f", and {absent:,} without any surface left out"
    yield told


def _tile_mesh(
    elevation: Elevation, squares: BoolArray, place: tuple[slice, slice], base: float
) -> TriangleMesh:
    """The surface of a tile, and sides down to ``base`` where it borders on no surface."""
    (dx, dy), (x, y) = elevation.spacing, elevation.origin
    ny, nx = elevation.heights.shape
    rows, columns = (
        np.arange(ny)[place[0].start : place[0].stop + 1],
        np.arange(nx)[place[1].start : place[1].stop + 1],
    )
    across, down = np.meshgrid(columns, rows)
    heights = elevation.heights[rows[:, None], columns]
    points = np.stack([x + dx * across, y - dy * down, heights], axis=2).reshape(-1, 3)
    number = np.arange(len(points)).reshape(heights.shape)
    north_west, north_east = number[:-1, :-1], number[:-1, 1:]
    south_west, south_east = number[1:, :-1], number[1:, 1:]
    own = squares[place]
    # The square at (row, column) of the tile is at (row + 1, column + 1) here.
    around = np.pad(squares, 1)[
        rows[0] : rows[0] + own.shape[0] + 2, columns[0] : columns[0] + own.shape[1] + 2
    ]
    faces = [
        np.stack([south_west, south_east, north_east], axis=2)[own],
        np.stack([south_west, north_east, north_west], axis=2)[own],
    ]
    sides = (
        (around[:-2, 1:-1], north_east, north_west), (around[2:, 1:-1], south_west, south_east),
        (around[1:-1, :-2], north_west, south_west), (around[1:-1, 2:], south_east, north_east),
    )  # fmt: skip
    count = len(points)
    for neighbour, one, two in sides:
        border = own & ~neighbour
        a, b = one[border], two[border]
        faces += [np.stack([a, a + count, b], axis=1), np.stack([b, a + count, b + count], axis=1)]
    below = points.copy()
    below[:, 2] = base
    vertices, triangles = np.concatenate([points, below]), np.concatenate(faces)
    used, triangles = np.unique(triangles, return_inverse=True)
    return TriangleMesh(
        np.ascontiguousarray(vertices[used]), triangles.reshape(-1, 3).astype(np.int32)
    )


def terrain_field(
    terrain: Terrain, upright: UprightScene, cell: float, viewers: FloatArray
) -> HeightField:
    """The heights of a terrain, as
    :func:`~simplifier.visibility.solid.height_field.height_field` has them of a scene.

    ``upright`` is the terrain's, ``cell`` the edge of a pixel, ``viewers`` (2, 2) the plan of where
    they are.

    Where none of them is beyond the terrain no line of sight is: its plan is convex.  It may be
    taken for solid there, so that hills at its border lose nothing of their width.
    """
    low, shape = raster_over(upright, cell, viewers)
    spacing = np.array(terrain.elevation.spacing)
    first = (terrain.corner - upright.origin[:2] - low) / cell
    inner = np.full(shape, -np.inf)
    starts = np.zeros(inner.size + 1, dtype=np.int32)
    heights = terrain.heights - upright.origin[2]
    end = low + (first + (np.array(heights.shape) - 1) * spacing / cell) * cell
    within = (viewers[0] >= low + first * cell).all() and (viewers[1] <= end).all()
    beyond = float(heights[terrain.posts].max()) if within else -np.inf

    def measure(objects: IntArray, tops: FloatArray, fill: bool) -> None:
        measure_pixels(
            heights, terrain.known, first, spacing / cell, terrain.tile, terrain.numbers, beyond,
            inner, starts, objects, tops, fill,
        )  # fmt: skip

    measure(np.empty(0, dtype=np.int32), np.empty(0), False)
    np.cumsum(starts, dtype=np.int32, out=starts)
    objects, tops = np.empty(starts[-1], dtype=np.int32), np.empty(starts[-1])
    measure(objects, tops, True)
    object_tops = rounded_up(tops)
    del tops  # before as much is taken to round the heights
    return HeightField(
        low, cell, rounded_down(inner), starts, objects, object_tops,
        upright.boxes[:, :, :2], 0.0, np.ones(len(terrain.holed), np.bool_),
        holed=terrain.holed, beyond=float(rounded_down(np.array(beyond))),
    )  # fmt: skip
