"""Scene -> triangles with z up and the origin nearby, some objects at a time."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.scene import Scene
from simplifier.options import Axis

_BATCH = 1 << 20  # triangles at once
_DOOR = re.compile(r"(?<![a-z])(ifc)?door(s|leaf)?(?![a-z])")


@dataclass(frozen=True, eq=False)
class UprightScene:
    """A scene, its boxes, and the way to its upright space.

    ``order``   (3,) int: which world axis is upright x, y, z; a rotation.
    ``origin``  (3,) float64: the box's low corner, in upright axes; map coordinates keep their
                digits this way.
    ``boxes``   (n, 2, 3) float64: of the objects, upright space.
    """

    scene: Scene
    order: IntArray
    origin: FloatArray
    boxes: FloatArray

    @classmethod
    def of(cls, scene: Scene, up: Axis) -> UprightScene:
        axis = "xyz".index(up)
        order = np.array([(axis + 1) % 3, (axis + 2) % 3, axis], dtype=np.int32)
        boxes = scene.bounds()[:, :, order]
        origin = boxes[:, 0].min(axis=0)
        return cls(scene, order, origin, boxes - origin)

    @property
    def extent(self) -> FloatArray:
        """(3,) the high corner of the box around all."""
        return np.asarray(self.boxes[:, 1].max(axis=0))

    def to_world(self, points: FloatArray) -> FloatArray:
        """Upright places (n, 3) to the world."""
        return self.directions_to_world(points + self.origin)

    def directions_to_world(self, directions: FloatArray) -> FloatArray:
        """Upright directions (n, 3) to the world."""
        result = np.empty_like(directions)
        result[:, self.order] = directions
        return result

    def triangles(self, low: FloatArray, high: FloatArray) -> Iterator[tuple[FloatArray, IntArray]]:
        """Vertices and faces of the objects that reach into a box, in upright space."""
        inside = (self.boxes[:, 1] >= low).all(axis=1) & (self.boxes[:, 0] <= high).all(axis=1)
        objects = np.nonzero(inside)[0].astype(np.int32)
        if len(objects) == 0:
            return
        batch = np.cumsum(self.scene.triangle_counts[objects]) // _BATCH
        for some in np.split(objects, np.nonzero(np.diff(batch))[0] + 1):
            mesh = self.scene.joined(some)
            yield np.ascontiguousarray(mesh.vertices[:, self.order] - self.origin), mesh.faces

    def without_doors(self) -> UprightScene:
        """All but the objects whose names say door: one may walk through them."""
        kept = np.array([not _is_door(name) for name in self.scene.names])
        return self if kept.all() or not kept.any() else self._some(kept)

    def _some(self, kept: NDArray[np.bool_]) -> UprightScene:
        scene = self.scene
        names = tuple(name for name, keep in zip(scene.names, kept, strict=True) if keep)
        some = replace(
            scene, names=names, mesh_of=scene.mesh_of[kept], transforms=scene.transforms[kept]
        )
        return replace(self, scene=some, boxes=self.boxes[kept])


def _is_door(name: str) -> bool:
    return _DOOR.search(name.lower()) is not None
