"""Two ways to shrink occluders of any shape for a view cell, beside shafts that need neither.

``published``  faces that move inwards, by Yilmaz and Gudukbay, "Conservative occlusion culling for
               urban visualization using a slice-wise data structure" (2007), section 4.1: a vertex
               moves against its normal, so far that each of its faces moves by what a viewer can
               move from the cell's middle; faces whose paths meet are dropped.
``closed``     the same of closed pieces alone, wound outwards: a sheet has no inside to move into.
``grid``       voxels that closed pieces fill, eroded by half the cell to all sides.
``shafts``     ``--method slice-wise``, from the whole cell at once.

The first three are looked at from the middle of a cell alone, along the same lines to points of all
objects.  What is seen from other points of the cell, past the scene as it is, tells what they may
not hide.  The paper leaves open what normal a vertex has (here the mean of its faces' by their
angles), and whether faces with a corner in common meet (here they do not, as in its figure 14).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from bench.record import Row
from bench.shrunk_face_kernels import Boxed, blocked_by_voxels, blocked_lines, drop_crossing
from bench.visibility_rooms import ASSETS, INTERIORS, tiles
from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.view_cells import ViewCells
from simplifier.io.scene import load_scene
from simplifier.options.simplify import Axis
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.find import find_pvs
from simplifier.visibility.placing.cells import place_cells
from simplifier.visibility.slices.slices import AXES, Grid, slices_of
from simplifier.visibility.solid.closed_pieces import closed_pieces, is_within

EDGES = (0.1, 0.3, 1.0)
"""Of cells that are cubes, metres."""

_SLICES = 8  # along each axis of an object's box
_FLAT = 0.05  # cosine: a vertex whose faces are further apart cannot be moved out of their way
_THIN = 1e-6  # of its surface to the power of 1.5: a closed piece of a smaller volume is a sheet
_FINE = 0.2  # of the epsilon: a voxel

Triangles = FloatArray
"""(m, 3, 3) float64."""

Blocks = Callable[[FloatArray, FloatArray], BoolArray]
"""Eye (3,) and points (k, 3) -> which of the lines between them are blocked, (k,)."""


@dataclass(frozen=True, eq=False)
class Rooms:
    """A scene as triangles (m, 3, 3), upright, the object of each (m,), and which are of closed
    pieces with a volume (m,), which are wound outwards; points (k, 3) of all objects, and the
    object of each (k,).
    """

    upright: UprightScene
    triangles: Triangles
    objects: NDArray[np.int64]
    closed: BoolArray
    points: FloatArray
    owners: NDArray[np.int64]

    @classmethod
    def of(cls, upright: UprightScene, samples: int) -> Rooms:
        generator = np.random.default_rng(0)
        soups, points = [], []
        for index in range(len(upright.scene)):
            mesh = upright.scene.joined([index])
            own = (mesh.vertices[:, upright.order] - upright.origin)[mesh.faces]
            soups.append(own)
            areas = np.linalg.norm(np.cross(own[:, 1] - own[:, 0], own[:, 2] - own[:, 0]), axis=1)
            chosen = own[generator.choice(len(own), samples, p=areas / areas.sum())]
            weights = generator.dirichlet(np.ones(3), samples)
            points.append(np.einsum("ij,ijk->ik", weights, chosen))
        triangles, closed = _outwards(np.concatenate(soups))
        objects = np.repeat(np.arange(len(soups)), [len(own) for own in soups])
        owners = np.repeat(np.arange(len(soups)), samples)
        return cls(upright, triangles, objects, closed, np.concatenate(points), owners)

    def is_free(self, places: FloatArray) -> BoolArray:
        """(k,) which places (k, 3) are in no closed piece."""
        points = self.triangles[self.closed].reshape(-1, 3)
        corners = np.arange(len(points)).reshape(-1, 3)
        return np.asarray(
            ~is_within(places, points, corners, closed_pieces(points, corners, -np.inf))
        )


def _outwards(triangles: Triangles) -> tuple[Triangles, BoolArray]:
    """Triangles with those of closed pieces wound outwards, and which are of one with a volume:
    of a sheet that is drawn from both sides faces would move out.
    """
    corners = np.arange(3 * len(triangles)).reshape(-1, 3)
    pieces = closed_pieces(triangles.reshape(-1, 3), corners, -np.inf)
    closed = np.flatnonzero(pieces >= 0)
    a, b, c = (triangles[closed] - triangles.mean(axis=(0, 1))).swapaxes(0, 1)
    volumes = np.bincount(pieces[closed], (a * np.cross(b, c)).sum(axis=1) / 6.0)[pieces[closed]]
    areas = np.bincount(pieces[closed], _areas(triangles[closed]))[pieces[closed]]
    turned = closed[volumes < 0.0]
    triangles[turned] = triangles[turned, ::-1]
    solid = np.zeros(len(triangles), dtype=np.bool_)
    solid[closed] = np.abs(volumes) > _THIN * areas**1.5
    return triangles, solid


def moved_faces(triangles: Triangles, distance: float) -> Triangles:
    """The faces of one object, moved inwards by a distance at least, but for those that meet."""
    points, place = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    faces = place.reshape(-1, 3)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    whole = lengths > 0.0
    faces, normals = faces[whole], normals[whole] / lengths[whole, None]
    inwards = np.zeros_like(points)
    angles = _angles(points[faces])
    np.add.at(inwards, faces.ravel(), -(angles[..., None] * normals[:, None]).reshape(-1, 3))
    inwards /= np.maximum(np.linalg.norm(inwards, axis=1), 1e-300)[:, None]
    least = np.full(len(points), np.inf)
    np.minimum.at(least, faces.ravel(), -(inwards[faces] * normals[:, None]).sum(axis=2).ravel())
    ends = points + inwards * (distance / np.maximum(least, _FLAT))[:, None]
    after = ends[faces]
    turned = np.cross(after[:, 1] - after[:, 0], after[:, 2] - after[:, 0])
    kept = (least[faces] > _FLAT).all(axis=1) & ((turned * normals).sum(axis=1) > 0.0)
    paths = np.concatenate([points[faces], after], axis=1)
    order = np.argsort(paths[:, :, 0].min(axis=1), kind="stable")
    crossing = np.zeros(len(faces), dtype=np.bool_)
    drop_crossing(np.ascontiguousarray(paths[order]), faces[order], crossing)
    kept[order] &= ~crossing
    return np.asarray(after[kept])


def by_moved_faces(rooms: Rooms, edge: float, closed: bool) -> tuple[Blocks, Row]:
    """How lines are blocked; ``seconds`` that took, ``left`` of the surface, and the share of that
    which is ``outside`` of closed pieces, both 0 to 1.
    """
    begin = time.process_time()
    wanted = rooms.closed if closed else np.ones(len(rooms.closed), dtype=np.bool_)
    reach = 0.5 * edge * 3.0**0.5
    parts = [
        moved_faces(rooms.triangles[wanted & (rooms.objects == index)], reach)
        for index in np.unique(rooms.objects[wanted]).tolist()
    ]
    left = np.concatenate([np.empty((0, 3, 3)), *parts])
    blocks = by_triangles(left)
    seconds = time.process_time() - begin
    areas = _areas(left)
    outside = areas[rooms.is_free(left.mean(axis=1))].sum() / max(areas.sum(), 1e-300)
    return blocks, {
        "seconds": seconds,
        "left": float(areas.sum() / _areas(rooms.triangles).sum()),
        "outside": float(outside),
    }


def by_triangles(triangles: Triangles) -> Blocks:
    boxed = Boxed.of(triangles)

    def blocks(eye: FloatArray, points: FloatArray) -> BoolArray:
        found = np.zeros(len(points), dtype=np.bool_)
        blocked_lines(eye, points, boxed.boxes, boxed.triangles, found)
        return found

    return blocks


def by_eroded_grid(
    rooms: Rooms, edge: float, cell: float, viewers: ViewCells
) -> tuple[Blocks, Row]:
    """How lines are blocked; ``seconds`` that took, and what is ``left`` of the volume that closed
    pieces fill, 0 to 1.
    """
    begin = time.process_time()
    grid = Grid.around(rooms.upright, cell)
    slices = slices_of(rooms.upright, grid, viewers)
    solid = np.ones(tuple(grid.shape), dtype=np.bool_)
    for axes, ats, masks in zip(AXES, slices.ats, slices.covered, strict=True):
        middles = np.abs(ats[:, None] - (np.arange(grid.shape[axes[0]]) + 0.5)).argmin(axis=0)
        turned = solid.transpose(axes)
        turned &= masks[middles]
    window = 2 * int(np.ceil(0.5 * edge / cell)) + 1
    eroded = ndimage.minimum_filter(solid, window, mode="constant", cval=False)

    seconds = time.process_time() - begin

    def blocks(eye: FloatArray, points: FloatArray) -> BoolArray:
        found = np.zeros(len(points), dtype=np.bool_)
        blocked_by_voxels(grid.to_grid(eye), grid.to_grid(points), eroded, found)
        return found

    return blocks, {"seconds": seconds, "left": float(eroded.sum() / max(solid.sum(), 1))}


def _angles(triangles: Triangles) -> FloatArray:
    """(m, 3) at each corner."""
    edges = np.roll(triangles, -1, axis=1) - triangles
    edges /= np.maximum(np.linalg.norm(edges, axis=2), 1e-300)[..., None]
    cosines = -(edges * np.roll(edges, 1, axis=1)).sum(axis=2)
    return np.asarray(np.arccos(np.clip(cosines, -1.0, 1.0)))


def _areas(triangles: Triangles) -> FloatArray:
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return np.asarray(0.5 * np.linalg.norm(cross, axis=1))


def shrunk_face_rows(
    interiors: Sequence[tuple[str, Axis, float]] = INTERIORS,
    edges: Sequence[float] = EDGES,
    count: int = 8,
    samples: int = 32,
) -> Iterator[Row]:
    """A row a scene, an edge and a way; ``count`` cells, ``samples`` points of each object.

    Seconds are those of all processors together, to shrink once for all cells; of shafts those for
    the sets.
    """
    moved_faces(np.eye(3)[None] + np.arange(2.0)[:, None, None], 0.1)  # the kernel is compiled
    for name, up, epsilon in interiors:
        scene = load_scene(ASSETS / name)
        upright = UprightScene.of(tiles(scene) if len(scene) == 1 else scene, up)
        rooms = Rooms.of(upright, samples)
        options = PvsOptions(
            up=up, method="slice-wise", cell_size=1.0, epsilon=epsilon, eye_height=1.6
        )
        places = place_cells(upright, "floors", options)
        lots = np.random.default_rng(0).permutation(len(places))
        eyes = 0.5 * (places.low + places.high)[lots[: 4 * count]]
        eyes[:, 2] = places.high[lots[: 4 * count], 2]
        eyes = eyes[rooms.is_free(eyes)][:count]
        for edge in edges:
            yield from edge_rows(name, rooms, eyes, edge, options)


def edge_rows(
    name: str, rooms: Rooms, eyes: FloatArray, edge: float, options: PvsOptions
) -> Iterator[Row]:
    """A row a way, for cubes of an edge around eyes (c, 3)."""
    cells = ViewCells.boxes(eyes - 0.5 * edge, eyes + 0.5 * edge)
    seen = np.array([seen_points(rooms, eye, edge) for eye in eyes])
    seen_objects = _by_object(rooms, seen)
    ways: dict[str, Callable[[], tuple[Blocks, Row]]] = {
        "published": lambda: by_moved_faces(rooms, edge, closed=False),
        "closed": lambda: by_moved_faces(rooms, edge, closed=True),
        "grid": lambda: by_eroded_grid(rooms, edge, _FINE * options.reach, cells),
    }
    common = {"scene": name, "edge": edge, "cells": len(eyes), "objects": len(rooms.upright.scene)}
    for way, shrink in ways.items():
        blocks, figures = shrink()
        open_ = np.array([~blocks(eye, rooms.points) for eye in eyes])
        sets = _by_object(rooms, open_)
        yield {
            **common, "way": way, **figures,
            "visible": sets.sum(axis=1).mean(), "seen": seen_objects.sum(axis=1).mean(),
            "slices_hidden": _slices_hidden(rooms, open_),
            "leaks": int((seen_objects & ~sets).sum()),
        }  # fmt: skip
    begin = time.process_time()
    pvs = find_pvs(rooms.upright, cells, options).pvs
    sets = np.array([pvs.visible(cell) for cell in range(len(eyes))])
    yield {
        **common, "way": "shafts", "seconds": time.process_time() - begin,
        "visible": sets.sum(axis=1).mean(), "seen": seen_objects.sum(axis=1).mean(),
        "leaks": int((seen_objects & ~sets).sum()),
    }  # fmt: skip


def seen_points(rooms: Rooms, eye: FloatArray, edge: float) -> BoolArray:
    """(k,) which points are certainly seen from the middle, a corner or elsewhere in a cell."""
    corners = np.stack(np.meshgrid(*[[-0.5, 0.5]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    some = np.random.default_rng(1).uniform(-0.5, 0.5, (7, 3))
    places = eye + edge * np.concatenate([np.zeros((1, 3)), corners, some])
    blocks = by_triangles(rooms.triangles)
    seen: BoolArray = np.zeros(len(rooms.points), dtype=np.bool_)
    for place in places[rooms.is_free(places)]:
        seen |= ~blocks(place, rooms.points)
    return seen


def _by_object(rooms: Rooms, points: BoolArray) -> BoolArray:
    """(c, n) which objects have any of their points (c, k)."""
    return np.asarray(points.reshape(len(points), len(rooms.upright.scene), -1).any(axis=2))


def _slices_hidden(rooms: Rooms, open_: BoolArray) -> float:
    """The share of the objects' slices along three axes that have points, none of them open."""
    low, high = rooms.upright.boxes[rooms.owners].swapaxes(0, 1)
    wide = high > low  # a flat box is all in its first slice
    share = np.where(wide, (rooms.points - low) / np.where(wide, high - low, 1.0), 0.0)
    places = np.clip((share * _SLICES).astype(np.int64), 0, _SLICES - 1)
    hidden = total = 0
    for axis in range(3):
        keys = rooms.owners * _SLICES + places[:, axis]
        there = np.bincount(keys, minlength=_SLICES * len(rooms.upright.scene)) > 0
        for one in open_:
            shown = np.bincount(keys[one], minlength=len(there)) > 0
            hidden += int((there & ~shown).sum())
            total += int(there.sum())
    return hidden / total
