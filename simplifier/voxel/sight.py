"""VoxelGrid -> VoxelGrid: what cannot be seen from outside is inside, whether it is closed or not.

Flood fill asks whether a path leads out, and one hole lets it find nothing inside.  What counts for
an occluder is whether a straight line leads out to a viewer: what lies behind a point that no
viewer sees lies behind the surface that hides that point (docs/decisions/0017).

The ancestor is ray stabbing: F. Nooruddin, G. Turk, "Simplification and Repair of Polygonal Models
Using Volumetric Techniques" (2003), section 4.
"""

from __future__ import annotations

from functools import cache
from itertools import permutations, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.bit_grid import BitGrid
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray, VoxelGrid
from simplifier.kernels.sight import (
    BLOCK,
    FRAME,
    count_few,
    count_sight,
    draw_voxels,
    list_voxels,
    mark_seen,
    picture_size,
    set_voxels,
)
from simplifier.kernels.threads import run_chunks
from simplifier.progress import TellShare, silent
from simplifier.voxel.morphology import with_neighbours

_SPREAD = np.array(
    [
        (0.0997, 0.2305, 0.9679),
        (0.1029, 0.4394, 0.8924),
        (0.2995, 0.4441, 0.8444),
        (0.1338, 0.6248, 0.7692),
        (0.4118, 0.5712, 0.7100),
    ]
)
"""Directions whose images under the 48 symmetries of the cube, 240 of them, are spread evenly: the
nearest two are 10.6 degrees apart.  A mesh that is turned by a quarter has the same solid, turned.
"""

Looks = NDArray[np.uint8]
Sides = NDArray[np.uint16]
Places = NDArray[np.int16]

_AT_ONCE = 8  # lines of sight between two looks at which voxels need more
_FEW = 2  # times fewer voxels than hide: then only what lies behind or before them is drawn
_PLAIN = 96  # voxels along the longest edge up to which every voxel is looked at
_CELL = 4  # voxels a side of the cells that finer grids are looked at in first


def fill_unseen(
    touched: VoxelGrid,
    enclosed: VoxelGrid,
    tolerance: float,
    up: int | None = None,
    tell: TellShare = silent,
) -> VoxelGrid:
    """Add the free voxels that are seen from at most a share of all directions.

    ``touched``    the voxels that the surface touches; they alone hide.
    ``enclosed``   what is inside anyway, of the same grid; all of it stays.
    ``tolerance``  that share, 0 to 1.
    ``up``         0 to 2 where viewers look level or downwards along that axis; None: anywhere.

    A voxel is seen from a direction when no touched voxel lies before its centre there.  In grids
    of more than 96 voxels those that are away from the surface are judged by cells of 4 x 4 x 4.
    """
    hidden = unseen(touched.bits, tolerance, up, enclosed.bits, tell)
    return touched.with_inside(enclosed.bits | hidden)


def unseen(
    touched: BitGrid,
    tolerance: float,
    up: int | None = None,
    known: BitGrid | None = None,
    tell: TellShare = silent,
) -> BitGrid:
    """The voxels that are neither touched nor known, and hardly seen."""
    free = ~touched if known is None else ~(touched | known)
    if max(touched.shape) <= _PLAIN:
        return few_see(touched, free, tolerance, up, tell)
    cells = _joined(touched, _CELL)
    judged = unseen(BitGrid.of(cells), tolerance, up).voxels
    near = with_neighbours(cells)
    hidden = _parted(judged & ~near, _CELL, touched.shape) & free
    looked_at = _parted(near, _CELL, touched.shape) & free
    return hidden | few_see(touched, looked_at, tolerance, up, tell)


