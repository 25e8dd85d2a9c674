"""Camera -> Culled, by occluders that were made elsewhere: a scene of them, and no tree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simplifier.culling.culler import Culled
from simplifier.culling.depth_buffer import DepthBuffer, Verdict, in_frustum
from simplifier.errors import SceneError
from simplifier.geometry.camera import Camera
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.scene import Scene
from simplifier.geometry.solid import BoolArray
from simplifier.hierarchy.occluder_tree import NEAR


@dataclass(frozen=True, eq=False)
class _Placed:
    """An occluder in the world."""

    vertices: FloatArray
    faces: IntArray


class GivenCuller:
    """Culls by occluders as they are: from near to far, each that is not hidden by then.

    They count as exact, so nothing answers for what they cover beside their objects but the wrong
    pixels that are counted.  ``Culled.drawn`` has their places in the scene of occluders.
    """

    pixel_error = 0.0

    def __init__(self, occluders: Scene, part_boxes: FloatArray, buffer: DepthBuffer) -> None:
        """``part_boxes`` (p, 2, 3) of what is tested, world units.

        Raises :class:`SceneError` where no occluder reaches into any of them.
        """
        self.buffer = buffer
        self._part_boxes = np.ascontiguousarray(part_boxes)
        self._boxes = np.ascontiguousarray(occluders.bounds())
        low, high = self._boxes[:, 0].min(axis=0), self._boxes[:, 1].max(axis=0)
        whole = part_boxes[:, 0].min(axis=0), part_boxes[:, 1].max(axis=0)
        if (low > whole[1]).any() or (high < whole[0]).any():
            raise SceneError(
                "the occluders lie beside the scene",
                remedy="write both with the same axes, units and origin",
            )
        self._placed = [_placed(occluders, index) for index in range(len(occluders))]

    def in_frustum(self, camera: Camera) -> BoolArray:
        """(p,) the parts whose box is not wholly beside the view frustum."""
        return in_frustum(self._part_boxes, camera, self.buffer.rows, self.buffer.columns)

    def cull(self, camera: Camera) -> Culled:
        """Draw the occluders and test all parts."""
        self.buffer.clear()
        gaps = np.maximum(self._boxes[:, 0] - camera.position, camera.position - self._boxes[:, 1])
        distances = np.linalg.norm(np.maximum(gaps, 0.0), axis=1)
        drawn, triangles = [], 0
        for index in np.argsort(distances, kind="stable").tolist():
            found = self.buffer.test(self._boxes[index : index + 1], camera)
            if found[0] == Verdict.VISIBLE:
                mesh = self._placed[index]
                self.buffer.draw_mesh(mesh.vertices, mesh.faces, camera)
                drawn.append((index, NEAR))
                triangles += len(mesh.faces)
        return Culled(self.buffer.test(self._part_boxes, camera), tuple(drawn), triangles)


def _placed(occluders: Scene, index: int) -> _Placed:
    mesh, transform = occluders.meshes[occluders.mesh_of[index]], occluders.transforms[index]
    return _Placed(mesh.vertices @ transform[:3, :3].T + transform[:3, 3], mesh.faces)
