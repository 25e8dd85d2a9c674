"""UprightScene -> Voxels -> Spaces: the free space around a scene's surfaces, in parts.

Columns of bits, and of them runs of free voxels: a grid takes a bit a voxel, and what is done with
it the time and the memory of its runs, a few a column.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplifier.camera_paths.columns import UprightScene
from simplifier.errors import OptionError
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.solid import BoolArray
from simplifier.kernels.threads import run_chunks
from simplifier.kernels.viewer_fill import (
    count_runs,
    join_runs,
    list_runs,
    list_touched,
    mark_columns,
    measure_spaces,
)

_MOST_BYTES = 1 << 31  # of bits: 130,000 columns of 100 voxels are 2 MB, a city of 2.6 km 110 MB
_FLAT = 1e-6  # of the scene's size: what lies no higher is its lowest plane
_BUMP = 12.0  # eye heights: what is no wider than twice this is no hill
_UNEVEN = 1.0  # eye heights over the lowest nearby, up to where walls stand on the ground

Triangles = Callable[[], list[tuple[FloatArray, IntArray]]]
Voxel = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Voxels:
    """What surfaces touch, in cubes that stand on the pixels of a height field.

    ``origin``  (3,) float64: corner of the first voxel, upright; ``cell`` the edge of a voxel.
    ``bits``    (nx, ny, words) uint64: bit z % 64 of word z // 64, touched.
    ``earth``   (nx, ny) int32: voxels from the bottom that are ground.
    ``depth``   voxels along z.
    """

    origin: FloatArray
    cell: float
    bits: NDArray[np.uint64]
    earth: IntArray
    depth: int

    @property
    def shape(self) -> tuple[int, int]:
        """Columns along x and y."""
        nx, ny, _ = self.bits.shape
        return nx, ny

    def place_of(self, points: FloatArray) -> Voxel:
        """The voxels (…, 3) of upright points."""
        return np.asarray(np.floor((points - self.origin) / self.cell), dtype=np.int64)


def voxels_of(
    upright: UprightScene, low: FloatArray, cell: float, shape: tuple[int, int], top: float,
    eye: float | None,
) -> Voxels:  # fmt: skip
    """The voxels from ``low`` up to ``top``, and which of them the surfaces touch.

    ``low``    (3,): corner of the first voxel, as low as all that may be seen; ``shape`` columns
               along x and y.
    ``eye``    eye height, where there is ground below what stands on it: below walls that begin no
               higher than that over the lowest things nearby.  None: the ground is the plane of
               ``low``.

    Raises :class:`OptionError` for more voxels than two GiB hold.
    """
    depth = max(int(np.ceil((top - low[2]) / cell - 1e-9)), 1)
    words = -(-depth // 64)
    needed = shape[0] * shape[1] * words * 8
    if needed > _MOST_BYTES:
        raise OptionError(
            f"filling by viewers would take {needed / 2**30:.1f} GiB of voxels", where="epsilon",
            remedy=f"choose one {np.ceil((needed / _MOST_BYTES) ** 0.5):g} times as large",
        )  # fmt: skip
    bits = np.zeros((*shape, words), dtype=np.uint64)
    lows, walls = np.full(shape, np.inf), np.full(shape, np.inf)
    flat = _FLAT * float(upright.extent.max()) / cell
    for vertices, faces in triangles_in(upright, low, cell):

        def mark(
            begin: int, end: int, soup: tuple[FloatArray, IntArray] = (vertices, faces)
        ) -> None:
            mark_columns(*soup, begin, end, flat, bits, depth, lows, walls)

        run_chunks(mark, shape[0], least=64)
    earth = np.zeros(shape, dtype=np.int32)
    if eye is not None:
        stands = _stands(lows, walls, eye / cell)
        earth[stands] = np.clip(lows[stands], 0, depth)
    return Voxels(low, cell, bits, earth, depth)


def triangles_in(
    upright: UprightScene, origin: FloatArray, cell: float
) -> list[tuple[FloatArray, IntArray]]:
    """All triangles, in voxels, in batches."""
    infinite = np.full(3, np.inf)
    return [
        (np.ascontiguousarray((vertices - origin) / cell), np.ascontiguousarray(faces))
        for vertices, faces in upright.triangles(-infinite, infinite)
    ]


def _stands(lows: FloatArray, walls: FloatArray, eye: float) -> BoolArray:
    """The columns in which a wall stands on the ground; all in voxels."""
    reach = 2 * int(np.ceil(_BUMP * eye)) + 1
    opened = ndimage.minimum_filter(lows, reach, mode="nearest")
    opened[np.isinf(opened)] = -np.inf
    opened = ndimage.maximum_filter(opened, reach, mode="nearest")
    return np.asarray(np.isfinite(walls) & (walls <= lows + 1.0) & (lows <= opened + _UNEVEN * eye))


@dataclass(frozen=True, eq=False)
class Spaces:
    """The parts of free space: voxels of one are joined by faces, edges or corners.

    ``starts``, ``firsts``, ``lasts``  the runs of free voxels in each column (see the kernels).
    ``of_run``   (k,) int64: the space of each run.
    ``boxes``    (m, 2, 3) int64: first and last voxel of each space; ``volumes`` (m,) its voxels;
                 ``tips`` (m, 3) one of its highest.
    """

    shape: tuple[int, int]
    starts: Voxel
    firsts: IntArray
    lasts: IntArray
    of_run: Voxel
    boxes: Voxel
    volumes: Voxel
    tips: Voxel

    @property
    def runs(self) -> tuple[Voxel, IntArray, IntArray, Voxel]:
        return self.starts, self.firsts, self.lasts, self.of_run

    @classmethod
    def of(cls, bits: NDArray[np.uint64], earth: IntArray, depth: int) -> Spaces:
        nx, ny, _ = bits.shape
        counts = np.empty(nx * ny, dtype=np.int64)
        count_runs(bits, earth, depth, counts)
        starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
        firsts, lasts = np.empty((2, starts[-1]), dtype=np.int32)
        list_runs(bits, earth, depth, starts, firsts, lasts)
        of_run = np.arange(starts[-1], dtype=np.int64)
        count = int(join_runs(starts, firsts, lasts, ny, of_run))
        boxes = np.empty((count, 2, 3), dtype=np.int64)
        boxes[:, 0], boxes[:, 1] = np.iinfo(np.int64).max, -1
        volumes, tips = np.zeros(count, dtype=np.int64), np.zeros((count, 3), dtype=np.int64)
        measure_spaces(starts, firsts, lasts, of_run, ny, boxes, volumes, tips)
        return cls((nx, ny), starts, firsts, lasts, of_run, boxes, volumes, tips)

    def __len__(self) -> int:
        return len(self.volumes)

    def touched(self, windows: Voxel, ground: bool) -> tuple[Voxel, Voxel]:
        """Which windows (c, 2, 3), first and last voxel, meet which spaces, as pairs, each once."""
        room = 4 * len(windows) + 64
        while True:
            cells, found = np.empty((2, room), dtype=np.int64)
            stamps = np.full(len(self), -1, dtype=np.int64)
            count = list_touched(windows, *self.runs, self.shape, ground, stamps, cells, found)
            if count <= room:
                return cells[:count], found[:count]
            room = int(count)

    def at(self, place: Voxel) -> int:
        """The space of a voxel (3,), or -1."""
        column = int(place[0]) * self.shape[1] + int(place[1])
        begin, end = self.starts[column : column + 2]
        run = begin + int(np.searchsorted(self.firsts[begin:end], place[2], "right")) - 1
        return int(self.of_run[run]) if run >= begin and self.lasts[run] >= place[2] else -1
