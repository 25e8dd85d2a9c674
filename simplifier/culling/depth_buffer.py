"""DepthBuffer: occluders go in, boxes are asked about.

Based on hierarchical occlusion tests (Greene, Kass, Miller 1993; Zhang et al. 1997) with a single
coarse level.  New here are the depth and the margin that answer for occluders which are only known
up to an error bound.

Camera -> the sixteen numbers that the kernels of the item buffer take.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from simplifier.checks import check_one_of, check_whole
from simplifier.errors import MeshError, OptionError
from simplifier.geometry.arrays import rounded_up
from simplifier.geometry.camera import Camera, Lens
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.weld import edge_pairs
from simplifier.kernels import box_verdict
from simplifier.kernels.depth_buffer import PAST, TILE, draw, draw_placed
from simplifier.kernels.frustum import mark_outside
from simplifier.kernels.native import Buffer, address, library
from simplifier.options.scene import LARGEST_SCREEN

Coverage = Literal["centre", "inner"]
"""Which pixels an occluder is drawn into: with the centre in it, or with all of them in it."""

_NO_PAIRS = np.empty((0, 2), dtype=np.uint32)


class Verdict(IntEnum):
    """Of a box: may be seen, is hidden by the occluders, or is outside of the view frustum."""

    VISIBLE = box_verdict.VISIBLE
    HIDDEN = box_verdict.HIDDEN
    OUTSIDE = box_verdict.OUTSIDE


class DepthBuffer:
    """A small screen of reciprocal depths; draw and test with the same camera between clears.

    ``depth``  (8 r, 8 c) float32: 1 / view depth, larger is nearer, 0 is nothing; what is past the
               screen is the largest number of all.
    ``tiles``  (3, r, c) float32, 8 x 8 pixels each: least reciprocal depth, largest screen error of
               an occluder in pixels, and 1 where the least must be computed again.
    ``margin`` pixels that a box's rectangle always grows by: under centre coverage half of one, for
               a centre says nothing of the rest of its pixel: those on all sides must be covered.
    ``slack``  pixels that rounding to 32 bits may move anything by; a box grows by twice as much.

    With ``coverage="inner"`` nothing that can be seen between triangles is called hidden, where
    centres may miss a gap that is narrower than a pixel.  It hides less: what is thinner than a
    pixel draws nothing, nor do pixels that three triangles share.

    ``native`` the C header of ``integrations/c`` does the work where it could be compiled, else, or
               where this is set to None, numba's kernels, which give the same bits.
    """

    def __init__(self, rows: int = 180, columns: int = 320, coverage: Coverage = "centre") -> None:
        check_screen(rows, columns)
        check_one_of("coverage", coverage, get_args(Coverage))
        self.coverage = coverage
        self.rows, self.columns = int(rows), int(columns)
        tiles = -(-self.rows // TILE), -(-self.columns // TILE)
        pixels = tiles[0] * tiles[1] * TILE * TILE
        # One block: the header reads eight numbers at a time, past the end of either.
        block = np.zeros(pixels + 3 * tiles[0] * tiles[1] + TILE, dtype=np.float32)
        self.depth = block[:pixels].reshape(tiles[0] * TILE, tiles[1] * TILE)
        self.tiles = block[pixels:-TILE].reshape(3, *tiles)
        self.margin = 0.5 if coverage == "centre" else 0.0
        self.slack = max(self.rows, self.columns) / 262_144.0
        self.clear()
        self._size = np.array([self.rows, self.columns], dtype=np.int64)
        self._room = Room()
        self.native = library()
        self._camera: Camera | None = None
        self._lens = np.array([0.0, 0.0, self.margin, self.slack])
        self._eye, self._axes = np.zeros(3), np.zeros((3, 3))
        self._screen = np.zeros(9)
        self._soup = np.arange(3, dtype=np.int32).reshape(-1, 3)

    def clear(self) -> None:
        """Forget what was drawn."""
        self.depth.fill(PAST)
        self.depth[: self.rows, : self.columns] = 0.0
        self.tiles.fill(0.0)

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
        if len(triangles) > len(self._soup):
            self._soup = np.arange(6 * len(triangles), dtype=np.int32).reshape(-1, 3)
        corners = np.ascontiguousarray(triangles, dtype=np.float64).reshape(-1, 3)
        self._draw(corners, self._soup[: len(triangles)], _NO_PAIRS, camera, error)

    def draw_mesh(
        self,
        vertices: FloatArray,
        faces: IntArray,
        camera: Camera,
        error: float | FloatArray = 0.0,
        pairs: NDArray[np.uint32] | None = None,
    ) -> None:
        """As :meth:`draw`, of ``vertices`` (n, 3) world units and ``faces`` (m, 3) int32.

        ``pairs`` is what :func:`~simplifier.geometry.weld.edge_pairs` says of the faces; inner
        coverage needs it, and finds it where it is not given.

        Raises :class:`MeshError` for wrong shapes and for faces that name no vertex.
        """
        _check_mesh(vertices, faces)
        if pairs is None:
            pairs = edge_pairs(faces) if self.coverage == "inner" else _NO_PAIRS
        self._draw(vertices, faces, pairs, camera, error)

    def draw_placed(
        self,
        positions: NDArray[np.float32],
        faces: IntArray,
        transform: NDArray[np.float32],
        camera: Camera,
        error: float,
        pairs: NDArray[np.uint32],
    ) -> None:
        """As :meth:`draw_mesh`, of ``positions`` (n, 3) float32 in a space of their own.

        ``transform``  (12,) float32: three rows that take (x, y, z, 1) to world axes around the
                       camera.  Shapes and indices are not checked.
        """
        strayed = rounded_up(np.array([error], dtype=np.float64))
        self._look(camera)
        if self.native is not None:
            self.native.occluder_native_draw_placed(
                self.as_header_has_it(camera, len(positions)), address(positions), len(positions),
                address(faces), len(faces), address(pairs), len(pairs), address(transform),
                address(strayed),
            )  # fmt: skip
        else:
            draw_placed(
                positions, transform, faces, pairs, strayed, self._screen, self._lens, self._size,
                self.coverage == "inner", self.depth, self.tiles,
                self._room.points(len(positions)),
            )  # fmt: skip

    def test(self, boxes: FloatArray, camera: Camera) -> NDArray[np.uint8]:
        """(n,) :class:`Verdict` of world-space boxes (n, 2, 3): lowest and highest corners.

        OUTSIDE when all corners lie behind one plane of the frustum.  VISIBLE when the box reaches
        before the near plane.  HIDDEN when every pixel of the screen that the box's screen
        rectangle meets, grown by the margin, holds something nearer than the box's nearest corner,
        or every pixel that its outline meets, grown as well, something nearer than its front.
        The margin is the largest screen error of the occluders in the tiles that the grown
        rectangle meets, plus ``margin``, plus what rounding may be off.
        """
        if boxes.ndim != 3 or boxes.shape[1:] != (2, 3):
            raise MeshError(f"boxes have shape {boxes.shape}", remedy="pass (n, 2, 3)")
        self._look(camera)
        verdicts = np.empty(len(boxes), dtype=np.uint8)
        corners = np.require(boxes, np.float64, ["C", "W"])
        if self.native is not None:
            self.native.occluder_native_test(
                self.as_header_has_it(camera, 0), address(corners), len(corners), address(verdicts)
            )
        else:
            box_verdict.judge_boxes(
                corners, self._eye, self._screen.astype(np.float32), self._axes, self._lens,
                self._size, self.depth, self.tiles, verdicts,
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

    def _look(self, camera: Camera) -> None:
        if camera is not self._camera:
            self._camera = camera
            self._lens[:2] = Lens(self.rows, camera.fov).focal, camera.near
            self._eye[:], self._axes[:] = camera.position, camera.axes
            right, up, ahead = camera.axes
            self._screen[:3] = self._lens[0] * right + 0.5 * self.columns * ahead
            self._screen[3:6] = -self._lens[0] * up + 0.5 * self.rows * ahead
            self._screen[6:] = ahead

    def as_header_has_it(self, camera: Camera, vertices: int) -> Buffer:
        """What the header takes to look through a camera; there is room for so many vertices."""
        self._look(camera)
        points = self._room.points(vertices)
        return Buffer(
            address(self.depth), address(points), address(self._eye), address(self._axes),
            address(self._lens), self.rows, self.columns, points.shape[1],
            self.coverage == "inner",
        )  # fmt: skip

    def _draw(
        self, vertices: FloatArray, faces: IntArray, pairs: NDArray[np.uint32], camera: Camera,
        error: float | FloatArray,
    ) -> None:  # fmt: skip
        errors = np.atleast_1d(np.asarray(error, dtype=np.float64))
        if not (errors >= 0.0).all():
            raise OptionError("an occluder's error is below 0", remedy="give lengths of 0 or more")
        strayed = rounded_up(np.minimum(errors, np.float64(PAST)))
        if len(strayed) != 1 and len(strayed) != len(faces):
            raise MeshError(
                f"{len(strayed)} errors of {len(faces)} triangles",
                remedy="give one, or one for each",
            )
        points = np.require(vertices, np.float64, ["C", "W"])
        indices = np.require(faces, np.int32, ["C", "W"])
        shared = np.require(pairs, np.uint32, ["C", "W"])
        self._look(camera)
        if self.native is not None:
            self.native.occluder_native_draw(
                self.as_header_has_it(camera, len(points)), address(points), len(points),
                address(indices), len(indices), address(shared), len(shared), address(strayed),
                len(strayed), address(self._room.positions(len(points))),
            )  # fmt: skip
        else:
            draw(
                points, self._eye, indices, shared, strayed, self._screen, self._lens, self._size,
                self.coverage == "inner", self.depth, self.tiles, self._room.points(len(points)),
            )  # fmt: skip


class Room:
    """Arrays to work in, which grow."""

    def __init__(self) -> None:
        self._points = np.empty((3, 0), dtype=np.float32)
        self._positions = np.empty((0, 3), dtype=np.float32)

    def points(self, count: int) -> NDArray[np.float32]:
        """(3, count or more)."""
        if self._points.shape[1] < count:
            self._points = np.empty((3, 2 * count), dtype=np.float32)
        return self._points

    def positions(self, count: int) -> NDArray[np.float32]:
        """(count or more, 3)."""
        if len(self._positions) < count:
            self._positions = np.empty((2 * count, 3), dtype=np.float32)
        return self._positions


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


def in_frustum(boxes: FloatArray, camera: Camera, rows: int, columns: int) -> BoolArray:
    """(n,) which world-space boxes (n, 2, 3) float64 are not wholly beside the view frustum."""
    outside = np.empty(len(boxes), dtype=np.bool_)
    mark_outside(boxes, screen_view(camera, rows, columns), outside)
    return ~outside


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