def few_see(
    touched: BitGrid,
    free: BitGrid,
    tolerance: float,
    up: int | None = None,
    tell: TellShare = silent,
) -> BitGrid:
    """The ``free`` voxels that are seen from at most that share of directions.

    ``free``  the voxels to judge, none of them ``touched``.
    """
    frames, senses = lines_of_sight(touched.shape, up)
    limit = int(np.floor(tolerance * int(senses.sum()) * (1.0 + 1e-9)))
    places = _listed(free)
    seen = np.zeros(len(places), dtype=np.uint16)
    live = _whole_blocks(len(places))
    voxels = np.ascontiguousarray(_shell(touched).T)
    size = picture_size(touched.shape)
    depths = np.empty((_AT_ONCE, size, size, 2), dtype=np.float32)
    first = 0
    while first < len(frames) and live.any() and _FEW * int(live.sum()) >= voxels.shape[1]:
        some, looks = frames[first : first + _AT_ONCE], senses[first : first + _AT_ONCE]

        def draw(begin: int, end: int, some: FloatArray = some) -> None:
            draw_voxels(voxels, some, begin, end, depths)

        def count(begin: int, end: int, some: FloatArray = some, looks: Looks = looks) -> None:
            count_sight(places, some, looks, depths, limit, begin, end, seen, live)

        run_chunks(draw, len(some))
        run_chunks(count, len(live))
        first += len(some)
        tell(first / len(frames))
    if first < len(frames):
        left = (np.arange(BLOCK) < live[:, None]).ravel()[: len(places)]
        places = _still_hidden(
            voxels, places[left], seen[left], frames[first:], senses[first:], limit, size
        )
        live = _whole_blocks(len(places))
    hidden = BitGrid.empty(touched.shape)
    set_voxels(places, live, hidden.words)
    return hidden


