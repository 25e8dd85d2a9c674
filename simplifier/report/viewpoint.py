"""One view of an original, drawn once, and occluders over it: for pictures while a search runs."""

from __future__ import annotations

from typing import get_args

import numpy as np

from simplifier.checks import check_kind, check_one_of, check_whole, value_text
from simplifier.errors import MeshError, OptionError
from simplifier.geometry.arrays import vector, vertex_array
from simplifier.geometry.mesh import A_MESH, FloatArray, IntArray, TriangleMesh
from simplifier.geometry.occluder import AN_OCCLUDER, Occluder
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.views import BoundingSphere, image_axes
from simplifier.kernels.coverage import coverage_masks, unpack_masks
from simplifier.options.simplify import Axis
from simplifier.report.png import png_bytes
from simplifier.report.silhouettes import resize_image, silhouette

_FINER = 3  # pixels drawn a side for each of the picture, so that edges come out smooth
_MARGIN = 0.04  # of the side, around the original
_FROM_ABOVE = (-0.62, -0.48, -0.62)  # with +y up: down onto a corner, as assets are mostly shown


class Viewpoint:
    """A view that holds the whole of ``mesh``, for any number of pictures of its occluders.

    ``direction``  (3,) the line of sight, not 0; None is from above, onto a corner.
    ``size``       pixels a side, 8..1024.
    ``up``         the axis that is up in the picture.

    Raises :class:`~simplifier.errors.OptionError`.
    """

    def __init__(
        self,
        mesh: TriangleMesh,
        direction: FloatArray | None = None,
        size: int = 160,
        *,
        up: Axis = "y",
    ) -> None:
        check_kind("mesh", mesh, TriangleMesh, A_MESH)
        check_whole("size", size, 8, 1024)
        check_one_of("up", up, get_args(Axis))
        self._size, self._fine = int(size), _FINER * int(size)
        self._sphere = BoundingSphere.of(mesh)
        axes = _axes(direction, up)
        vertices = self._unit(mesh.vertices)
        placed = axes @ vertices.T  # two long rows: many times as fast to go along
        low, high = placed.min(axis=1), placed.max(axis=1)
        scale = (1.0 - 2.0 * _MARGIN) * self._fine / (high - low).max()
        offset = 0.5 * self._fine - 0.5 * scale * (low + high)
        self._projections = np.column_stack([scale * axes, offset])[None]
        self._original = self._mask(vertices, mesh.faces)

    def picture(self, occluder: Occluder | FloatArray) -> bytes:
        """PNG of the occluder, or of triangles (n, 3, 3), over the original, as in
        :mod:`~simplifier.report.silhouettes`.

        What lies outside of the picture is cut off.  Raises :class:`~simplifier.errors.MeshError`
        for arrays that cannot be drawn.
        """
        try:
            vertices, faces = _arrays(occluder)
            mask = self._mask(self._unit(vertices), faces)
        except ValueError as error:
            raise MeshError(str(error), where="occluder", remedy="repair its arrays") from error
        return png_bytes(resize_image(silhouette(self._original, mask), self._size))

    def _unit(self, points: FloatArray) -> FloatArray:
        # Centred before it is scaled: coordinates of a map keep all their digits.
        return np.asarray((points - self._sphere.centre) / self._sphere.radius)

    def _mask(self, vertices: FloatArray, faces: IntArray) -> BoolArray:
        """(fine, fine), row 0 at the bottom."""
        bits = coverage_masks(vertices, faces, self._projections, self._fine, self._fine)
        return np.asarray(unpack_masks(bits, self._fine)[0])


def picture_of(
    mesh: TriangleMesh,
    occluder: Occluder | FloatArray,
    direction: FloatArray | None = None,
    size: int = 160,
    *,
    up: Axis = "y",
) -> bytes:
    """PNG of an occluder, or of triangles (n, 3, 3), over its original: see :class:`Viewpoint`."""
    return Viewpoint(mesh, direction, size, up=up).picture(occluder)


def _axes(direction: FloatArray | None, up: Axis) -> FloatArray:
    """(2, 3) unit rows: u and v of the picture, in world space."""
    turn = "xyz".index(up) - 1  # of the axes, which brings +y to where up is
    if direction is None:
        sight = np.array(_FROM_ABOVE)
    else:
        sight = np.roll(vector("direction", direction), -turn)
    length = float(np.linalg.norm(sight))
    if not 0.0 < length < np.inf:
        raise OptionError(
            f"{direction} is not a line of sight", where="direction", remedy="pass a vector, not 0"
        )
    return np.roll(image_axes(sight[None] / length)[0, :2], turn, axis=1)


def _arrays(occluder: Occluder | FloatArray) -> tuple[FloatArray, IntArray]:
    if isinstance(occluder, Occluder):
        return occluder.vertices, occluder.faces
    if not isinstance(occluder, np.ndarray) or occluder.shape[1:] != (3, 3):
        raise MeshError(
            f"{value_text(occluder)} is neither an occluder nor an array (n, 3, 3) of triangles",
            where="occluder",
            remedy=f"give {AN_OCCLUDER}",
        )
    corners = vertex_array(occluder.reshape(-1, 3), "occluder")
    return corners, np.arange(len(corners), dtype=np.int32).reshape(-1, 3)
