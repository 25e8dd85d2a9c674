"""DepthBuffer: occluders go in, boxes are asked about.

Based on hierarchical occlusion tests (Greene, Kass, Miller 1993; Zhang et al. 1997) with a single
coarse level.  New here are the depth and the margin that answer for occluders which are only known
up to an error bound.

Camera -> the sixteen numbers that the rasterising kernels take.

Faces -> pairs of faces that share an edge.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from simplifier.checks import check_one_of, check_whole
from simplifier.errors import MeshError, OptionError
from simplifier.geometry.camera import Camera, Lens
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.weld import edge_pairs
from simplifier.kernels import box_verdict
from simplifier.kernels.depth_buffer import TILE, draw_inside, draw_triangles
from simplifier.options.scene import LARGEST_SCREEN

Coverage = Literal["centre", "inner"]
"""Which pixels an occluder is drawn into: with the centre in it, or with all of them in it."""

_NO_EDGES = np.empty((0, 6), dtype=np.int32)


class Verdict(IntEnum):
    """Of a box: may be seen, is hidden by the occluders, or is outside of the view frustum."""

    VISIBLE = box_verdict.VISIBLE
    HIDDEN = box_verdict.HIDDEN
    OUTSIDE = box_verdict.OUTSIDE


class DepthBuffer:
    """A small screen of reciprocal depths; draw and test with the same camera between clears.

    ``depth``  (8 r, 8 c) float32: 1 / view depth, larger is nearer, 0 is nothing; what is past the
               screen is infinite.
    ``tiles``  (3, r, c) float32, 8 x 8 pixels each: least reciprocal depth, largest screen error of
               an occluder in pixels, and 1 where the least must be computed again.
    ``margin`` pixels that a box's rectangle always grows by: under centre coverage half of one, for
               a centre says nothing of the rest of its pixel: those on all sides must be covered.

    With ``coverage="inner"`` nothing that can be seen between triangles is called hidden, where
    centres may miss a gap that is narrower than a pixel.  It hides less: what is thinner than a
    pixel draws nothing, nor do pixels that three triangles share.

    The arrays are what kernels take that draw and test by themselves
    (:func:`~simplifier.kernels.depth_buffer.draw_triangles`,
    :func:`~simplifier.kernels.box_verdict.box_verdict`), with :meth:`view` of the camera.
    """

    def __init__(self, rows: int = 180, columns: int = 320, coverage: Coverage = "centre") -> None:
        check_screen(rows, columns)
        check_one_of("coverage", coverage, get_args(Coverage))
        self.coverage = coverage
        self.rows, self.columns = int(rows), int(columns)
        tiles = -(-self.rows // TILE), -(-self.columns // TILE)
        self.depth = np.zeros((tiles[0] * TILE, tiles[1] * TILE), dtype=np.float32)
        self.tiles = np.zeros((3, *tiles), dtype=np.float32)
        self.margin = 0.5 if coverage == "centre" else 0.0
        self._camera: Camera | None = None
        self._view: FloatArray = np.zeros(16)
        self._corners = np.arange(3, dtype=np.int32).reshape(-1, 3)
        self.clear()

    def clear(self) -> None:
        """Forget what was drawn."""
        self.depth.fill(np.inf)
        self.depth[: self.rows, : self.columns] = 0.0
        self.tiles.fill(0.0)

    def view(self, camera: Camera) -> FloatArray:
        """(16,) float64 of the camera, for kernels; kept until another camera comes."""
        if camera is not self._camera:
            self._camera, self._view = camera, screen_view(camera, self.rows, self.columns)
        return self._view

    def draw(self, triangles: FloatArray, camera: Camera, error: float | FloatArray = 0.0) -> None:
        """Draw both sides of occluder triangles (m, 3, 3), world units.

        ``error``  a length, or one for each triangle: how far the occluder may be off.  It is drawn
                   that much further away; :meth:`test` answers for its outline.

        Triangles with a corner that is not finite, and those of an infinite error, draw nothing.
        Under inner coverage pixels on an edge of two triangles are lost; :meth:`draw_mesh` keeps
        them.
        Raises :class:`MeshError` for a wrong shape and :class:`OptionError` for an error below 0.
        """
        if triangles.ndim != 3 or triangles.shape[1:] != (3, 3):
            raise MeshError(f"triangles have shape {triangles.shape}", remedy="pass (m, 3, 3)")
        vertices = np.ascontiguousarray(triangles, dtype=np.float64).reshape(-1, 3)
        self._draw(vertices, self._soup(len(triangles)), _NO_EDGES, camera, error)

    def draw_mesh(
        self,
        vertices: FloatArray,
        faces: IntArray,
        camera: Camera,
        error: float | FloatArray = 0.0,
        edges: IntArray | None = None,
    ) -> None:
        """As :meth:`draw`, of ``vertices`` (n, 3) world units and ``faces`` (m, 3) int32.

        ``edges`` is what :func:`~simplifier.culling.depth_buffer.shared_edges` says of the faces;
        inner coverage needs it, and finds it where it is not given.

        Raises :class:`MeshError` for wrong shapes and for faces that name no vertex.
        """
        _check_mesh(vertices, faces)
        if edges is None:
            edges = shared_edges(faces) if self.coverage == "inner" else _NO_EDGES
        self._draw(vertices, faces, edges, camera, error)

    def test(self, boxes: FloatArray, camera: Camera) -> NDArray[np.uint8]:
        """(n,) :class:`Verdict` of world-space boxes (n, 2, 3): lowest and highest corners.

        OUTSIDE when all corners lie behind one plane of the frustum.  VISIBLE when the box reaches
        before the near plane.  HIDDEN when every pixel of the screen that the box's screen
        rectangle meets, grown by the margin, holds something nearer than the box's nearest corner.
        The margin is the largest screen error of the occluders in the tiles that the grown
        rectangle meets, plus ``margin``.
        """
        if boxes.ndim != 3 or boxes.shape[1:] != (2, 3):
            raise MeshError(f"boxes have shape {boxes.shape}", remedy="pass (n, 2, 3)")
        verdicts = np.empty(len(boxes), dtype=np.uint8)
        box_verdict.judge_boxes(
            np.require(boxes, np.float64, ["C", "W"]), self.view(camera), self.depth, self.tiles,
            self.margin, verdicts,
        )  # fmt: skip
        return verdicts

    def depth_image(self) -> NDArray[np.uint8]:
        """(rows, columns) grey: white is nearest, black is nothing; for looking at."""
        depth = self.depth[: self.rows, : self.columns]
        drawn = depth > 0.0
        if not drawn.any():
            return np.zeros(depth.shape, dtype=np.uint8)
        # By the logarithm of the depth: reciprocals would be black but for the nearest.
        shade = np.log(depth, where=drawn, out=np.zeros_like(depth))
        low, high = float(shade[drawn].min()), float(shade[drawn].max())
        grey = 55.0 + 200.0 * (shade - low) / max(high - low, 1e-9)
        return np.where(drawn, np.minimum(grey, 255.0), 0.0).astype(np.uint8)

    def _soup(self, count: int) -> IntArray:
        """(count, 3) int32: corners of triangles that share none."""
        if count > len(self._corners):
            self._corners = np.arange(6 * count, dtype=np.int32).reshape(-1, 3)
        return self._corners[:count]

    def _draw(
        self, vertices: FloatArray, faces: IntArray, edges: IntArray, camera: Camera,
        error: float | FloatArray,
    ) -> None:  # fmt: skip
        errors = np.empty(len(faces))
        errors[:] = error
        if not (errors >= 0.0).all():
            raise OptionError("an occluder's error is below 0", remedy="give lengths of 0 or more")
        points = np.require(vertices, np.float64, ["C", "W"])
        indices = np.require(faces, np.int32, ["C", "W"])
        view = self.view(camera)
        if self.coverage == "centre":
            draw_triangles(points, indices, errors, view, self.depth, self.tiles)
        else:
            pairs = np.require(edges, np.int32, ["C", "W"])
            draw_inside(points, indices, pairs, errors, view, self.depth, self.tiles)


def _check_mesh(vertices: FloatArray, faces: IntArray) -> None:
    if vertices.ndim != 2 or vertices.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3:
        raise MeshError(
            f"vertices of shape {vertices.shape} and faces of shape {faces.shape}",
            remedy="pass (n, 3) and (m, 3)",
        )
    if faces.size and not (faces.min() >= 0 and faces.max() < len(vertices)):
        raise MeshError(
            f"a face names none of the {len(vertices)} vertices", remedy="repair the face indices"
        )


def screen_view(camera: Camera, rows: int, columns: int) -> FloatArray:
    """(16,) float64 as :mod:`simplifier.kernels.perspective` describes it.

    Pixels are square and the axis of view meets the centre of the screen.
    """
    focal = Lens(rows, camera.fov).focal
    right, up, forward = camera.axes
    across = focal * right + 0.5 * columns * forward
    down = -focal * up + 0.5 * rows * forward
    tail = np.array([focal, camera.near, columns, rows])
    return np.concatenate([camera.position, across, down, forward, tail]).astype(np.float64)


def check_screen(rows: int, columns: int) -> None:
    """Raises :class:`OptionError` for a screen that the kernels cannot draw."""
    check_whole("rows", rows, 1, LARGEST_SCREEN)
    check_whole("columns", columns, 1, LARGEST_SCREEN)


def shared_edges(faces: IntArray) -> IntArray:
    """(k, 6) int32 of ``faces`` (m, 3): both ends of an edge, the two third corners, the two faces.

    Where more than two faces meet at an edge, every two of them are a pair.  Vertices are the same
    when their indices are.
    """
    one, other = edge_pairs(faces).astype(np.int32).T
    face, corner = one // 3, one % 3
    ends = np.column_stack([faces[face, (corner + 1) % 3], faces[face, (corner + 2) % 3]])
    flat = faces.reshape(-1)
    found = np.column_stack([np.sort(ends, axis=1), flat[one], flat[other], face, other // 3])
    return np.ascontiguousarray(found, dtype=np.int32)
