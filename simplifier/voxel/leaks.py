"""Does the outside reach into a shape that looks as if it should enclose something?

What would close an open surface: each remedy is tried on the voxels, and its gain told.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from simplifier.geometry.solid import VoxelGrid
from simplifier.kernels.fill import count_hollow
from simplifier.kernels.threads import run_each
from simplifier.voxel.fill import Side, enclose

_ENCLOSED = 0.02  # enclosed voxels, as a share of the touched ones, below which little is inside
_SIDES = 5  # of six, that have the surface in sight: one may be what is open
_HOLLOW = 0.5  # hollow voxels, likewise, above which much should be inside


def leaks(touched: VoxelGrid, filled: VoxelGrid) -> bool:
    """True when the fill found next to nothing inside though the shape is hollow.

    A box without a lid has many hollow voxels, a flat sheet or a terrain few.
    """
    enclosed = filled.count - touched.count
    if enclosed > _ENCLOSED * touched.count:
        return False
    return hollow_count(touched) > _HOLLOW * touched.count


def hollow_count(touched: VoxelGrid) -> int:
    """Free voxels that see the surface along at least five of the six axis directions."""
    return int(count_hollow(np.ascontiguousarray(touched.inside), _SIDES))


_HOLES = (2, 4, 8)  # voxels; the first that helps is told
_MUCH = 0.5  # of the hollow voxels, that a remedy closes to be worth a word


@dataclass(frozen=True)
class Remedy:
    """One change of the options that would keep the outside out.

    ``ground``  the side that would be ground, or None.
    ``hole``    the smallest hole in world units, 0 where the ground is enough.
    ``share``   of the grid's voxels that it would add to the solid.
    """

    ground: Side | None
    hole: float
    share: float

    @property
    def advice(self) -> str:
        """Options by name and value, in words that hold wherever they are given."""
        options = f"smallest hole {self.hole:g}"
        if self.ground is not None:
            axis, end = self.ground
            options = f"{'turned over, ' if end else ''}ground with up {'xyz'[axis]}"
        return f"{options} (closes {100.0 * self.share:.0f} % of the grid)"


def leak_warning(
    touched: VoxelGrid, filled: VoxelGrid, closed_sides: frozenset[Side], smallest_hole: float
) -> str:
    """What to say of voxels that leak; arguments as of :func:`remedies`."""
    helps = [remedy.advice for remedy in remedies(touched, filled, closed_sides, smallest_hole)]
    voxels = max(touched.shape)
    what = (
        f"the mesh is not watertight at {voxels} voxels,"
        " so only its surface hides, and not what it seems to enclose"
    )
    if helps:
        return f"{what}; try {', or '.join([*helps, 'a lower resolution'])}"
    return (
        f"{what}; neither ground nor a smallest hole of 8 voxels closes it; try a lower resolution"
    )


def remedies(
    touched: VoxelGrid, filled: VoxelGrid, closed_sides: frozenset[Side], smallest_hole: float
) -> list[Remedy]:
    """The ground that adds most and the smallest hole that helps, for voxels that leak.

    ``filled``, ``closed_sides`` and ``smallest_hole`` (voxels) are what was found and how.  A
    remedy helps when it closes half of what looks hollow.  A larger hole closes nearly all that a
    smaller one does, so the largest tells whether any helps.  Costs up to six floods and three
    closings.
    """
    size = math.prod(touched.shape)
    least = _MUCH * hollow_count(touched) / size

    def tried(side: Side | None, hole: float) -> Remedy:
        """``hole`` in world units; 0 for the one that was tried."""
        sides = closed_sides if side is None else frozenset({side})
        closed, _ = enclose(
            touched, sides, touched.in_voxels(hole) if hole > 0.0 else smallest_hole
        )
        return Remedy(side, hole, (closed.count - filled.count) / size)

    sides = [side for side in product(range(3), (0, -1)) if side not in closed_sides]
    holes = list(_holes(touched, smallest_hole))
    ways = [*((None, hole) for hole in holes[-1:]), *((side, 0.0) for side in sides)]
    made = run_each(lambda way: tried(*way), ways)
    found = [max(made[-len(sides) :], key=lambda remedy: remedy.share)]
    if holes and made[0].share >= least:
        smaller = (tried(None, hole) for hole in holes[:-1])
        found.append(next((remedy for remedy in smaller if remedy.share >= least), made[0]))
    return [remedy for remedy in found if remedy.share >= least]


def _holes(touched: VoxelGrid, smallest_hole: float) -> Iterator[float]:
    """World units of two digits: larger than what was tried, no larger than the mesh."""
    for voxels in _HOLES:
        length = _round_up(voxels * touched.cell_size)
        if smallest_hole < touched.in_voxels(length) <= max(touched.shape):
            yield length


def _round_up(length: float) -> float:
    """To two digits, as a person would type it."""
    step = 10.0 ** (math.floor(math.log10(length)) - 1)
    return float(f"{math.ceil(length / step - 1e-9) * step:.2g}")
