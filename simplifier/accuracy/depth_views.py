"""A mesh and an occluder as views with depths show them: what front and loss are counted in."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from simplifier.accuracy.accuracy import checked_directions
from simplifier.accuracy.silhouette_views import occluder_refused
from simplifier.geometry.mesh import FloatArray, IntArray, TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.views import BoundingSphere, image_axes

ACROSS = 256
"""Pixels across the original's bounding sphere."""

Surface = tuple[FloatArray, IntArray]
"""Vertices (n, 3) and faces (m, 3)."""

_Counted = TypeVar("_Counted")


@dataclass(frozen=True, eq=False)
class DepthViews:
    """Views along unit vectors ``lines`` (V, 3), in the space of the mesh's bounding sphere.

    ``sphere``       the mesh's, which is the unit sphere of that space.
    ``mesh``, ``occluder``  there.
    ``projections``  (V, 3, 4): pixels across and down, 256 across the sphere, and the depth in its
                     radii, rising away from the viewer.
    """

    lines: FloatArray
    sphere: BoundingSphere
    mesh: Surface
    occluder: Surface
    projections: FloatArray

    @classmethod
    def of(cls, mesh: TriangleMesh, occluder: Occluder, directions: FloatArray) -> DepthViews:
        """Raises :class:`~simplifier.errors.OptionError` for directions that are not (V, 3) unit
        vectors."""
        lines = checked_directions(directions)
        sphere = BoundingSphere.of(mesh)
        projections = np.zeros((len(lines), 3, 4))
        projections[:, :, :3] = image_axes(lines)
        projections[:, :2] *= ACROSS / 2.0
        projections[:, :2, 3] = ACROSS / 2.0
        return cls(
            lines, sphere, (sphere.to_unit(mesh.vertices), mesh.faces),
            (sphere.to_unit(occluder.vertices), occluder.faces), projections,
        )  # fmt: skip

    def counted(self, count: Callable[[Surface, Surface, FloatArray, int], _Counted]) -> _Counted:
        """What ``count`` gives for the mesh, the occluder, the projections and the picture's size.

        Raises :class:`~simplifier.errors.MeshError` when the occluder's arrays cannot be drawn.
        """
        with occluder_refused():
            return count(self.mesh, self.occluder, self.projections, ACROSS)
