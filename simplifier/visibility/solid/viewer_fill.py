"""HeightField + ViewCells -> HeightField: what viewers cannot come near to is solid.

For scenes of open sheets, which have no inside of their own: facades, terrain, houses without
floors.

Let a *space* be a part of the free voxels, those that no surface touches, whose voxels share faces,
edges or corners.  All lines of sight from cells to objects stay in the box around both, so spaces
end at it.  A cell *meets* a space if one of its voxels is the same as, or beside, a voxel of the
cell.  Solid to a cell is every space that it does not meet.

*A line of sight from the cell that enters such a space crosses the surface*, or runs through a hole
in it in which no free voxel is.  For it begins in a voxel of the cell: a free one is of a space
that the cell meets, and all free ones beside a touched one are as well.  Between the last voxel of
spaces that are met and the first of one that is not, voxels of which two would be joined if they
were neighbours, it passes touched voxels alone.  Either it crosses what touches them, or at each
point it is no further from it than the diagonal of a voxel: a hole of 2 sqrt(3) voxels lets a free
one through wherever it is, and a slot along the grid does if it is 2 wide.

*Touched voxels are solid* if a solid space is beside them and no other one: walls between rooms
and floors.  A line that comes there passes a touched voxel before as well, so the same holds.  A
wall to the outside is beside open space, and does not count.

*It is proven*, holes or not, where closed pieces of the mesh have the space within and all cells
without: pieces are what shares corners, and each crosses a line upwards an odd number of times.
Then touched voxels do not count, and the sets are called conservative.  So they are of all scenes
whose pieces are closed, even if those stand closer together than a voxel.

*One space is solid to no cell*, the one that most cells meet, and so are others that many cells
meet without it.  What else a cell meets, the rooms that it reaches into, hides nothing from that
cell alone: it is left out by its box, as objects are that stand in a cell.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.scene import Scene
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.view_cells import ViewCells
from simplifier.kernels.threads import run_chunks
from simplifier.kernels.viewer_fill import lower_roofs, stack_solid
from simplifier.visibility.solid.closed_pieces import signatures
from simplifier.visibility.solid.fill_leaks import FillLeak, find_leaks
from simplifier.visibility.solid.height_field import HeightField, Rooms
from simplifier.visibility.solid.spaces import Spaces, Voxels, triangles_in, voxels_of

_SHARED = 0.1  # of the cells, that make a space open to all if they meet it and not the largest
_DOUBTFUL = 0.01  # of the solid, that is not proven, and is left out where all else is
_HOLE = 2.0 * 3.0**0.5  # voxels: a hole as wide has a free voxel in it, however it lies

Pairs = tuple[NDArray[np.int64], NDArray[np.int64]]


@dataclass(frozen=True, eq=False)
class Filled:
    """Heights with what viewers cannot reach, and how sure that is.

    ``conservative``  whether closed pieces of the mesh prove all of it.
    ``hole``          a length: what is narrower may have been missed, where that is not so.
    ``leaks``         the largest spaces that are open through small holes alone, of ``leak_count``.
    """

    field: HeightField
    conservative: bool
    hole: float
    leaks: tuple[FillLeak, ...]
    leak_count: int


def fill_by_viewers(
    field: HeightField,
    upright: UprightScene,
    cells: ViewCells,
    eye: float | None,
    opaque: Scene | None = None,
) -> Filled:
    """Raise the heights of a field to what no cell reaches through free space.

    ``cells``  upright, those that the field will be looked at from, and no others.
    ``eye``    eye height, where there is ground below what stands on it, else None: see
               :func:`~simplifier.visibility.solid.spaces.voxels_of`.
    ``opaque`` what of the scene hides anything: by default all of it.

    Raises :class:`~simplifier.errors.OptionError` for more voxels than there is room for.
    """
    top = max(float(upright.extent[2]), float(cells.high[:, 2].max()))
    low = np.array([*field.low, upright.boxes[:, 0, 2].min()])
    if opaque is not None:
        upright = upright.with_scene(opaque)
    voxels = voxels_of(upright, low, field.cell, field.shape, top, eye)
    spaces = Spaces.of(voxels.bits, voxels.earth, voxels.depth)
    windows = _windows(voxels, cells)
    met = spaces.touched(windows, eye is not None)
    is_open = open_spaces(spaces, met, len(cells))
    signs, closed = signatures(upright, voxels, spaces.tips)
    shut, proven = _proven(spaces, met, is_open, signs, closed)
    inner = np.maximum(field.inner, _heights(upright, voxels, spaces, shut, not proven))
    leaks: tuple[FillLeak, ...] = ()
    leak_count = 0
    if not closed:
        leaks, leak_count = find_leaks(
            upright, voxels, spaces, is_open, lambda some: _open_now(some, windows, eye), inner
        )
    rooms = _rooms(spaces, met, shut, len(cells), cells)
    full = replace(field, inner=inner, rooms=rooms, lost=_lost(inner, field.tops, voxels.origin[2]))
    return Filled(full, proven, _HOLE * field.cell, leaks, leak_count)


def _windows(voxels: Voxels, cells: ViewCells) -> NDArray[np.int64]:
    """(c, 2, 3) first and last voxel of each cell, with all that are beside."""
    windows = np.stack([voxels.place_of(cells.low) - 1, voxels.place_of(cells.high) + 1], axis=1)
    return np.ascontiguousarray(np.maximum(windows, 0))


def open_spaces(spaces: Spaces, met: Pairs, count: int) -> BoolArray:
    """(m,) the spaces that are solid to no cell, of which there are ``count``."""
    cells, found = met
    is_open = np.zeros(len(spaces), dtype=np.bool_)
    if len(found) == 0:
        return is_open
    times = np.bincount(found, minlength=len(spaces))
    most = np.flatnonzero(times == times.max())
    main = most[np.argmax(spaces.volumes[most])]
    within = np.zeros(count, dtype=np.bool_)
    within[cells[found == main]] = True
    apart = np.bincount(found[~within[cells]], minlength=len(spaces))
    is_open |= apart > _SHARED * count
    is_open[main] = True
    return is_open


def _open_now(
    spaces: Spaces, windows: NDArray[np.int64], eye: float | None
) -> tuple[BoolArray, BoolArray]:
    """Which of other spaces are open, and which does any cell meet."""
    met = spaces.touched(windows, eye is not None)
    seen = np.zeros(len(spaces), dtype=np.bool_)
    seen[met[1]] = True
    return open_spaces(spaces, met, len(windows)), seen


def _proven(
    spaces: Spaces, met: Pairs, is_open: BoolArray, signs: NDArray[np.uint64], closed: bool
) -> tuple[BoolArray, bool]:
    """(m,) the spaces that count as solid, and whether closed pieces prove that.

    A line between spaces of other signatures crosses a closed piece.  Where all pieces are closed,
    what they do not prove is left out.
    """
    shut = ~is_open
    viewed = is_open.copy()
    viewed[met[1]] = True
    sorts, sort = np.unique(signs, return_inverse=True)
    alike = np.bincount(sort.reshape(-1)[viewed], minlength=len(sorts))[sort.reshape(-1)]
    sure = shut & (alike - viewed == 0)
    doubtful = int(spaces.volumes[shut & ~sure].sum())
    if closed or doubtful <= _DOUBTFUL * int(spaces.volumes[shut].sum()):
        return sure, True
    return shut, False


def _heights(
    upright: UprightScene, voxels: Voxels, spaces: Spaces, shut: BoolArray, sheets: bool
) -> NDArray[np.float32]:
    """(nx, ny) up to where columns are solid all over, from the bottom to the first gap.

    Below a roof that is up to its lowest point in the column: what is between the highest solid
    voxel and that is joined to it.
    """
    reached = np.empty(voxels.shape, dtype=np.int32)
    stack_solid(*spaces.runs, shut, voxels.earth, voxels.depth, sheets, reached)
    reached[reached <= voxels.earth] = 0
    roofs = np.where(reached == voxels.depth, float(voxels.depth), np.inf)
    for vertices, faces in triangles_in(upright, voxels.origin, voxels.cell):

        def lower(
            begin: int, end: int, soup: tuple[FloatArray, NDArray[np.int32]] = (vertices, faces)
        ) -> None:
            lower_roofs(*soup, begin, end, reached, roofs)

        run_chunks(lower, voxels.shape[0], least=64)
    solid = reached > 0
    heights = np.full(voxels.shape, -np.inf)
    heights[solid] = np.where(np.isfinite(roofs), roofs, reached)[solid] * voxels.cell
    heights[solid] += voxels.origin[2] - 1e-9 * voxels.cell
    near = heights.astype(np.float32)
    return np.where(near > heights, np.nextafter(near, np.float32(-np.inf)), near)


def _rooms(spaces: Spaces, met: Pairs, shut: BoolArray, count: int, cells: ViewCells) -> Rooms:
    """The boxes in plan of solid spaces that cells meet, with what is beside, by cell."""
    inside = shut[met[1]]
    which, found = met[0][inside], met[1][inside]
    boxes = spaces.boxes[found, :, :2] + np.array([[-1], [1]])
    # Who stands where everything is touched may look along a gap that no voxel fits in.
    lost = np.setdiff1d(np.arange(count), met[0])
    everything = np.array([[0, 0], spaces.shape])
    which = np.concatenate([which, lost])
    boxes = np.concatenate([boxes, np.tile(everything, (len(lost), 1, 1))])
    order = np.argsort(which, kind="stable")
    boxes = boxes[order]
    starts = np.searchsorted(which[order], np.arange(count + 1)).astype(np.int64)
    return Rooms.of(cells, starts, boxes)


def _lost(inner: NDArray[np.float32], tops: NDArray[np.float32], bottom: float) -> float:
    """Share of what is below the tops that is not solid; borders are touched but not covered."""
    full = ndimage.minimum_filter(tops, 3, mode="constant", cval=-np.inf).astype(np.float64)
    there = np.isfinite(full) & (full > bottom)
    filled = float((full[there] - bottom).sum())
    kept = float(np.clip(np.minimum(inner[there], full[there]) - bottom, 0.0, None).sum())
    return 1.0 - kept / filled if filled > 0.0 else 0.0


def fill_warnings(filled: Filled) -> list[str]:
    """What the user should know of it."""
    told = []
    if not filled.conservative:
        told.append(
            "closed pieces of the mesh do not prove what counts as solid: what shows through holes"
            f" narrower than {filled.hole:.3g} may be missing, and the file is not called"
            " conservative"
        )
    for leak in filled.leaks:
        size = " x ".join(f"{length:.3g}" for length in leak.size)
        place = ", ".join(f"{value:.7g}" for value in leak.point)
        told.append(
            f"a space of about {size} near '{leak.name}' hides nothing: there is a hole about"
            f" {leak.width:.3g} wide at {place}"
        )
    more = filled.leak_count - len(filled.leaks)
    if more:
        told.append(f"{more:,} smaller spaces have such holes as well")
    return told
