"""Scene -> Parts: objects larger than a node's worth, cut into pieces that nodes can hold.

A tree over boxes does nothing for a level that is one mesh, or for a building whose columns are one
object: their boxes overlap all others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray, IntArray, TriangleMesh
from simplifier.geometry.scene import Scene, scales

SHARE = 24
"""A piece is no longer than this part of the scene's longest edge, where it can be cut at all."""

LEAST = 64
"""Triangles that are not cut further: a piece has its own box to test, which costs as much."""


@dataclass(frozen=True, eq=False)
class Parts:
    """What leaves of the tree hold, and what is tested for being hidden.

    ``scene``      a scene whose objects are the parts; those of an object follow each other, and
                   are called as it is with a number, from "<name>/0" on.
    ``object_of``  (p,) int32: the object that each part belongs to.
    ``bounds``     (p, 2, 3) lowest and highest corner of each part's box, world units.
    """

    scene: Scene
    object_of: IntArray
    bounds: FloatArray


def split_large(scene: Scene, share: int = SHARE, least: int = LEAST) -> Parts:
    """Cut large objects into pieces no longer than 1 / ``share`` of the scene's longest edge.

    By halves of the box, each triangle whole and on the side of its centroid, down to ``least``
    triangles.  Lengths are those along the mesh's axes, as its most enlarged instance shows them.
    Instances of a mesh are cut alike, so their pieces are still instances.

    ``scene`` has one object or more.
    """
    bounds = scene.bounds()
    longest = float((bounds[:, 1].max(axis=0) - bounds[:, 0].min(axis=0)).max()) / share
    stretch = np.zeros(len(scene.meshes))
    np.maximum.at(stretch, scene.mesh_of, scales(scene.transforms))
    pieces = [
        _pieces(mesh, longest / scale, least) if scale > 0.0 else [mesh]
        for mesh, scale in zip(scene.meshes, stretch, strict=True)
    ]
    counts = np.array([len(some) for some in pieces])
    of_objects = counts[scene.mesh_of]
    object_of = np.repeat(np.arange(len(scene), dtype=np.int32), of_objects)
    number = np.arange(len(object_of)) - _starts(of_objects)[object_of]
    parts = Scene(
        tuple(piece for some in pieces for piece in some),
        tuple(f"{scene.names[index]}/{k}" for index, k in zip(object_of, number, strict=True)),
        (_starts(counts)[scene.mesh_of[object_of]] + number).astype(np.int32),
        scene.transforms[object_of],
    )
    boxes, cut = bounds[object_of], (of_objects > 1)[object_of]
    if cut.any():
        boxes[cut] = parts.some(cut).bounds()
    return Parts(parts, object_of, boxes)


def _starts(counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Where each of some runs begins that lie end to end."""
    return np.asarray(np.cumsum(counts) - counts)


def _pieces(mesh: TriangleMesh, longest: float, least: int) -> list[TriangleMesh]:
    if len(mesh.faces) <= least or mesh.extent.max() <= longest:
        return [mesh]
    corners = mesh.vertices[mesh.faces]
    lows, highs = corners.min(axis=1), corners.max(axis=1)
    made = []
    waiting = [np.arange(len(mesh.faces))]
    while waiting:
        some = waiting.pop()
        low, high = lows[some].min(axis=0), highs[some].max(axis=0)
        if len(some) <= least or (high - low).max() <= longest:
            made.append(_piece(mesh, some))
        else:
            waiting += _halves(some, corners, low, high)
    return made


def _halves(
    some: NDArray[np.int64], corners: FloatArray, low: FloatArray, high: FloatArray
) -> list[NDArray[np.int64]]:
    """The upper half and the lower; by number where all centroids lie on one side."""
    axis = int(np.argmax(high - low))
    centres = corners[some, :, axis].mean(axis=1)
    upper = centres >= 0.5 * (low[axis] + high[axis])
    if upper.all() or not upper.any():
        upper = np.ones(len(some), dtype=np.bool_)
        upper[np.argsort(centres, kind="stable")[: len(some) // 2]] = False
    return [some[upper], some[~upper]]


def _piece(mesh: TriangleMesh, some: NDArray[np.int64]) -> TriangleMesh:
    used, corners = np.unique(mesh.faces[np.sort(some)], return_inverse=True)
    faces = np.ascontiguousarray(corners.reshape(-1, 3), dtype=np.int32)
    return TriangleMesh(mesh.vertices[used], faces)
