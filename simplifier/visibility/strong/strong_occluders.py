"""ConvexBodies + ViewCells -> what each cell may see: what no single convex body hides.

Cohen-Or, Fibich, Halperin and Zadicario, "Conservative Visibility and Strong Occlusion for
Viewspace Partitioning of Densely Occluded Scenes" (1998).  A convex body that all segments from
corners of a cell to corners of a target meet hides the target from all of the cell: it is a strong
occluder.  For a fixed viewpoint the points that a convex body hides are convex, and so are, for a
fixed target point, those that it is hidden from.

What stands in a cell is visible from it, and hides nothing from it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.view_cells import PRISM, ViewCells
from simplifier.kernels.hull_rays import FIRST_PIECE, NO_PIECES, clear_bodies, hide_from_cell
from simplifier.kernels.threads import run_chunks
from simplifier.visibility.strong.box_tree import BoxTree
from simplifier.visibility.strong.convex_bodies import MARGIN, ConvexBodies

CACHE = 4
"""Bodies that hid the targets looked at before, and are tried first."""

GROUP = 64
"""Most targets that are looked at as one."""

_WORTHWHILE = 0.8  # of the bodies' median width: larger cells than that lose most of what they hide
_FEW = 4  # cells for which no larger one around them is looked at
_HAIR = 1e-9  # radians
_NONE = np.empty((0, 2), dtype=np.int64), np.empty((0, 3, 3))

Cell = tuple[FloatArray, FloatArray, FloatArray, float]
Pairs = tuple[NDArray[np.int64], FloatArray]


@dataclass(frozen=True)
class Tactics:
    """What is done to test fewer segments; none of it shows more than is visible.

    ``hull``    only segments on the hull of cell and target.
    ``cache``   bodies that are tried first, since they hid what was looked at before.
    ``dilute``  what is hidden by one body hides nothing more, since that body does as well.
    ``group``   most targets that are tested as one; 1 tests each by itself.
    ``pieces``  whether triangles of targets are looked at, of :mod:`simplifier.kernels.hull_rays`.
    """

    hull: bool = True
    cache: int = CACHE
    dilute: bool = True
    group: int = GROUP
    pieces: int = FIRST_PIECE

    @property
    def numbers(self) -> NDArray[np.int64]:
        """As the kernel takes them."""
        some = [self.cache, self.dilute, self.group, self.pieces]
        return np.array(some, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Hidden:
    """What is hidden from each of some cells.

    ``hidden``  (c, n) bool targets.  ``by`` (c, n) int64: the body that hides each as a whole, -1
                where there is none.
    ``pieces``  (c, t) bool: triangles of what no body hides as a whole.
    ``work``    (c, 3) int64: tests of segments against bodies, boxes that were looked at, and
                tests of segments for triangles.
    """

    hidden: BoolArray
    by: NDArray[np.int64]
    pieces: BoolArray
    work: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class StrongOccluders:
    """Targets, and what may hide them.

    ``bodies``    that hide.
    ``targets``   (n, 2, 3) float64 boxes.
    ``body_starts``  (n + 1,) int64: the bodies that are parts of each target.
    ``piece_starts``, ``pieces``  (n + 1,) int64 and (t, 3, 3) float64: triangles of targets, which
                  are looked at where no body hides the box as a whole.
    """

    bodies: ConvexBodies
    targets: FloatArray
    body_starts: NDArray[np.int64]
    piece_starts: NDArray[np.int64]
    pieces: FloatArray
    body_tree: BoxTree = field(init=False)
    target_tree: BoxTree = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "body_tree", BoxTree.of(self.bodies.boxes))
        object.__setattr__(self, "target_tree", BoxTree.of(self.targets))

    @classmethod
    def of_boxes(cls, boxes: FloatArray) -> StrongOccluders:
        """Of solid boxes (n, 2, 3), which are both."""
        bodies = ConvexBodies.of_boxes(boxes, margin_of(boxes))
        starts = np.zeros(len(boxes) + 1, dtype=np.int64)
        return cls(bodies, boxes, np.arange(len(boxes) + 1), starts, np.empty((0, 3, 3)))

    def hide(
        self, cells: ViewCells, tactics: Tactics | None = None, known: BoolArray | None = None
    ) -> Hidden:
        """What is hidden from each cell; ``known`` (c, n) is hidden already."""
        tactics = tactics or Tactics()
        count = len(self.targets)
        found = Hidden(
            np.zeros((len(cells), count), dtype=np.bool_) if known is None else known.copy(),
            np.full((len(cells), count), -1, dtype=np.int64),
            np.zeros((len(cells), len(self.pieces)), dtype=np.bool_),
            np.zeros((len(cells), 3), dtype=np.int64),
        )
        margin = margin_of(np.concatenate([self.targets, _boxes_of(cells)]))

        def look(begin: int, end: int) -> None:
            for cell in range(begin, end):
                self._look(
                    cell_of(cells, cell, margin), pairs_of(cells, cell), tactics, found, cell
                )

        run_chunks(look, len(cells))
        return found

    def _look(self, cell: Cell, pairs: Pairs, tactics: Tactics, found: Hidden, row: int) -> None:
        bodies = self.bodies
        arrays = (bodies.kinds, bodies.starts, bodies.planes, self._body_boxes)
        usable = np.ones(len(bodies), dtype=np.bool_)
        clear_bodies(arrays, cell[0], cell[1], usable)
        hide_from_cell(
            cell, *(pairs if tactics.hull else _NONE), arrays, self.body_tree.arrays,
            self.target_tree.arrays, self.body_starts, (self.piece_starts, self.pieces),
            tactics.numbers, usable, found.hidden[row], found.by[row], found.pieces[row],
            found.work[row],
        )  # fmt: skip

    @property
    def _body_boxes(self) -> FloatArray:
        return self.bodies.boxes.reshape(-1, 6)


def margin_of(boxes: FloatArray) -> float:
    """By how much bodies are shrunk, for rounding, among boxes (n, 2, 3)."""
    return MARGIN * float((boxes[:, 1].max(axis=0) - boxes[:, 0].min(axis=0)).max())


def _boxes_of(cells: ViewCells) -> FloatArray:
    return np.stack([cells.low, cells.high], axis=1)


def cell_of(cells: ViewCells, cell: int, margin: float) -> Cell:
    """A cell as the kernel takes it: corners, planes, the highest middle, and the margin."""
    plan, low, high = cells.outline(cell), cells.low[cell], cells.high[cell]
    corners = np.concatenate([np.column_stack([plan, np.full(len(plan), z)]) for z in
                              (low[2], high[2])])  # fmt: skip
    along = np.roll(plan, -1, axis=0) - plan
    normals = np.column_stack([along[:, 1], -along[:, 0], np.zeros(len(plan))])
    normals = np.concatenate([normals, [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]])
    reach = (corners @ normals.T).max(axis=0)
    eye = np.array([*plan.mean(axis=0), high[2]])
    return corners, np.column_stack([normals, reach]), eye, margin


def pairs_of(cells: ViewCells, cell: int) -> Pairs:
    """Corners of a cell and of any box that are both furthest in some directions, and what spans
    these directions, as ``bridges`` of :mod:`simplifier.kernels.hull_rays` takes them.
    """
    plan = cells.outline(cell)
    along = np.roll(plan, -1, axis=0) - plan
    turns = np.arctan2(-along[:, 0], along[:, 1])  # of the normals outwards
    quarters = np.pi * np.array([0.0, 0.5, 1.0, 1.5])
    exact = cells.kinds[cell] != PRISM
    pairs, cones = [], []
    for corner in range(len(plan)):
        first, last = turns[corner - 1], turns[corner]
        last = first + (last - first) % (2.0 * np.pi)
        for quarter, begin in enumerate(quarters):
            begin += 2.0 * np.pi * np.floor((last - begin) / (2.0 * np.pi))
            for start in (begin, begin - 2.0 * np.pi):
                low, high = max(first, start), min(last, start + 0.5 * np.pi)
                if high - low < (_HAIR if exact else -_HAIR):
                    continue
                # Wider by a hair, which drops fewer segments.
                turned = (low - _HAIR, high + _HAIR)
                ends = np.array([[np.cos(turn), np.sin(turn), 0.0] for turn in turned])
                ends = np.round(ends) if exact else ends
                for top in (0, 1):
                    there = 4 * (quarter in (0, 3)) + 2 * (quarter in (0, 1)) + top
                    pairs.append((corner + top * len(plan), there))
                    cones.append([*ends, [0.0, 0.0, 2.0 * top - 1.0]])
    return np.array(pairs, dtype=np.int64), np.array(cones)


def parents_of(cells: ViewCells, width: float) -> tuple[ViewCells, NDArray[np.int64]]:
    """Boxes around the cells of each square of a ``width`` in plan, and (c,) int64 which is whose;
    -1 for cells that have few others beside them.
    """
    middles = 0.5 * (cells.low + cells.high)[:, :2]
    squares = np.floor((middles - cells.low[:, :2].min(axis=0)) / width).astype(np.int64)
    _, owner, counts = np.unique(squares, axis=0, return_inverse=True, return_counts=True)
    owner = owner.reshape(-1)
    kept = np.flatnonzero(counts >= _FEW)
    places = np.full(len(counts), -1, dtype=np.int64)
    places[kept] = np.arange(len(kept))
    low, high = np.full((len(counts), 3), np.inf), np.full((len(counts), 3), -np.inf)
    np.minimum.at(low, owner, cells.low)
    np.maximum.at(high, owner, cells.high)
    return ViewCells.boxes(low[kept], high[kept]), places[owner]


def parent_width(bodies: ConvexBodies, cells: ViewCells) -> float | None:
    """Of large cells from which enough is hidden to be worth a look; None where none are."""
    sides = (bodies.boxes[:, 1] - bodies.boxes[:, 0])[:, :2].min(axis=1)
    size = float(np.median((cells.high - cells.low)[:, :2].max(axis=1)))
    width = _WORTHWHILE * float(np.median(sides))
    return width - size if width >= 2.0 * size else None


@dataclass(eq=False)
class TwoLevels:
    """Cells of two sizes: what is hidden from a large one is hidden from all within it.

    ``occluders``  and ``cells``, of which any are asked for later.
    """

    occluders: StrongOccluders
    cells: ViewCells
    tactics: Tactics = field(default_factory=Tactics)
    work: NDArray[np.int64] = field(default_factory=lambda: np.zeros(3, dtype=np.int64))
    _known: dict[int, NDArray[np.uint8]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        width = parent_width(self.occluders.bodies, self.cells)
        self._parents, self._owner = (
            (self.cells.some(np.empty(0, np.int64)), np.full(len(self.cells), -1, dtype=np.int64))
            if width is None
            else parents_of(self.cells, width)
        )

    def hidden(self, chosen: NDArray[np.int64]) -> BoolArray:
        """(c, n) what is hidden from some of the cells."""
        count = len(self.occluders.targets)
        owner = self._owner[chosen]
        new = [one for one in np.unique(owner).tolist() if one >= 0 and one not in self._known]
        if new:
            coarse = replace(self.tactics, pieces=NO_PIECES)  # each small cell looks at its own
            found = self.occluders.hide(self._parents.some(np.array(new)), coarse)
            self.work = self.work + found.work.sum(axis=0)  # anew: it may be read-only here
            for one, row in zip(new, found.hidden, strict=True):
                self._known[one] = np.packbits(row)
        known = np.zeros((len(chosen), count), dtype=np.bool_)
        for place, one in enumerate(owner.tolist()):
            if one >= 0:
                known[place] = np.unpackbits(self._known[one], count=count).astype(np.bool_)
        made = self.occluders.hide(self.cells.some(chosen), self.tactics, known)
        self.work = self.work + made.work.sum(axis=0)
        return made.hidden
