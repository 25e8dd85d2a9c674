"""Scene -> Scene with the boxes of its largest objects, so that a screen can show all of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.geometry.solid import BoolArray

_CORNERS = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
_SIDES = np.array(
    [[0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4],
     [2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5]], dtype=np.int32,
)  # fmt: skip


def with_boxes(scene: Scene, most_triangles: int) -> tuple[Scene, NDArray[np.int64]]:
    """The scene, and (n,) int64 how many triangles each of its objects has now.

    Objects that would go beyond ``most_triangles`` become boxes, the largest first.
    """
    counts = scene.triangle_counts
    small = np.argsort(counts, kind="stable")
    boxed = len(_SIDES) * np.arange(len(scene) - 1, -1, -1)  # of all that are larger
    whole = np.empty(len(scene), dtype=np.bool_)
    whole[small] = np.cumsum(counts[small]) + boxed <= most_triangles
    whole |= counts <= len(_SIDES)
    return _boxed(scene, ~whole), np.where(whole, counts, len(_SIDES))


def _boxed(scene: Scene, boxed: BoolArray) -> Scene:
    """The scene with the boxes of some objects (n,) in place of their meshes."""
    low, high = scene.bounds()[boxed].swapaxes(0, 1)
    transforms, mesh_of = scene.transforms.copy(), scene.mesh_of.copy()
    transforms[boxed] = np.eye(4)
    transforms[boxed, :3, 3] = low
    transforms[np.flatnonzero(boxed)[:, None], range(3), range(3)] = high - low
    mesh_of[boxed] = len(scene.meshes)
    box = TriangleMesh(_CORNERS.copy(), _SIDES.copy())
    return Scene((*scene.meshes, box), scene.names, mesh_of, transforms)
