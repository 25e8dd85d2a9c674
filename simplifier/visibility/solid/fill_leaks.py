"""Voxels + Spaces -> where spaces that look closed are open, and through how wide a hole.

Surfaces are thickened by a voxel, by two, and so on: a space that then parts from where viewers
are was open through a hole about twice as wide.  The hole is where the widest way out is
narrowest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray
from simplifier.kernels.viewer_fill import draw_spaces, mark_columns, thicken, walk
from simplifier.visibility.solid.spaces import Spaces, Voxel, Voxels

_WIDEST = 4  # voxels that surfaces are thickened by: holes up to twice as wide are found
_LEAST = 8  # voxels of a space, thickened: smaller ones are no rooms
_MOST = 5  # leaks that are looked at closely
_MOST_VOXELS = 1 << 24  # of a window around one
_FINE_EDGE = 96  # voxels along an edge of the window in which a hole is measured
_ALL_AROUND = np.ones((3, 3, 3), dtype=np.bool_)

Judge = Callable[[Spaces], tuple[BoolArray, BoolArray]]


@dataclass(frozen=True)
class FillLeak:
    """A space that would be solid, were it not for a hole.

    ``point``  x, y, z in the world: the middle of the hole.
    ``width``  of the hole, a length, right to about a voxel.
    ``size``   edges of the box around the space, upright, lengths.
    ``name``   an object that is nearest to the hole.
    """

    point: tuple[float, float, float]
    width: float
    size: tuple[float, float, float]
    name: str


def find_leaks(
    upright: UprightScene, voxels: Voxels, spaces: Spaces, is_open: BoolArray, judge: Judge,
    inner: NDArray[np.float32],
) -> tuple[tuple[FillLeak, ...], int]:  # fmt: skip
    """The largest spaces behind small holes, largest first, and how many there are.

    ``is_open``  (m,) of the spaces; ``judge`` tells of spaces which are open, and which any cell
                 meets: a room that a viewer stands in does not leak.
    ``inner``    (nx, ny) heights that are solid all the same: what they fill does not leak.
    """
    before, open_before, bits = spaces, is_open, voxels.bits
    found: list[_Leak] = []
    for steps in range(1, _WIDEST + 1):
        thick = np.empty_like(bits)
        thicken(bits, thick)
        now = Spaces.of(thick, voxels.earth, voxels.depth)
        open_now, met = judge(now)
        rooms = np.flatnonzero(~open_now & ~met & (now.volumes >= _LEAST))
        for room in rooms.tolist():
            space = before.at(now.tips[room])
            if space >= 0 and open_before[space] and not _is_full(voxels, now.boxes[room], inner):
                found.append(_Leak(voxels, now, open_now, room, steps))
        before, open_before, bits = now, open_now, thick
    found.sort(key=lambda leak: -leak.volume)
    return tuple(leak.told(upright) for leak in found[:_MOST]), len(found)


def _is_full(voxels: Voxels, box: Voxel, inner: NDArray[np.float32]) -> bool:
    """Whether most of a box is solid up to its middle."""
    (x0, y0, z0), (x1, y1, z1) = box.tolist()
    middle = voxels.origin[2] + 0.5 * (z0 + z1 + 1) * voxels.cell
    return bool((inner[x0 : x1 + 1, y0 : y1 + 1] >= middle).mean() > 0.5)


@dataclass(frozen=True, eq=False)
class _Leak:
    """A room of spaces thickened by ``steps`` voxels that a thinner surface leaves open."""

    voxels: Voxels
    now: Spaces
    open_now: BoolArray
    room: int
    steps: int

    @property
    def volume(self) -> int:
        return int(self.now.volumes[self.room])

    def told(self, upright: UprightScene) -> FillLeak:
        voxels, box = self.voxels, self.now.boxes[self.room]
        place, width = self._hole(upright)
        point = voxels.origin + place * voxels.cell
        size = (box[1] - box[0] + 1 + 2 * self.steps) * voxels.cell
        away = np.maximum(upright.boxes[:, 0] - point, point - upright.boxes[:, 1])
        name = upright.scene.names[int(np.argmin((np.maximum(away, 0.0) ** 2).sum(axis=1)))]
        x, y, z = upright.to_world(point[None])[0].tolist()
        w, d, h = size.tolist()
        return FillLeak((x, y, z), width * voxels.cell, (w, d, h), name)

    def _hole(self, upright: UprightScene) -> tuple[FloatArray, float]:
        """Middle and width of a hole, in voxels."""
        box = self.now.boxes[self.room]
        limit = np.array([*self.voxels.shape, self.voxels.depth])
        for margin in (2 * self.steps + 4, 8 * self.steps + 16):
            low = np.maximum(box[0] - margin, 0)
            high = np.minimum(box[1] + margin + 1, limit)
            if np.prod(high - low) > _MOST_VOXELS:
                break
            inside, outside = self._sides(low, high)
            way = ~_touched_in(self.voxels, low, high) | inside | outside
            there, back = _steps(way, inside), _steps(way, outside)
            least = np.where(there + back >= 0, there + back, np.iinfo(np.int32).max)
            if (there[outside] >= 0).any():
                shortest = np.argwhere(least == least.min())
                lead = there[tuple(shortest.T)] - back[tuple(shortest.T)]
                place = shortest[np.argmin(np.abs(lead))]
                reach = int(least.min()) // 2 + 3
                return self._finer(upright, place, reach, (inside, outside), low)
        return box.mean(axis=0) + 0.5, 2.0 * self.steps

    def _finer(
        self, upright: UprightScene, place: Voxel, reach: int,
        sides: tuple[BoolArray, BoolArray], low: Voxel,
    ) -> tuple[FloatArray, float]:  # fmt: skip
        """Where and how wide the way is narrowest around a place, in finer voxels."""
        first = np.maximum(place - reach, 0)
        last = np.minimum(place + reach + 1, sides[0].shape)
        some = tuple(slice(a, b) for a, b in zip(first, last, strict=True))
        fine = max(_FINE_EDGE // (2 * reach + 1), 1)
        inside, outside = (_finer(side[some], fine) for side in sides)
        touched = self._touched_finely(upright, low + first, low + last, fine)
        hole = narrowest(touched, inside, outside, bool((low + first)[2] == 0))
        if hole is None:  # by rounding, at the border of the window
            return np.asarray(place + low + 0.5, dtype=np.float64), 2.0 * self.steps
        return hole[0] / fine + first + low, hole[1] / fine

    def _sides(self, low: Voxel, high: Voxel) -> tuple[BoolArray, BoolArray]:
        """Voxels of the room and of open spaces, thickened, in a window."""
        own = np.zeros(len(self.now), dtype=np.bool_)
        own[self.room] = True
        sides = np.zeros((2, *(high - low)), dtype=np.bool_)
        for wanted, side in zip((own, self.open_now), sides, strict=True):
            draw_spaces(*self.now.runs, self.now.shape[1], low, wanted, side)
        return sides[0], sides[1]

    def _touched_finely(
        self, upright: UprightScene, low: Voxel, high: Voxel, fine: int
    ) -> BoolArray:
        """What is touched between two voxels, in finer ones."""
        cell = self.voxels.cell / fine
        origin = self.voxels.origin + low * self.voxels.cell
        shape = tuple(int(count) * fine for count in high - low)
        # What is beyond the window along z is set in its first and last layer: one more of each.
        depth = shape[2] + 2
        bits = np.zeros((*shape[:2], -(-depth // 64)), dtype=np.uint64)
        lows, walls = np.full(shape[:2], np.inf), np.full(shape[:2], np.inf)
        end = origin + np.array(shape) * cell
        for vertices, faces in upright.triangles(origin, end):
            soup = (vertices - origin) / cell + [0.0, 0.0, 1.0]
            mark_columns(
                np.ascontiguousarray(soup), np.ascontiguousarray(faces), 0, shape[0], -np.inf, bits,
                depth, lows, walls,
            )  # fmt: skip
        touched = _unpacked(bits)[:, :, 1 : shape[2] + 1].copy()
        (x0, y0, z0), (x1, y1, _) = low.tolist(), high.tolist()
        earth = self.voxels.earth[x0:x1, y0:y1].repeat(fine, 0).repeat(fine, 1)
        touched |= np.arange(shape[2]) < (earth[:, :, None] - z0) * fine
        return touched


def _finer(side: BoolArray, fine: int) -> BoolArray:
    """Each voxel as so many along each axis."""
    return np.asarray(side.repeat(fine, 0).repeat(fine, 1).repeat(fine, 2))


def _touched_in(voxels: Voxels, low: Voxel, high: Voxel) -> BoolArray:
    """What is touched or ground in a window, and what is beyond the border."""
    (x0, y0, z0), (x1, y1, z1) = low.tolist(), high.tolist()
    touched = _unpacked(voxels.bits[x0:x1, y0:y1])[:, :, z0:z1].copy()
    touched |= np.arange(z0, z1) < voxels.earth[x0:x1, y0:y1, None]
    nx, ny = voxels.shape
    if x0 == 0:
        touched[0] = True
    if y0 == 0:
        touched[:, 0] = True
    if x1 == nx:
        touched[-1] = True
    if y1 == ny:
        touched[:, -1] = True
    return touched


def _unpacked(bits: NDArray[np.uint64]) -> BoolArray:
    octets = np.ascontiguousarray(bits.astype("<u8")).view(np.uint8)
    return np.unpackbits(octets, axis=2, bitorder="little").view(np.bool_)


def narrowest(
    touched: BoolArray, inside: BoolArray, outside: BoolArray, grounded: bool
) -> tuple[FloatArray, float] | None:
    """Where the widest way between two sets of free voxels is narrowest, and how wide it is there.

    ``grounded``  whether what is below the lowest voxels is touched as well.

    Lengths in voxels; the width is the least that may be, or up to two more.  None if no way leads.
    """
    padded = np.pad(touched, ((0, 0), (0, 0), (1, 0)), constant_values=grounded)
    clear = ndimage.distance_transform_edt(~padded)[:, :, 1:]
    if not _joins(clear > 0.0, inside, outside):
        return None
    levels = np.unique(clear[clear > 0.0])
    first, last = 0, len(levels) - 1
    while first < last:
        level = (first + last + 1) // 2
        if _joins(clear >= levels[level], inside, outside):
            first = level
        else:
            last = level - 1
    way = (clear >= levels[first]) | inside | outside
    steps = _steps(way, inside) + _steps(way, outside)
    shortest = way & (steps >= 0) & (steps == steps[way & (steps >= 0)].min())
    # Over the ground a way is as low everywhere; what one passes is the surface alone.
    bare = ndimage.distance_transform_edt(~touched) if grounded else clear
    places = np.argwhere(shortest & (bare == bare[shortest].min()))
    # There may be several holes: that of the first place.
    places = places[np.abs(places - places[0]).max(axis=1) <= 2.0 * levels[first] + 2.0]
    return places.mean(axis=0) + 0.5, 2.0 * float(levels[first])


def _steps(way: BoolArray, side: BoolArray) -> NDArray[np.int32]:
    """From a side on a way; far below zero where none leads."""
    steps = np.where(side, 0, -1).astype(np.int32)
    walk(way, steps)
    steps[steps < 0] = -(1 << 28)
    return steps


def _joins(free: BoolArray, inside: BoolArray, outside: BoolArray) -> bool:
    """Whether a way leads from side to side; these count as free."""
    labels, _ = ndimage.label(free | inside | outside, structure=_ALL_AROUND)
    return len(np.intersect1d(labels[inside], labels[outside])) > 0
