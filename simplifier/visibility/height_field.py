"""Scene -> HeightField: from the ground up, what is solid all over a pixel, and what touches it.

Occluders in a city are functions z = f(x, y) (Wonka et al. 2000, section 1.3).  Of a closed object,
or one that is open where it meets the ground, the solid stands on its base and ends at the first
face above.  What lies above a gap is lost as an occluder, which hides less and nothing wrongly.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import ndimage

from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.scene import NOTHING, WHOLE, Scene, opaque_places
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.view_cells import ViewCells
from simplifier.kernels.columns import TOUCH
from simplifier.kernels.height_field import fill_outline, measure_object
from simplifier.progress import TellCount

_FLAT = 1e-6  # of an object's size: bases are no rougher, and stand no higher over the ground
_SUNK = 0.25  # of an object's height: up to there an open border is closed by the ground
_UPRIGHT = 1e-9  # of a face's area in plan beside its own
_TELL = 256  # objects between two tells

Low = NDArray[np.int64]
Shape = tuple[FloatArray, IntArray]
"""Vertices (n, 3) and faces (m, 3)."""


@dataclass(frozen=True, eq=False)
class Rooms:
    """What hides nothing from single cells, since they reach into it.

    ``boxes``  by the box of a cell, (k, 2, 2) int64 first and last pixel along x and y of each.
    """

    boxes: dict[bytes, NDArray[np.int64]]

    @classmethod
    def of(cls, cells: ViewCells, starts: NDArray[np.int64], boxes: NDArray[np.int64]) -> Rooms:
        """``starts`` (c + 1,): where those of each cell begin in ``boxes``."""
        some = np.flatnonzero(np.diff(starts)).tolist()
        return cls({_key(cells, cell): boxes[starts[cell] : starts[cell + 1]] for cell in some})

    def around(self, cells: ViewCells, cell: int) -> NDArray[np.int64]:
        """(k, 2, 2) those of a cell."""
        return self.boxes.get(_key(cells, cell), np.empty((0, 2, 2), dtype=np.int64))


def _key(cells: ViewCells, cell: int) -> bytes:
    return bytes(cells.low[cell].tobytes() + cells.high[cell].tobytes())


@dataclass(frozen=True, eq=False)
class HeightField:
    """Square pixels over an upright scene; heights in the scene's own.

    ``low``     (2,) float64: corner of the first pixel; ``cell`` the edge of a pixel.
    ``inner``   (nx, ny) float32: up to where a pixel is solid from the ground, all over; minus
                infinite where it is not.
    ``tops``    (nx, ny) float32: the highest point of any object; minus infinite where none is.
    ``starts``  (nx ny + 1,) int64: where the objects that touch each pixel begin in
                ``objects`` (k,) int32 and ``object_tops`` (k,) float32, how high each is there.
    ``footprints``  (n, 2, 2) float64: the box of each object in plan.
    ``lost``    share of what objects fill, 0 to 1, that does not count as solid.
    ``stands``  (n,) bool: the objects that are solid by themselves, and so hide nothing from cells
                that they stand in.
    ``rooms``   where it is not objects alone that are solid: what else is free for single cells.
    ``holed``   (n,) bool of the tiles of a terrain: those that lack samples, and are always
                visible; None where objects stand on the ground.
    ``beyond``  up to where it counts as solid outside of the raster.
    """

    low: FloatArray
    cell: float
    inner: NDArray[np.float32]
    tops: NDArray[np.float32]
    starts: NDArray[np.int64]
    objects: IntArray
    object_tops: NDArray[np.float32]
    footprints: FloatArray
    lost: float
    stands: BoolArray
    rooms: Rooms | None = None
    holed: BoolArray | None = None
    beyond: float = -np.inf

    @property
    def shape(self) -> tuple[int, int]:
        """Pixels along x and y."""
        nx, ny = self.inner.shape
        return nx, ny

    def touched(self, outline: FloatArray) -> tuple[Low, BoolArray]:
        """The first pixel (2,) of a window, and which of its pixels (wx, wy) an outline touches.

        ``outline`` (k, 2), convex and counter-clockwise.
        """
        corners = (outline - self.low) / self.cell
        most = np.array(self.shape) - 1
        first = np.clip(np.floor(corners.min(axis=0) - TOUCH).astype(np.int64), 0, most)
        last = np.clip(np.floor(corners.max(axis=0) + TOUCH).astype(np.int64), 0, most)
        x, y = np.ogrid[first[0] : last[0] + 1, first[1] : last[1] + 1]
        within = np.ones(tuple(last - first + 1), dtype=np.bool_)
        for (ax, ay), (bx, by) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            nx, ny = ay - by, bx - ax  # inwards
            reach = max(nx, 0.0) + max(ny, 0.0) + TOUCH * (abs(nx) + abs(ny))
            within &= nx * (x - ax) + ny * (y - ay) + reach >= 0.0
        return first, within

    def objects_in(self, outline: FloatArray) -> IntArray:
        """The objects of all pixels that a convex outline touches; some more than once."""
        (x, y), within = self.touched(outline)
        begin = (x + np.arange(len(within))) * self.shape[1] + y
        some = [np.empty(0, np.int32)]
        for line, start in zip(within, begin.tolist(), strict=True):
            kept = np.flatnonzero(line)
            if len(kept):
                between = self.starts[start + kept[0]], self.starts[start + kept[-1] + 1]
                some.append(self.objects[slice(*between)])
        return np.concatenate(some)


def height_field(
    upright: UprightScene,
    cell: float,
    viewers: FloatArray,
    ground: bool = False,
    tell: TellCount = lambda done, total: None,
    opaque: Scene | None = None,
) -> HeightField:
    """The heights of all objects.

    ``cell``    the edge of a pixel.
    ``viewers`` (2, 2): low and high corner in plan of where viewers are, which is covered as well.
    ``ground``  all that stands on a border of its own stands on the ground there.  Without it, only
                what stands as low as the lowest object does: one may look under all others.
    ``opaque``  what of the objects hides anything, by their names; all of it by default.
    """
    low, shape = raster_over(upright, cell, viewers)
    floor = float(upright.boxes[:, 0, 2].min())
    inner = np.full(tuple(shape), -np.inf)
    least = np.full(shape, np.inf)
    made = [
        _Object.of(*one, low, cell, None if ground else floor)
        for one in _objects(upright, opaque, tell)
    ]
    filled = kept = 0.0
    for one in made:
        place = one.place
        least[place] = np.minimum(least[place], one.roofs)
        own = np.where(one.covered & np.isfinite(one.roofs), one.roofs, -np.inf)
        inner[place] = np.maximum(inner[place], own)
        filled, kept = filled + one.filled, kept + one.kept
    _fill_joints(made, inner, least)
    starts, objects, object_tops = _sorted_by_pixel(made, shape)
    tops = np.full(shape, -np.inf, dtype=np.float32)
    for one in made:
        tops[one.place] = np.maximum(tops[one.place], one.tops)
    return HeightField(
        low, cell, rounded_down(inner), tops, starts, objects, object_tops,
        upright.boxes[:, :, :2], 1.0 - kept / filled if filled > 0.0 else 0.0,
        np.array([one.plan is not None for one in made]),
    )  # fmt: skip


def raster_over(
    upright: UprightScene, cell: float, viewers: FloatArray
) -> tuple[FloatArray, tuple[int, int]]:
    """The corner (2,) of the first pixel, and how many there are along x and y."""
    # A pixel more all around: what touches the border of a pixel touches its neighbour.
    first = np.minimum(upright.boxes[:, 0, :2].min(axis=0), viewers[0])
    last = np.maximum(upright.boxes[:, 1, :2].max(axis=0), viewers[1])
    low = (np.floor(first / cell) - 1.0) * cell
    nx, ny = (np.floor((last - low) / cell).astype(np.int64) + 2).tolist()
    return low, (nx, ny)


def plans_of(
    upright: UprightScene, ground: bool = False
) -> tuple[list[shapely.Geometry], BoolArray]:
    """The plan of each object, and whether it is that of its solid where this begins, (n,) bool.

    Of an object that is solid nowhere from the ground up it is the convex hull.  ``ground`` as in
    :func:`height_field`.
    """
    floor = None if ground else float(upright.boxes[:, 0, 2].min())
    plans = []
    solid = np.zeros(len(upright.scene), dtype=np.bool_)
    for index, (whole, _) in enumerate(_objects(upright, None, lambda done, total: None)):
        vertices, faces = whole
        plan, _ = _base(vertices, faces, floor)
        solid[index] = plan is not None
        hull = shapely.convex_hull(shapely.multipoints(vertices[:, :2]))
        plans.append(hull if plan is None else plan)
    return plans, solid


def _objects(
    upright: UprightScene, opaque: Scene | None, tell: TellCount
) -> Iterator[tuple[Shape, Shape | None]]:
    """Each object, upright, and what of it hides anything: the same shape if all of it does."""
    scene = upright.scene
    layer = scene if opaque is None else opaque
    places = opaque_places(scene, layer)

    def shape(one: Scene, index: int) -> Shape:
        mesh = one.joined([index])
        return np.ascontiguousarray(mesh.vertices[:, upright.order] - upright.origin), mesh.faces

    for index, place in enumerate(places.tolist()):
        if index % _TELL == 0:
            tell(index, len(scene))
        whole = shape(scene, index)
        if place == WHOLE:
            yield whole, whole
        else:
            yield whole, None if place == NOTHING else shape(layer, place)


@dataclass(frozen=True, eq=False)
class _Object:
    """One object over a window of pixels.

    ``window`` (2,) its first pixel.  ``roofs`` where its solid ends at the least, infinite where
    none begins; ``covered`` the pixels that it covers by itself; ``plan`` where its solid begins.
    ``filled``, ``kept``  pixels times height that it has, and that count as solid.
    """

    window: Low
    roofs: FloatArray
    tops: NDArray[np.float32]
    covered: BoolArray
    plan: shapely.Geometry | None
    filled: float
    kept: float

    @property
    def place(self) -> tuple[slice, slice]:
        (x, y), (wx, wy) = self.window, self.tops.shape
        return slice(x, x + wx), slice(y, y + wy)

    @classmethod
    def of(
        cls, whole: Shape, opaque: Shape | None, low: FloatArray, cell: float, floor: float | None
    ) -> _Object:
        points, faces = _in_pixels(whole, low, cell)
        # No further out than the field, where rounding has moved a corner over a border of pixels.
        window = np.maximum(np.floor(points[:, :2].min(axis=0)).astype(np.int64) - 1, 0)
        size = np.floor(points[:, :2].max(axis=0)).astype(np.int64) + 2 - window
        roofs, highest = np.full(tuple(size), np.inf), np.full(tuple(size), -np.inf)
        covered, inside = np.zeros(tuple(size), np.bool_), np.zeros(tuple(size), np.bool_)
        if opaque is not whole:
            none = np.zeros(len(faces), np.bool_)
            measure_object(points, faces, none, window, roofs, highest)
        if opaque is None:
            return cls(window, roofs, rounded_up(highest), covered, None, 0.0, 0.0)
        vertices, faces = _in_pixels(opaque, low, cell)
        if opaque is not whole and floor is None:
            floor = float(points[:, 2].min())  # no ground closes the border of a window
        plan, ends = _base(vertices, faces, floor)
        tops = np.full(tuple(size), -np.inf)
        measure_object(vertices, faces, ends, window, roofs, tops)
        if plan is None:
            roofs[:] = np.inf
        else:
            covered, inside = _covered(plan, window, tuple(size))
        base = float(vertices[:, 2].min())
        there, solid = np.isfinite(tops), inside & np.isfinite(roofs)
        # Borders are touched by more pixels than they are worth.
        there &= inside if plan is not None else ndimage.binary_erosion(there)
        filled, kept = float((tops[there] - base).sum()), float((roofs[solid] - base).sum())
        highest = rounded_up(np.maximum(highest, tops))
        return cls(window, roofs, highest, covered, plan, filled, kept)


def _in_pixels(shape: Shape, low: FloatArray, cell: float) -> Shape:
    vertices = shape[0].copy()
    vertices[:, :2] = (vertices[:, :2] - low) / cell
    return vertices, shape[1]


def _base(
    vertices: FloatArray, faces: IntArray, floor: float | None
) -> tuple[shapely.Geometry | None, BoolArray]:
    """Where the solid of an object begins, in plan, None for what has none; and which faces it may
    end at, (m,).

    Without a ``floor``, where one may look under what does not stand on it, the ground closes
    borders.
    """
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    normals = np.cross(b - a, c - a)
    sloped = np.abs(normals[:, 2]) > _UPRIGHT * np.linalg.norm(normals, axis=1)
    low, high = float(vertices[:, 2].min()), float(vertices[:, 2].max())
    flat = _FLAT * float(np.ptp(vertices, axis=0).max())
    border = _border(vertices, faces)
    reach = flat if floor is not None else _SUNK * (high - low)
    sunk = bool((vertices[border.ravel(), 2] <= low + reach).all())
    if high - low <= flat or not sunk or (floor is not None and low > floor + flat):
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


def _border(vertices: FloatArray, faces: IntArray) -> IntArray:
    """(k, 2) the edges that have more faces on one side than on the other, corners welded."""
    _, first, place = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    welded = place.reshape(-1)[faces]
    edges = np.concatenate([welded[:, [0, 1]], welded[:, [1, 2]], welded[:, [2, 0]]])
    edges = edges[edges[:, 0] != edges[:, 1]]
    forth = edges[:, 0] < edges[:, 1]
    keys, which = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    excess = np.bincount(which.reshape(-1), np.where(forth, 1.0, -1.0), len(keys))
    return np.asarray(first[keys[excess != 0.0]], dtype=np.int32)


def _covered(
    plan: shapely.Geometry, window: Low, size: tuple[int, ...]
) -> tuple[BoolArray, BoolArray]:
    """The pixels that lie in a plan wholly, and those whose centre does."""
    rings = shapely.get_rings(shapely.get_parts(plan))
    points, ring = shapely.get_coordinates(rings, return_index=True)
    ends = np.cumsum(np.bincount(ring, minlength=len(rings))).astype(np.int64)
    crossed, inside = np.zeros(size, np.bool_), np.zeros(size, np.bool_)
    fill_outline(np.ascontiguousarray(points), ends, window, crossed, inside)
    return inside & ~crossed, inside


def _fill_joints(made: list[_Object], inner: FloatArray, least: FloatArray) -> None:
    """Where objects touch or overlap each other, none of them may cover a pixel, but all do."""
    plans = [one.plan for one in made if one.plan is not None]
    if plans:
        start = np.zeros(2, dtype=np.int64)
        covered, _ = _covered(shapely.union_all(plans), start, inner.shape)
        joint = covered & np.isfinite(least)
        inner[joint] = np.maximum(inner[joint], least[joint])


def _sorted_by_pixel(
    made: list[_Object], shape: tuple[int, ...]
) -> tuple[NDArray[np.int64], IntArray, NDArray[np.float32]]:
    pixels, numbers, tops = [], [], []
    for index, one in enumerate(made):
        x, y = np.nonzero(np.isfinite(one.tops))
        pixels.append((x + one.window[0]) * shape[1] + y + one.window[1])
        numbers.append(np.full(len(x), index, dtype=np.int32))
        tops.append(one.tops[x, y])
    place = np.concatenate(pixels)
    order = np.argsort(place, kind="stable")
    starts = np.concatenate([[0], np.cumsum(np.bincount(place, minlength=shape[0] * shape[1]))])
    return starts.astype(np.int64), np.concatenate(numbers)[order], np.concatenate(tops)[order]


def rounded_down(values: FloatArray) -> NDArray[np.float32]:
    """As float32, no value higher."""
    near = values.astype(np.float32)
    return np.where(near > values, np.nextafter(near, np.float32(-np.inf)), near)


def rounded_up(values: FloatArray) -> NDArray[np.float32]:
    """As float32, no value lower."""
    near = values.astype(np.float32)
    return np.where(near < values, np.nextafter(near, np.float32(np.inf)), near)
