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

from simplifier.camera_paths.columns import UprightScene
from simplifier.errors import OptionError
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.scene import NOTHING, WHOLE, Scene, opaque_places
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.view_cells import ViewCells
from simplifier.kernels.columns import TOUCH
from simplifier.progress import TellCount
from simplifier.visibility.solid.object_heights import (
    Heights,
    Low,
    ObjectHeights,
    Shape,
    Shelf,
    base_of,
    needs_of,
)  # fmt: skip
from simplifier.visibility.solid.solid_heights import solid_heights

_TELL = 256  # objects between two tells
_MOST_TOUCHES = 2**31 - 1  # pairs of a pixel and an object, that int32 counts


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
    ``starts``  (nx ny + 1,) int32: where the objects that touch each pixel begin in
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
    starts: IntArray
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

    @property
    def tops(self) -> Heights:
        """(nx, ny) the highest point of any object, minus infinite where none is; not kept."""
        return self.highest(0, self.shape[0])

    def highest(self, begin: int, end: int) -> Heights:
        """(end - begin, ny) the highest point of any object in these rows of pixels."""
        ny = self.shape[1]
        starts = self.starts[begin * ny : end * ny + 1]
        highest = np.full(len(starts) - 1, -np.inf, dtype=np.float32)
        filled = np.flatnonzero(starts[:-1] < starts[1:])
        if len(filled):
            some = self.object_tops[starts[0] : starts[-1]]
            highest[filled] = np.maximum.reduceat(some, starts[filled] - starts[0])
        return highest.reshape(-1, ny)

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
                what stands as low as the lowest object does, or on what is solid from there up:
                one may look under all others.
    ``opaque``  what of the objects hides anything, by their names; all of it by default.
    """
    low, shape = raster_over(upright, cell, viewers)
    floor = float(upright.boxes[:, 0, 2].min())
    shelf = Shelf()
    made = [
        shelf.put(ObjectHeights.of(*one, low, cell, None if ground else floor))
        for one in shapes_of(upright, opaque, tell)
    ]
    inner, kept = solid_heights(made, shape)
    filled = sum(one.filled for one in made)
    return HeightField(
        low, cell, inner, *_sorted_by_pixel(made, shape),
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
    for index, (whole, _) in enumerate(shapes_of(upright, None, lambda done, total: None)):
        vertices, faces = whole
        plan, _ = base_of(vertices, faces, floor is None)
        if needs_of(vertices, floor) > -np.inf:
            plan = None
        solid[index] = plan is not None
        hull = shapely.convex_hull(shapely.multipoints(vertices[:, :2]))
        plans.append(hull if plan is None else plan)
    return plans, solid


def shapes_of(
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


def _sorted_by_pixel(
    made: list[ObjectHeights], shape: tuple[int, int]
) -> tuple[IntArray, IntArray, Heights]:
    """What touches each pixel, pixels by rows, objects ascending; sorted by counting them."""
    touches = sum(int(np.isfinite(one.tops).sum()) for one in made)
    if touches > _MOST_TOUCHES:
        raise OptionError(
            f"objects touch {touches:,} pixels of the raster, more than {_MOST_TOUCHES:,}",
            where="epsilon", remedy="choose a larger one",
        )  # fmt: skip
    # Counts stand two places on, so that each pixel's start is counted up to its end, which is
    # where the next one begins.
    starts = np.zeros(shape[0] * shape[1] + 2, dtype=np.int32)
    counts = starts[2:].reshape(shape)
    for one in made:
        counts[one.place] += np.isfinite(one.tops)
    np.cumsum(starts, dtype=np.int32, out=starts)
    free = starts[1:-1].reshape(shape)
    objects, tops = np.empty(touches, dtype=np.int32), np.empty(touches, dtype=np.float32)
    for index, one in enumerate(made):
        there = np.isfinite(one.tops)
        places = free[one.place][there]
        objects[places], tops[places] = index, one.tops[there]
        free[one.place] += there
    return starts[:-1], objects, tops
