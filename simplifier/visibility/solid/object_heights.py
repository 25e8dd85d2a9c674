"""One object -> where over the pixels its solid ends, what it covers, and what it stands on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar, cast

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import ndimage

from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.solid import BoolArray
from simplifier.kernels.height_field import fill_outline, measure_object

_FLAT = 1e-6  # of an object's size: bases are no rougher, and stand no higher over what is below
_SUNK = 0.25  # of an object's height: up to there an open border is closed by the ground
_UPRIGHT = 1e-9  # of a face's area in plan beside its own

_PIECE = 1 << 26  # bytes: allocators map no larger pieces than 2^25 into their heap

Low = NDArray[np.int64]
Heights = NDArray[np.float32]
_Array = TypeVar("_Array", Heights, BoolArray)
Shape = tuple[FloatArray, IntArray]
"""Vertices (n, 3) and faces (m, 3)."""


@dataclass(frozen=True, eq=False)
class ObjectHeights:
    """One object over a window of pixels.

    ``window`` (2,) its first pixel.  ``roofs`` where its solid ends at the least, no higher, and
    infinite where none begins; ``tops`` its highest point, no lower; ``covered`` the pixels that
    it covers by itself, ``inside`` those whose centre it does; ``plan`` where its solid begins.
    ``low``    its lowest height; ``needs`` up to where a pixel must be solid below it for it to
    stand there, minus infinite for what stands on the ground.
    ``filled`` pixels times height that it has.
    """

    window: Low
    roofs: Heights
    tops: Heights
    covered: BoolArray
    inside: BoolArray
    plan: shapely.Geometry | None
    low: float
    needs: float
    filled: float

    @property
    def place(self) -> tuple[slice, slice]:
        (x, y), (wx, wy) = self.window, self.tops.shape
        return slice(x, x + wx), slice(y, y + wy)

    @classmethod
    def of(
        cls, whole: Shape, opaque: Shape | None, low: FloatArray, cell: float, floor: float | None
    ) -> ObjectHeights:
        """``opaque`` is what of the ``whole`` hides anything; ``floor`` the lowest height of the
        scene, None where each object stands on the ground.
        """
        points, faces = _in_pixels(whole, low, cell)
        # No further out than the field, where rounding has moved a corner over a border of pixels.
        window = np.maximum(np.floor(points[:, :2].min(axis=0)).astype(np.int64) - 1, 0)
        size = np.floor(points[:, :2].max(axis=0)).astype(np.int64) + 2 - window
        roofs, highest = np.full(tuple(size), np.inf), np.full(tuple(size), -np.inf)
        covered, inside = np.zeros(tuple(size), np.bool_), np.zeros(tuple(size), np.bool_)
        if opaque is not whole:
            none = np.zeros(len(faces), np.bool_)
            measure_object(points, faces, none, window, roofs, highest)
        base = float(points[:, 2].min())
        if opaque is None:
            return cls(
                window,
                rounded_down(roofs),
                rounded_up(highest),
                covered,
                inside,
                None,
                base,
                np.inf,
                0.0,
            )
        vertices, faces = _in_pixels(opaque, low, cell)
        if opaque is not whole and floor is None:
            floor = base  # no ground closes the border of a window
        base = float(vertices[:, 2].min())
        plan, ends = base_of(vertices, faces, floor is None)
        tops = np.full(tuple(size), -np.inf)
        measure_object(vertices, faces, ends, window, roofs, tops)
        if plan is None:
            roofs[:] = np.inf
        else:
            covered, inside = covered_by(plan, window, tuple(size))
        there = np.isfinite(tops)
        # Borders are touched by more pixels than they are worth.
        there &= inside if plan is not None else ndimage.binary_erosion(there)
        return cls(
            window, rounded_down(roofs), rounded_up(np.maximum(highest, tops)), covered, inside,
            plan, base, needs_of(vertices, floor), float((tops[there] - base).sum()),
        )  # fmt: skip


class Shelf:
    """Heights of many objects in few pieces of memory, which the system has back with the last of
    them: thousands of small arrays leave the heap as large as it was.
    """

    def __init__(self) -> None:
        self._piece = np.empty(0, dtype=np.uint8)
        self._used = 0

    def put(self, one: ObjectHeights) -> ObjectHeights:
        """The same, with its arrays here."""
        return replace(
            one, roofs=self._moved(one.roofs), tops=self._moved(one.tops),
            covered=self._moved(one.covered), inside=self._moved(one.inside),
        )  # fmt: skip

    def _moved(self, array: _Array) -> _Array:
        if self._used + array.nbytes > len(self._piece):
            self._piece = np.empty(max(_PIECE, array.nbytes), dtype=np.uint8)
            self._used = 0
        place = self._piece[self._used : self._used + array.nbytes]
        self._used += -(-array.nbytes // 8) * 8
        moved = place.view(array.dtype).reshape(array.shape)
        moved[:] = array
        return cast(_Array, moved)


def _in_pixels(shape: Shape, low: FloatArray, cell: float) -> Shape:
    vertices = shape[0].copy()
    vertices[:, :2] = (vertices[:, :2] - low) / cell
    return vertices, shape[1]


def needs_of(vertices: FloatArray, floor: float | None) -> float:
    """Up to where there must be solid below an object; minus infinite if it stands on the floor."""
    if floor is None:
        return -np.inf
    low = float(vertices[:, 2].min()) - _FLAT * float(np.ptp(vertices, axis=0).max())
    return -np.inf if low <= floor else low


def base_of(
    vertices: FloatArray, faces: IntArray, grounded: bool
) -> tuple[shapely.Geometry | None, BoolArray]:
    """Where the solid of an object begins, in plan, None for what has none; and which faces it may
    end at, (m,).

    The ground closes borders of what is ``grounded``.
    """
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    normals = np.cross(b - a, c - a)
    sloped = np.abs(normals[:, 2]) > _UPRIGHT * np.linalg.norm(normals, axis=1)
    low, high = float(vertices[:, 2].min()), float(vertices[:, 2].max())
    flat = _FLAT * float(np.ptp(vertices, axis=0).max())
    border = border_of(vertices, faces)
    reach = _SUNK * (high - low) if grounded else flat
    sunk = bool((vertices[border.ravel(), 2] <= low + reach).all())
    if high - low <= flat or not sunk:
        return None, sloped
    origin = np.array([*vertices[:, :2].mean(axis=0), low])
    outwards = np.sign(np.einsum("ij,ij->", a - origin, np.cross(b - origin, c - origin)))
    level = np.maximum(np.maximum(a[:, 2], b[:, 2]), c[:, 2]) <= low + flat
    bases = sloped & level & (outwards * normals[:, 2] < 0.0)
    corners = np.stack([a, b, c], axis=1)[bases][:, [0, 1, 2, 0], :2]
    parts = list(shapely.polygons(corners)) if bases.any() else []
    if len(border):
        lines = shapely.linestrings(vertices[border][:, :, :2])
        parts.append(shapely.build_area(shapely.union_all(lines)))
    plan = shapely.union_all(parts)
    return (None if plan.is_empty else plan), sloped & ~bases


def border_of(vertices: FloatArray, faces: IntArray) -> IntArray:
    """(k, 2) the edges that have more faces on one side than on the other, corners welded."""
    _, first, place = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    welded = place.reshape(-1)[faces]
    edges = np.concatenate([welded[:, [0, 1]], welded[:, [1, 2]], welded[:, [2, 0]]])
    edges = edges[edges[:, 0] != edges[:, 1]]
    forth = edges[:, 0] < edges[:, 1]
    keys, which = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    excess = np.bincount(which.reshape(-1), np.where(forth, 1.0, -1.0), len(keys))
    return np.asarray(first[keys[excess != 0.0]], dtype=np.int32)


def standing_heights(
    shape: Shape, low: FloatArray, cell: float, floor: float | None
) -> tuple[FloatArray, FloatArray, float]:
    """How high one object is solid from the ground in pixels that it fills by itself.

    ``low`` (2,) corner and ``cell`` edge of the pixels; ``floor`` as for :class:`ObjectHeights`.
    The low corner (2,) of the first pixel, heights (wx, wy), minus infinite where there is no
    solid, and the volume that the object fills, 0 where nothing of it is solid or it does not
    stand.
    """
    one = ObjectHeights.of(shape, shape, low, cell, floor)
    stands = one.plan is not None and one.needs == -np.inf
    there = one.covered & np.isfinite(one.roofs) & stands
    heights = np.where(there, one.roofs.astype(np.float64), -np.inf)
    return low + cell * one.window, heights, one.filled * cell * cell if stands else 0.0


def covered_by(
    plan: shapely.Geometry, window: Low, size: tuple[int, ...]
) -> tuple[BoolArray, BoolArray]:
    """The pixels that lie in a plan wholly, and those whose centre does."""
    rings = shapely.get_rings(shapely.get_parts(plan))
    points, ring = shapely.get_coordinates(rings, return_index=True)
    ends = np.cumsum(np.bincount(ring, minlength=len(rings))).astype(np.int64)
    crossed, inside = np.zeros(size, np.bool_), np.zeros(size, np.bool_)
    fill_outline(np.ascontiguousarray(points), ends, window, crossed, inside)
    return inside & ~crossed, inside


def rounded_down(values: FloatArray) -> Heights:
    """As float32, no value higher."""
    near = values.astype(np.float32)
    return np.where(near > values, np.nextafter(near, np.float32(-np.inf)), near)


def rounded_up(values: FloatArray) -> Heights:
    """As float32, no value lower."""
    near = values.astype(np.float32)
    return np.where(near < values, np.nextafter(near, np.float32(np.inf)), near)