def _whole_blocks(count: int) -> NDArray[np.int64]:
    """How many of so many candidates each block has."""
    live = np.full(-(-count // BLOCK), BLOCK)
    live[-1:] -= BLOCK * len(live) - count
    return live


def _still_hidden(
    voxels: Places,
    places: Places,
    seen: Sides,
    frames: FloatArray,
    senses: Looks,
    limit: int,
    size: int,
) -> Places:
    """Of the few ``places`` (n, 3) those that are seen from no more sides than the limit, where
    ``voxels`` (3, m) hide and so many see them already."""
    at_once = _AT_ONCE
    while len(frames) > 0 and len(places) > 0:
        seen = seen + _sides_seen(voxels, places, frames[:at_once], senses[:at_once], size)
        places, seen = places[seen <= limit], seen[seen <= limit]
        frames, senses = frames[at_once:], senses[at_once:]
        at_once *= 2  # ever fewer are taken out, and a round is a hand-over to another thread
    return places


def _sides_seen(
    voxels: Places, places: Places, frames: FloatArray, senses: Looks, size: int
) -> Sides:
    """(n,) from how many sides each of a few places is seen in these lines of sight."""
    sides = np.empty((len(frames), len(places)), dtype=np.uint8)
    few = np.ascontiguousarray(places.T)
    run_chunks(
        lambda begin, end: count_few(voxels, few, frames, senses, size, begin, end, sides),
        len(frames),
    )
    return np.asarray(sides.sum(axis=0, dtype=np.uint16))


def seen_from(touched: BoolArray, candidates: BoolArray, eyes: FloatArray) -> BoolArray:
    """(nx, ny, nz) bool: the candidates whose centre one of the eyes sees past all touched voxels.

    ``candidates``  free voxels, none of them ``touched``.
    ``eyes``        (n, 3) grid space; the voxel that holds an eye does not hide from it.

    In grids of more than 96 voxels cells of several are judged, none of whose voxels is touched; up
    to as many voxels from there, those between the cells and the surface are seen as well.
    """
    if len(eyes) == 0:
        return np.zeros_like(touched)
    size = -(-max(touched.shape) // _PLAIN)
    if size > 1:
        free, cells = BitGrid.of(candidates), _joined(BitGrid.of(touched), size)
        seen = seen_from(cells, _joined(free, size) & ~cells, eyes / size)
        seen = (_parted(seen, size, touched.shape) & free).voxels
        for _ in range(size):
            seen = with_neighbours(seen) & candidates
        return seen
    seen = np.zeros_like(touched)
    places = np.ascontiguousarray(eyes, dtype=np.float64)
    run_chunks(
        lambda begin, end: mark_seen(touched, candidates, places, begin, end, seen), len(touched)
    )
    return seen


def lines_of_sight(shape: tuple[int, ...], up: int | None) -> tuple[FloatArray, Looks]:
    """Frames (a, 12) as in :mod:`simplifier.kernels.sight`, and who looks along them (a, 2)."""
    axes = _axes()
    frames = np.empty((len(axes), FRAME))
    frames[:, :9] = axes
    frames[:, 9:] = np.array(shape) / 2.0
    senses = np.ones((len(frames), 2), dtype=np.uint8)
    if up is not None:
        rise = frames[:, 6 + up]
        senses[:, 0], senses[:, 1] = rise <= 0.0, rise >= 0.0
    return frames, senses


@cache
def _axes() -> FloatArray:
    """(a, 9) rows u, v, d of each line: two across it, and the one along it."""
    low = np.array([1.0, 0.0, 0.0])
    u = np.cross(low, _SPREAD)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    d = _SPREAD / np.linalg.norm(_SPREAD, axis=1, keepdims=True)
    base = np.stack([u, np.cross(d, u), d], axis=1)
    return np.stack([base @ turn.T for turn in _turns()]).reshape(-1, 9)


def _turns() -> list[FloatArray]:
    """The 24 rotations that take a cube to itself."""
    matrices = []
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        matrix = np.zeros((3, 3))
        matrix[range(3), order] = signs
        if np.linalg.det(matrix) > 0.0:
            matrices.append(matrix)
    return matrices


def _shell(touched: BitGrid) -> Places:
    """(n, 3) the touched voxels that are not walled in by others on all six sides."""
    words = touched.words
    walled = words.copy()
    for ahead, behind in ((np.s_[1:], np.s_[:-1]), (np.s_[:, 1:], np.s_[:, :-1])):
        walled[ahead] &= words[behind]
        walled[behind] &= words[ahead]
    walled[0], walled[-1], walled[:, 0], walled[:, -1] = 0, 0, 0, 0
    walled &= touched.follow
    walled &= touched.precede
    return _listed(BitGrid(words & ~walled, touched.depth))


def _listed(marked: BitGrid) -> Places:
    """(n, 3) the voxels that are set, in order."""
    words = marked.words
    ends = np.cumsum(np.bitwise_count(words).sum(axis=(1, 2), dtype=np.int64))
    firsts, places = np.concatenate([[0], ends]), np.empty((ends[-1], 3), dtype=np.int16)
    run_chunks(lambda begin, end: list_voxels(words, firsts, begin, end, places), len(words))
    return places


def _joined(touched: BitGrid, size: int) -> BoolArray:
    """Cells of ``size`` voxels a side: whether any of theirs is touched."""
    words = _or_each(_or_each(touched.words, size, 0), size, 1)
    return _or_each(BitGrid(words, touched.depth).voxels, size, 2)


def _or_each(values: NDArray[Any], size: int, axis: int) -> NDArray[Any]:
    """Values along an axis, each ``size`` of them joined; the last of these may be fewer."""
    turned = values.swapaxes(0, axis)
    joined = turned[::size].copy()
    for first in range(1, size):
        part = turned[first::size]
        joined[: len(part)] |= part
    return np.ascontiguousarray(joined.swapaxes(0, axis))


def _parted(cells: BoolArray, size: int, shape: tuple[int, int, int]) -> BitGrid:
    """Each voxel as its cell."""
    nx, ny, nz = shape
    words = BitGrid.of(cells.repeat(size, axis=2)[:, :, :nz]).words
    for axis in range(2):
        words = words.repeat(size, axis=axis)
    return BitGrid(words[:nx, :ny], nz)
