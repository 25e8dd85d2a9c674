"""Triangles that stick out too much -> others, found in less room."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.room import SURFACE, Room
from simplifier.kernels.threads import run_each
from simplifier.options.stages import RefineOptions
from simplifier.progress import Deadline
from simplifier.refinement.annealing import RefineViews
from simplifier.refinement.finalists import Judge
from simplifier.refinement.search import Stop, pull_into, refine

_FAULTS = 0.12  # of recall, that what was found has to lose by its faults
_SHARE = 0.24  # or so much of it, where that is less
_LEAST = 0.02  # of recall, that it has to be then
_MOVES = 0.75  # of those of the first search
_MOST_MOVES = 30_000  # more gain nothing
_DOUBTFUL = 0.08  # of recall: faults that make fewer triangles worth a try


FLAWLESS = 0.99
"""Of recall less faults: what is worth that much leaves next to nothing to gain."""


def search_again(
    found: Sequence[FloatArray],
    chosen: FloatArray,
    room: Room,
    views: RefineViews,
    judge: Judge,
    budget: int,
    options: RefineOptions,
    seed: int,
    stop: Stop = lambda share, measure, best: False,
    deadline: Deadline | None = None,
) -> tuple[FloatArray, Room] | None:
    """Triangles (m, 3, 3) that are better than those ``chosen``, and the room that they are in;
    None where a second search finds none, or is not worth its time.

    A mesh that is thin from one side has a view in which a little that sticks out is much beside
    the little that is there, and no price in the mean over all views keeps that in.  Less room
    does.  A search that begins in it loses recall; one that goes on with what was ``found`` in more
    room hardly does.  It is worth its time where what was chosen is worth less by far than what was
    found would be without its faults.
    """
    most = max(map(judge.recall, found), default=0.0)
    lost = most - judge.worth(chosen)
    if room.limit <= SURFACE or lost < min(_FAULTS, max(_SHARE * most, _LEAST)):
        return None
    start, less = _best_drawn_in(found, room, judge)
    fewer = replace(options, moves=min(round(_MOVES * options.moves), _MOST_MOVES))
    again = refine([start], less, views, budget, fewer, seed, stop, deadline, judge.views.outlines)
    best = judge.best_of([chosen, *again])
    return (best, less) if any(best is one for one in again) else None


def _best_drawn_in(
    found: Sequence[FloatArray], room: Room, judge: Judge
) -> tuple[FloatArray, Room]:
    """Of what was found, drawn into any room that is narrower: what is worth most, and its room."""
    rooms = [room.up_to(limit) for limit in range(room.limit - 1, SURFACE - 1, -1)]
    pairs = [(one, less) for less in rooms for one in found]
    drawn_in = run_each(lambda pair: pull_into(*pair), pairs)
    judged = judge.worths(drawn_in)
    best = judged.index(max(judged))
    return drawn_in[best], pairs[best][1]


def is_doubtful(found: Sequence[FloatArray], chosen: FloatArray, judge: Judge) -> bool:
    """Whether fewer triangles may do better than those ``chosen``: there is something left to gain,
    and no search has found these, or faults have cost much of what was found."""
    if judge.worth(chosen) >= FLAWLESS:
        return False
    if not any(chosen is one for one in found):
        return True
    return max(map(judge.recall, found)) - judge.worth(chosen) >= _DOUBTFUL
