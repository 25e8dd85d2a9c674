"""Three ways to shrink occluders for a piece of edge and a pixel, beside each other.

``pixels``    erosion of the raster of heights, which is what cull maps use.
``outlines``  erosion of exact outlines, each roof's height for itself, then the raster: for flat
              roofs.  Wonka et al. (2000), section 4.4.
``exterior``  heights that the enlarged exterior leaves, which stands on roofs and on the ground:
              the lowest point of all roofs that the piece and the pixel reach.  Section 4.3.

All three are right; the latter two waste no part of a pixel.
"""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import NDArray

from bench.record import Row
from bench.visibility_city import generated_city, street_cells
from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.geometry.view_cells import ViewCells
from simplifier.visibility.checking.check import viewpoints
from simplifier.visibility.checking.exact_view import prisms_of, seen_from
from simplifier.visibility.cull_maps.coded_field import HeightCodes, in_squares
from simplifier.visibility.cull_maps.cull_map import CullMaps, see_by_cull_maps
from simplifier.visibility.cull_maps.erosion import Window, shrunk
from simplifier.visibility.solid.height_field import HeightField, height_field
from simplifier.visibility.solid.object_heights import covered_by

Heights = NDArray[np.float32]
Shrinking = Callable[["Roofs", HeightField, Window], Heights]

_EAVES = 0.7  # of the height of a house with a gable


@dataclass(frozen=True, eq=False)
class Roofs:
    """Triangles (n, 3, 3) of roofs in the scene's units, upright, and the block of each (n,).

    ``plans`` of the blocks: houses that touch are one.
    """

    triangles: FloatArray
    blocks: NDArray[np.int64]
    plans: NDArray[np.object_]

    @classmethod
    def of(cls, upright: UprightScene) -> Roofs:
        faces = []
        for index in range(len(upright.scene)):
            mesh = upright.scene.joined([index])
            corners = (mesh.vertices[:, upright.order] - upright.origin)[mesh.faces]
            normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            faces.append(corners[(normals[:, 2] > 0.0) & (corners[:, :, 2].min(axis=1) > 0.0)])
        triangles = np.concatenate(faces)
        outlines = shapely.polygons(triangles[:, :, :2])
        plans = shapely.get_parts(shapely.union_all(outlines))
        middles = shapely.points(triangles[:, :, :2].mean(axis=1))
        face, block = shapely.STRtree(plans).query(middles, predicate="within")
        return cls(triangles[face], block, plans)


def by_pixels(roofs: Roofs, heights: HeightField, window: Window) -> Heights:
    return shrunk(heights.inner, window)


def by_outlines(roofs: Roofs, heights: HeightField, window: Window) -> Heights:
    """Raises :class:`ValueError` for a roof that is not flat."""
    tops = roofs.triangles[:, :, 2]
    if (tops.min(axis=1) < tops.max(axis=1)).any():
        raise ValueError("a roof is not flat")
    result = np.full(heights.shape, -np.inf, dtype=np.float32)
    reached = _reached(window)
    for block in range(len(roofs.plans)):
        own = roofs.blocks == block
        outlines = shapely.polygons(_in_pixels(roofs.triangles[own, :, :2], heights))
        for top in np.unique(tops[own, 0]):
            plan = shapely.union_all(outlines[tops[own, 0] >= top])
            place, covered = _raster(eroded(plan, reached), heights)
            result[place] = np.where(covered, np.maximum(result[place], top), result[place])
    return result


def by_exterior(roofs: Roofs, heights: HeightField, window: Window) -> Heights:
    """For roofs of any slope, none of which hangs over another."""
    result = np.full(heights.shape, -np.inf, dtype=np.float32)
    reached = _reached(window)
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    around = (shapely.get_coordinates(reached)[:, None] + corners).reshape(-1, 2)
    around = shapely.get_coordinates(shapely.convex_hull(shapely.multipoints(around)))
    for block, plan in enumerate(roofs.plans):
        own = roofs.triangles[roofs.blocks == block].copy()
        own[:, :, :2] = _in_pixels(own[:, :, :2], heights)
        moved = shapely.transform(plan, lambda points: _in_pixels(points, heights))
        place, covered = _raster(eroded(moved, reached), heights)
        pixels = np.argwhere(covered) + np.array([place[0].start, place[1].start])
        if len(pixels) == 0:
            continue
        areas = shapely.polygons(pixels[:, None] + around)
        outlines = shapely.polygons(own[:, :, :2])
        which, face = shapely.STRtree(outlines).query(areas, predicate="intersects")
        parts = shapely.intersection(areas[which], outlines[face])
        points, part = shapely.get_coordinates(parts, return_index=True)
        low = np.full(len(pixels), np.inf)
        np.minimum.at(low, which[part], _height_at(own[face[part]], points))
        result[tuple(pixels.T)] = low
    return result


def eroded(plan: shapely.Geometry, reached: shapely.Geometry) -> shapely.Geometry:
    """The points from which all of a convex set, symmetric about 0, lies in a plan."""
    points, ring = shapely.get_coordinates(
        shapely.get_rings(shapely.get_parts(plan)), return_index=True
    )
    same = ring[1:] == ring[:-1]
    ends = np.stack([points[:-1][same], points[1:][same]], axis=1)
    swept = (ends[:, :, None] + shapely.get_coordinates(reached)[:-1]).reshape(len(ends), -1, 2)
    hulls = shapely.convex_hull(shapely.multipoints(swept))
    left: shapely.Geometry = plan.difference(shapely.union_all(hulls))
    return left


