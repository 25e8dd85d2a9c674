"""Triangles -> triangles: refine an occluder under the measure, inside its error bound.

The paper ends with the cut.  Its vertices lie on a few planes and were chosen among a few outlines;
moved freely in space they cover far more.  Each vertex in turn is moved at random, and the move is
kept when

    sum over views of  M(occluder and original) - overcover * (pixels of occluder outside)

rises, or falls by little while the search is young (simulated annealing).  No triangle may touch a
voxel outside the allowed solid: the filled grid dilated by one voxel.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.deadline import Deadline
from simplifier.geometry.grid import BoolArray
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.kernels.refinement import BLOCK, TRIES, all_contained, draw_all, move_vertices
from simplifier.kernels.threads import run_chunks
from simplifier.options import RefineOptions

_STEPS = (6.0, 0.3)  # voxels that a move spans at first and at last
_HEATS = (5e-4, 1e-5)  # losses taken at first and at last, as shares of the score
_SLICE = 100 * TRIES  # moves between two looks at the listener
_SLICE_SHARE = 0.01  # of a time limit, between two looks at the clock
_SLICE_SECONDS = (0.0005, 0.02)  # at least, so that a slice is worth its start, and at most

Stop = Callable[[float, int], bool]
"""Told the share of the search that is done and the best score; true ends it with that best."""


@dataclass(frozen=True, eq=False)
class RefineViews:
    """What the search looks at: ``projections`` (V, 2, 4) and the original's bits (V, 64)."""

    projections: FloatArray
    originals: NDArray[np.uint64]


def refine(
    vertices: FloatArray,
    faces: IntArray,
    allowed: BoolArray,
    views: RefineViews,
    options: RefineOptions,
    seed: int,
    stop: Stop = lambda share, score: False,
    deadline: Deadline | None = None,
) -> tuple[FloatArray, IntArray]:
    """Move the vertices, (n, 3) in grid space; faces (m, 3) stay, less those that cannot.

    ``allowed`` (nx, ny, nz) bool are the voxels that triangles may touch; faces that leave it at
    the start are pulled in, and left out where that fails.  The result scores no less than that
    start.  With a ``deadline`` the search lasts until then, whatever ``options.moves``.  The same
    arguments give the same result on any number of threads, unless ``stop`` ends the search or a
    deadline does.
    """
    vertices, faces = pulled_in(vertices, faces, allowed)
    if len(faces) == 0 or options.moves == 0:
        return vertices, faces
    searches = [
        _Search(vertices, faces, allowed, views, options, seed * options.searches + index)
        for index in range(options.searches)
    ]
    slices = _by_moves(options.moves) if deadline is None else _by_time(deadline.rest())
    for moves, shares in slices:
        _run(searches, moves, shares)
        if stop(shares[1], max(search.score for search in searches)):
            break
    return max(searches, key=lambda search: search.score).best, faces


_Slices = Iterator[tuple[int, tuple[float, float]]]
"""Moves to try, and the shares of the search at their begin and end."""


def _by_moves(moves: int) -> _Slices:
    for first in range(0, moves, _SLICE):
        last = min(first + _SLICE, moves)
        yield last - first, (first / moves, last / moves)


def _by_time(deadline: Deadline) -> _Slices:
    """Slices of about a hundredth of the time each, until it is up."""
    least, most = _SLICE_SECONDS
    aim = min(max(_SLICE_SHARE * deadline.seconds, least), most)
    moves = TRIES  # the first slice is there to learn what a move costs
    while not deadline.is_up:
        left, share = deadline.left, deadline.share
        yield moves, (share, min(share + aim / deadline.seconds, 1.0))
        took = max(left - deadline.left, 1e-6)
        moves = TRIES * max(1, int(moves / TRIES * min(aim / took, 4.0)))


def _run(searches: list[_Search], moves: int, shares: tuple[float, float]) -> None:
    def work(begin: int, end: int) -> None:
        for search in searches[begin:end]:
            search.run(moves, shares)

    run_chunks(work, len(searches))


class _Search:
    """One annealing: the arrays that its kernel works on."""

    def __init__(
        self,
        vertices: FloatArray,
        faces: IntArray,
        allowed: BoolArray,
        views: RefineViews,
        options: RefineOptions,
        seed: int,
    ) -> None:
        count = len(views.projections)
        self._vertices, self._faces, self._allowed = vertices.copy(), faces, allowed
        self._begins, self._incident = _incidence(faces, len(vertices))
        self._views = views
        self._penalty = round(2.0 * options.overcover)
        self._images = np.zeros((len(faces), count, 64), dtype=np.uint64)
        self._blocks = np.zeros((-(-len(faces) // BLOCK), count, 64), dtype=np.uint64)
        self._scores = np.zeros(count, dtype=np.int64)
        self._state = np.array([(2 * seed + 1) * 0x9E3779B97F4A7C15 % 2**64], dtype=np.uint64)
        start = draw_all(
            self._vertices, faces, views.projections, views.originals, self._penalty,
            self._images, self._blocks, self._scores,
        )  # fmt: skip
        self._heats = (_HEATS[0] * max(float(start), 1.0), _HEATS[1] * max(float(start), 1.0))
        self.best = vertices.copy()
        self.best_score = np.array([start], dtype=np.int64)

    @property
    def score(self) -> int:
        """That of the best yet."""
        return int(self.best_score[0])

    def run(self, moves: int, shares: tuple[float, float]) -> None:
        move_vertices(
            self._vertices, self._faces, self._begins, self._incident, self._views.projections,
            self._views.originals, self._allowed, self._penalty, self._images, self._blocks,
            self._scores, self.best, self.best_score, self._state, moves, shares,
            _STEPS, self._heats,
        )  # fmt: skip


def pulled_in(
    vertices: FloatArray, faces: IntArray, allowed: BoolArray
) -> tuple[FloatArray, IntArray]:
    """Shrink the faces that leave the allowed voxels towards their centres until they keep to them.

    A face is shrunk with its neighbours' shared vertices; faces that are still outside after that
    are left out, and so are vertices that none uses.
    """
    vertices = vertices.copy()
    inside = np.zeros(len(faces), dtype=np.bool_)
    for _ in range(_PULLS):
        all_contained(vertices, faces, allowed, inside)
        if inside.all():
            break
        outside = faces[~inside]
        centres = vertices[outside].mean(axis=1)
        # A vertex of several faces goes towards the mean of their centres.
        sums, counts = np.zeros_like(vertices), np.zeros(len(vertices))
        for corner in range(3):
            np.add.at(sums, outside[:, corner], centres)
            np.add.at(counts, outside[:, corner], 1.0)
        moved = counts > 0
        vertices[moved] += _PULL * (sums[moved] / counts[moved, None] - vertices[moved])
    all_contained(vertices, faces, allowed, inside)
    used, renumbered = np.unique(faces[inside], return_inverse=True)
    return vertices[used], np.ascontiguousarray(renumbered.reshape(-1, 3), dtype=np.int32)


_PULLS = 48  # steps, each a sixteenth of the way: a twentieth of the size is left at the end
_PULL = 1.0 / 16.0


def _incidence(faces: IntArray, vertices: int) -> tuple[NDArray[np.int64], IntArray]:
    """Where each vertex's faces begin, and the faces by vertex."""
    order = np.argsort(faces.ravel(), kind="stable")
    begins = np.searchsorted(faces.ravel()[order], np.arange(vertices + 1))
    return begins.astype(np.int64), (order // 3).astype(np.int32)