def _reached(window: Window) -> shapely.Geometry:
    """The hull of the piece of edge and of a pixel to all sides, in pixels; of a box's window."""
    ends = np.zeros((2, 2))
    ends[:, window.axis] = window.runs[0]
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    return shapely.convex_hull(shapely.multipoints(np.concatenate([ends, square])))


def _in_pixels(points: FloatArray, heights: HeightField) -> FloatArray:
    return np.asarray((points - heights.low) / heights.cell)


def _raster(plan: shapely.Geometry, heights: HeightField) -> tuple[tuple[slice, slice], FloatArray]:
    """A window of the field, and which of its pixels lie in a plan wholly."""
    if plan.is_empty:
        return (slice(0, 0), slice(0, 0)), np.zeros((0, 0), np.bool_)
    bounds = np.array(plan.bounds).reshape(2, 2)
    first = np.maximum(np.floor(bounds[0]).astype(np.int64) - 1, 0)
    last = np.minimum(np.floor(bounds[1]).astype(np.int64) + 2, heights.shape)
    covered, _ = covered_by(plan, first, tuple(last - first))
    return (slice(first[0], last[0]), slice(first[1], last[1])), covered


def _height_at(triangles: FloatArray, points: FloatArray) -> FloatArray:
    a, b, c = triangles.swapaxes(0, 1)
    normal = np.cross(b - a, c - a)
    return np.asarray(a[:, 2] - ((points - a[:, :2]) * normal[:, :2]).sum(axis=1) / normal[:, 2])


@dataclass(frozen=True, eq=False, kw_only=True)
class _Maps(CullMaps):
    """Cull maps whose occluders are shrunk in another way; ``cost`` takes seconds and bytes."""

    roofs: Roofs
    way: Shrinking
    cost: list[tuple[float, int]] = field(default_factory=list)

    def erosion(self, window: Window) -> HeightCodes:
        tracemalloc.start()
        begin = time.perf_counter()
        heights = self.way(self.roofs, self.field, window)
        self.cost.append((time.perf_counter() - begin, tracemalloc.get_traced_memory()[1]))
        tracemalloc.stop()
        return in_squares(self.coded.codes.down(heights))


def gabled(city: Scene) -> Scene:
    """The same houses with gables: eaves are lower than the ridge, which runs along x."""
    plan = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    points = [(*at, z) for z in (0.0, _EAVES) for at in plan]
    points += [(0.0, 0.5, 1.0), (1.0, 0.5, 1.0)]
    sides = [(0, 1, 5, 4), (2, 3, 7, 6), (3, 2, 1, 0), (4, 5, 9, 8), (6, 7, 8, 9)]
    sides += [(1, 2, 6, 5), (3, 0, 4, 7)]
    faces = [part for a, b, c, d in sides for part in ((a, b, c), (a, c, d))]
    faces += [(5, 6, 9), (7, 4, 8)]
    mesh = TriangleMesh.from_soup(np.array(points), np.array(faces))
    return Scene((mesh,), city.names, city.mesh_of, city.transforms)


def shrinking_rows(blocks: int = 6, count: int = 60, epsilon: float = 5.0) -> Iterator[Row]:
    """A row a scene and a way: flat roofs and gables, boxes of 10 m in the streets."""
    city = generated_city(blocks)
    streets = street_cells(city, count)
    for name, scene in (("flat", city), ("gables", gabled(city))):
        upright = UprightScene.of(scene, "z")
        cells = ViewCells.boxes(streets.low - upright.origin, streets.high - upright.origin)
        plan = np.array([cells.low[:, :2].min(axis=0), cells.high[:, :2].max(axis=0)])
        heights = height_field(upright, 0.2 * epsilon, plan)
        seen = _seen(upright, cells)
        roofs = Roofs.of(upright)
        for way in (by_pixels, by_outlines, by_exterior):
            if way is by_outlines and name == "gables":
                continue
            maps = _Maps(heights, 2.0 * epsilon, roofs=roofs, way=way)
            sets, _ = see_by_cull_maps(maps, cells)
            seconds, most = np.array(maps.cost).T
            yield {
                "roofs": name,
                "way": way.__name__.removeprefix("by_"),
                "epsilon": epsilon,
                "objects": len(scene),
                "sets_to_seen": float(sets.sum() / seen.sum()),
                "leaks": int((seen & ~sets).sum()),
                "seconds": float(seconds.sum()),
                "MiB": float(most.max()) / 2**20,
            }


def _seen(upright: UprightScene, cells: ViewCells) -> NDArray[np.bool_]:
    """(c, n) what is certainly seen from 60 points of each cell."""
    prisms = prisms_of(upright.scene, "z")
    shift = upright.origin - prisms.origin
    generator = np.random.default_rng(0)
    return np.array(
        [
            ~np.isnan(seen_from(prisms, viewpoints(cells, cell, 60, generator) + shift)).all(axis=0)
            for cell in range(len(cells))
        ]
    )
