"""Triangles -> triangles: refinement within the solid, by pictures of the original."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from simplifier.device.choice import open_device
from simplifier.device.remembering import remembering
from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.overrides import NO_OVERRIDES, NOTHING, Overrides
from simplifier.geometry.room import Room
from simplifier.geometry.solid import Solid
from simplifier.kernels.threads import Ahead, run_both, thread_count
from simplifier.options.stages import ERROR_VOXELS, Options
from simplifier.progress import Best, Deadline, Stopwatch
from simplifier.refinement.finalists import MUCH, OUTLINE, Judge, Outlines
from simplifier.refinement.search import Stop, hidden_share, pull_into, refine
from simplifier.refinement.second_search import FLAWLESS, is_doubtful, search_again
from simplifier.refinement.settle import settled
from simplifier.refinement.trim import is_worth_cutting, made_precise, trimmed
from simplifier.refinement.withdraw import withdraw
from simplifier.selection.measure import search_projections
from simplifier.steps.look import MANY, Looks, StoppedError

MUCH_BEGUN = 0.5
"""Of the original's score: sections with so much leave nothing to gain by other starts."""

_SEALING_VIEWS = 4096  # in which nothing may stick out of an open mesh that is kept inside
_CLEAN_VIEWS = 896  # in a row, after which no others are looked at
_PART = 4  # by which a budget of many is divided where fewer triangles are tried
_LEAST = 32  # that are then left, at least
_LARGER = 0.75  # of the time, until the quarter's turn
_CHANCE = 0.01  # of recall, between two views of the same
_GAIN = 0.02  # of worth, that cutting back has to bring: less may be a loss in other views
_SMOOTH = 0.85  # of recall less faults, that few triangles have of what is smooth
_WORTHLESS = 0.1  # of recall less faults: with less, what hides wrongly is cut back, too
_FAULTS = 0.05  # of recall, that what hides more may lose by them
_FIRST = 0.8  # of the time of two searches, when the first ends
_MOSTLY = 0.8  # of recall, that makes corners of a sheet worth settling
_SETTLED = 0.95  # of recall less faults, with which it then needs no search
_SETTLED_WELL = 0.98  # the same where a search has many moves, which find more
_MANY_MOVES = 100_000
_SLIGHT = 0.01  # overhang: who asks for more of it asks for what searches find by it
_SETTLING = 0.3  # of what a time limit leaves, for that
_NEARLY = 0.97  # of recall less faults: a search of what hides so much gains a tenth of a percent
_GLANCED = 0.95  # with which a draft keeps a mesh in full detail
_BESIDE = 0.6  # of what sections score, with which it begins a search, too
_LITTLE = 0.1  # of the original's score: sections of hills, rods and shells have less
_SEVERAL_SECONDS = 0.5  # that a time limit has to leave for more than one start
_OUTLINED_SECONDS = 0.2  # for finer pictures of up to 64 triangles, in which overhang is judged
_JUDGED_SECONDS = 0.1  # and for a look at whether the search has come to anything
_DECIMATED_SECONDS = 0.3  # for starts from decimated surfaces, where sections have so little
_DETAILED_SECONDS = 0.15  # and for the mesh in full detail, which takes up to half of that
_DETAILED_SHEET_SECONDS = 0.1  # of a sheet with an outline, which is mostly best so
_SHEET_SECONDS = 0.02  # of a sheet, of which a search in so little time may leave next to nothing
_HURRIED = 0.4  # of such a limit, for judging


_SECTIONS, _SOLID = "planar sections", "the surface of the solid in fewer triangles"
_MESH = "the mesh in fewer triangles"
_DETAILED = f"{_MESH}, with all that is finer than a voxel"


@dataclass(frozen=True, eq=False)
class Refined:
    """Triangles, how far they may be off, and how they were found.

    ``triangles``  (m, 3, 3) in grid space.
    ``bound``      cells that the room of these reaches past the original.
    ``words``      a sentence.
    """

    triangles: FloatArray
    bound: float
    words: str


def improve(
    start: FloatArray,
    mesh: TriangleMesh,
    solid: Solid,
    room: Room | None,
    looks: Ahead[Looks],
    options: Options,
    watch: Stopwatch,
    deadline: Deadline,
    overrides: Overrides = NO_OVERRIDES,
) -> Refined:
    """Move the triangles (m, 3, 3) of grid space within the room, by ``looks`` at the original.

    That keeps the error bound, and regions open.  Searches begin from them and from decimated
    surfaces; finer pictures then decide between what they find and the starts as they are.
    Triangles that are not to leave the core at all, or have regions to keep out of, are pulled in
    even when there is nothing to refine.  What is drawn by hand belongs to the original there, and
    hides as well.
    """
    if room is None:
        return _unmoved(start, ERROR_VOXELS)
    found = _moved(start, solid, room, looks, options, watch, deadline, overrides)
    if not solid.open:
        return found
    return replace(found, triangles=_sealed(found.triangles, mesh, solid, options))


def _unmoved(triangles: FloatArray, bound: float) -> Refined:
    return Refined(
        triangles, bound, "The occluder is made of planar sections, which were not refined."
    )


def _sealed(
    triangles: FloatArray, mesh: TriangleMesh, solid: Solid, options: Options
) -> FloatArray:
    """Of an open mesh, which lets some see past what is wholly inside: where nobody does."""
    lines = search_projections(solid, options, _SEALING_VIEWS) * (OUTLINE / 64)
    lines = np.random.default_rng(options.seed).permutation(lines)  # near ones show the same
    placed = solid.core.to_grid(mesh.vertices)
    device = remembering(open_device(options.device))
    return withdraw(triangles, placed, mesh.faces, lines, OUTLINE, _CLEAN_VIEWS, device)


def _moved(
    start: FloatArray,
    solid: Solid,
    room: Room,
    looks: Ahead[Looks],
    options: Options,
    watch: Stopwatch,
    deadline: Deadline,
    overrides: Overrides,
) -> Refined:
    """As :func:`improve`, in a room."""
    margin = room.margin
    if options.refine.moves == 0:
        return _unmoved(pull_into(start + margin, room) - margin, room.bound)
    try:
        seen = looks.result(lambda: watch.cancelled or deadline.is_up)
    except StoppedError:
        if solid.reach > 0 and not overrides.open and options.error_bound is None:
            return _unmoved(start, ERROR_VOXELS)
        return _unmoved(pull_into(start + margin, room) - margin, room.bound)

    def tell(begin: float, end: float) -> Stop:
        """Of a search that takes this part of the stage."""

        def stop(share: float, measure: float, best: Best) -> bool:
            def shown() -> FloatArray:
                found = solid.core.to_world(best() - margin)
                return np.concatenate([overrides.triangles, found])

            watch.tell("refine", begin + share * (end - begin), measure, shown)
            return watch.cancelled

        return stop

    run = _Run.of(start + margin, seen, options, deadline, tell, lambda: watch.cancelled)
    found = _never_worse(run, options.selection.budget, 0.0, 1.0)
    return replace(found, triangles=found.triangles - margin)


class _Start(NamedTuple):
    """What a search may begin with, in words, and its triangles (m, 3, 3)."""

    words: str
    triangles: FloatArray


@dataclass(frozen=True, eq=False)
class _Run:
    """What all searches of a run share, whatever their budgets.

    ``start``    (m, 3, 3) planar sections, in the room's place.
    ``share``    of the original's score, that sections have as they are; 0 where nobody asks.
    ``looks``    at the original, in a room that is as wide as the error bound lets it be.
    ``decimated``  whether searches begin from decimated surfaces, too.
    ``several``  whether there is time for searches that follow the first.
    """

    start: FloatArray
    share: float
    looks: Looks
    options: Options
    decimated: bool
    several: bool
    deadline: Deadline
    tell: Callable[[float, float], Stop]
    cancelled: Callable[[], bool]

    @classmethod
    def of(
        cls,
        start: FloatArray,
        looks: Looks,
        options: Options,
        deadline: Deadline,
        tell: Callable[[float, float], Stop],
        cancelled: Callable[[], bool],
    ) -> _Run:
        """From what sections score, and how much time is left."""
        aims, in_time = options.refine, deadline.left > _SEVERAL_SECONDS
        # What keeps wholly inside leaves no room for the mesh itself.
        has_room = not looks.original.solid.wholly_inside
        enough = 0.0  # of the original's score, for sections to begin with alone
        if aims.decimated and in_time:
            enough = MUCH_BEGUN
        elif looks.original.solid.is_sheet or (has_room and deadline.left > _DECIMATED_SECONDS):
            enough = _LITTLE
        share = 0.0
        if enough > 0.0:
            share = hidden_share(start, looks.room, looks.views, aims)
        decimated = share < enough
        several = in_time and (aims.decimated or decimated)
        return cls(start, share, looks, options, decimated, several, deadline, tell, cancelled)

    @cached_property
    def outlined(self) -> bool:
        """Whether it is a sheet with an outline, which in full detail mostly is best: also where
        sections score so much that nothing is decimated, of what is like a terrain."""
        surfaces = self.looks.surfaces
        return surfaces.terrain_like or (self.decimated and surfaces.outlined)

    @property
    def simple(self) -> bool:
        """Whether the mesh in full detail is judged whatever searches find: of few triangles that
        takes next to no time."""
        return self.looks.surfaces.few or self.outlined

    @property
    def in_detail(self) -> bool:
        """Whether there is time for the mesh in full detail, of which a time limit allows simple
        ones alone."""
        if not self.deadline.limited:
            return True
        least = _DETAILED_SHEET_SECONDS if self.outlined else _DETAILED_SECONDS
        return self.deadline.left > least and self.simple

    @cached_property
    def outlines(self) -> Outlines | None:
        """None where the search's own views have to do."""
        least = _OUTLINED_SECONDS * max(self.options.selection.budget / MANY, 1.0)
        in_time = self.several or self.deadline.left > least
        original = self.looks.original
        return original.outlines if in_time and original.needs_outlines(self.several) else None

    @cached_property
    def judge(self) -> Judge:
        """Only made where there is something to judge: its pictures take time."""
        return self.looks.original.judge(self.compared or self.glances, self.outlines)

    @property
    def compared(self) -> bool:
        """Whether what is found is compared with more, and there is time for all pictures."""
        return self.several or (self.outlined and self.deadline.left > _DETAILED_SHEET_SECONDS)

    @property
    def settles(self) -> bool:
        """Whether there is time to settle a sheet with an outline, corner by corner.  Leaves and
        parts of houses seldom get good enough, so drafts and nodes of scenes settle only what is
        like a terrain."""
        like_terrain = self.looks.surfaces.terrain_like
        return self.compared and self.outlined and (self.patient or like_terrain)

    @property
    def patient(self) -> bool:
        """Whether there is time for several searches: not in drafts, nor in nodes of scenes."""
        aims = self.options.refine
        return aims.decimated and aims.searches > 1

    @property
    def unsparing(self) -> bool:
        """Whether a search is to find all that it can.

        A time limit is there to be spent: three seconds find 2 % more of a dome in 200 triangles
        than a fifth of one.
        """
        return self.options.refine.overhang > _SLIGHT or self.deadline.limited

    @property
    def settled_enough(self) -> float:
        """Of recall less faults: what is settled and worth that much is not searched for."""
        if self.unsparing:
            return FLAWLESS
        return _SETTLED if self.options.refine.moves < _MANY_MOVES else _SETTLED_WELL

    @property
    def enough(self) -> float:
        """The same of the mesh in full detail, as it is decimated: what can be settled gets better
        by that in little time."""
        if self.settles or self.unsparing:
            return FLAWLESS
        if self.glances:
            return _GLANCED
        few_moves = self.options.refine.moves < _MANY_MOVES
        return _NEARLY if self.patient and few_moves else FLAWLESS

    @property
    def divided(self) -> bool:
        """Whether a search may follow the first, in less room: of a sheet within a time limit, too,
        all of which could be spent on triangles that only stick out."""
        return self.several and (self.looks.original.solid.is_sheet or not self.deadline.limited)

    @property
    def judged(self) -> bool:
        """Whether there is time to judge what a search that begins now will find."""
        least = _SHEET_SECONDS if self.looks.original.solid.is_sheet else _JUDGED_SECONDS
        return self.compared or (self.deadline.limited and self.deadline.left > least)

    @property
    def glances(self) -> bool:
        """Whether a draft, which judges nothing else, looks at the mesh in full detail."""
        return self.looks.glance and not self.judged

    def time_for(self, share: float) -> Deadline | None:
        """That share of what a time limit leaves, less what it takes to judge what is found."""
        if not self.deadline.limited:
            return None
        hurried = not self.several and self.judged and self.deadline.left <= _JUDGED_SECONDS
        closing = _HURRIED if hurried else _closing_share(self.several)
        return self.deadline.part(share * (1.0 - closing))


def _never_worse(run: _Run, budget: int, begin: float, end: float) -> Refined:
    """Of a budget above 64, and of a quarter of it where there is reason to: what hides more.

    Of more triangles each may stick out by a little, and prices that rise with that may leave less
    than fewer triangles had.
    """
    if budget <= MANY or not run.divided:
        return _found(run, budget, begin, end)[0]
    middle = begin + _LARGER * (end - begin)
    large, doubtful = _found(run, budget, begin, middle)
    if run.cancelled() or not doubtful or run.deadline.left < _JUDGED_SECONDS:
        return large
    small = _never_worse(run, max(budget // _PART, _LEAST), middle, end)
    if not _hides_more(small.triangles, large.triangles, run.judge):
        return large
    return replace(small, words=f"{small.words}  More triangles than that hid less.")


def _hides_more(small: FloatArray, large: FloatArray, judge: Judge) -> bool:
    """Whether fewer triangles hide more beyond chance, for hardly more of faults; or anything more
    for fewer of them."""
    gain = judge.recall(small) - judge.recall(large)
    worth = judge.worth(small) - judge.worth(large)
    return gain > 0.0 and worth > (0.0 if gain < _CHANCE else -_FAULTS)


def _stands_further_before(one: FloatArray, best: FloatArray, judge: Judge) -> bool:
    """Whether more of the original lies well behind it than was asked for, and than behind the
    best, which a search has kept to that."""
    return judge.score(one).front > max(judge.front, judge.score(best).front)


def _found(run: _Run, budget: int, begin: float, end: float) -> tuple[Refined, bool]:
    """With so many triangles, in this part of the stage; and whether fewer may do better."""
    found, refined, doubtful = _searched(run, budget, begin, end)
    in_time = not run.deadline.limited or run.deadline.left > _JUDGED_SECONDS
    if not found or not in_time:
        return refined, doubtful
    chosen, judge = refined.triangles, run.judge
    worthless = judge.worth(chosen) < _WORTHLESS
    # Nothing at all hides nothing wrongly, which is no aim.
    precise = min(judge.precision, judge.score(chosen).precision) if len(chosen) > 0 else 0.0
    cut: list[_Cut] = []
    for one in found:
        if run.cancelled():
            break
        least = 0.0 if one is chosen else judge.recall(chosen)
        if is_worth_cutting(one, chosen, judge):
            cut += [_Cut(left, least, 0.0, "where it stuck out") for left in trimmed(one, judge)]
        if worthless and one is not chosen and judge.score(one).precision < judge.precision:
            less_wrong = made_precise(one, judge)
            cut += [_Cut(left, least, precise, "where it hid wrongly") for left in less_wrong]
    worth, *others = judge.worths([chosen, *(one.triangles for one in cut)])
    better = [
        (other, one)
        for other, one in zip(others, cut, strict=True)
        if other >= worth + _GAIN and one.passes(judge)
    ]
    if not better:
        return refined, doubtful
    best = max(better, key=lambda pair: pair[0])[1]
    words = f"The occluder was found by searches, and cut back {best.where}."
    room = run.looks.room_of(best.triangles, budget)
    return Refined(best.triangles, room.bound, words), doubtful


@dataclass(frozen=True, eq=False)
class _Cut:
    """What is left of a soup (m, 3, 3), and what it has to have to be taken."""

    triangles: FloatArray
    recall: float
    precision: float
    where: str

    def passes(self, judge: Judge) -> bool:
        score = judge.score(self.triangles)
        return score.recall >= self.recall and score.precision >= self.precision


def _searched(
    run: _Run, budget: int, begin: float, end: float
) -> tuple[list[FloatArray], Refined, bool]:
    """What searches have found, where that was judged; the best; and whether fewer triangles may
    do better."""
    aims, seed, views = run.options.refine, run.options.seed, run.looks.views
    task = _Task.of(run, budget)
    begun, whole = task.starts_and_whole()
    starts = [one.triangles for one in begun]
    kept = _kept_whole(whole, run, budget, run.enough) if whole else None
    better = _settled_whole(whole, run) if whole and kept is None and run.settles else []
    if better:
        kept = _kept_whole(better, run, budget, run.settled_enough)
    if kept is not None:
        return [], kept, False
    first = _FIRST if run.divided else 1.0
    middle = begin + first * (end - begin)
    found = refine(
        starts, task.room, views, budget, aims, seed, run.tell(begin, middle),
        run.time_for(first), run.outlines, run.looks.room.limit,
    )  # fmt: skip
    names = list(dict.fromkeys(one.words for one in begun))
    searched = f"The occluder was found by searches that began with {_listed(names)}."
    if not task.judged:
        best = (found or starts)[0]
        if not whole:
            room = run.looks.room_of(best, budget)
            return [], Refined(best, room.bound, searched), False
        for one in whole:
            good = run.judge.worth(one) > MUCH and not _stands_further_before(one, best, run.judge)
            if good and _hides_more(one, best, run.judge):
                best = one
        return [], task.refined(best, found, begun, searched), False
    best = task.best_of([*found, *better], starts)
    again = None
    if run.divided and not run.cancelled():
        room = run.looks.room_of(np.concatenate([NOTHING, *found]), budget)
        again = search_again(
            found, best, room, views, run.judge, budget, aims, seed, run.tell(middle, end),
            run.time_for(1.0),
        )  # fmt: skip
    if again is None:
        refined = task.refined(best, found, begun, searched)
    else:
        best, room = again
        found = [*found, best]
        refined = Refined(best, room.bound, f"{searched[:-1]}, and by another in less room.")
    return found, refined, is_doubtful(found, best, run.judge)


@dataclass(frozen=True, eq=False)
class _Task:
    """To search for at most ``budget`` triangles in a ``room``.

    ``judged``     whether there is time to judge what is found.
    ``in_detail``  and whether the mesh in full detail is judged, too, or glanced at.
    """

    run: _Run
    budget: int
    room: Room
    judged: bool
    in_detail: bool

    @classmethod
    def of(cls, run: _Run, budget: int) -> _Task:
        judged = run.judged
        in_detail = run.in_detail if judged else run.glances
        return cls(run, budget, run.looks.room_for(budget), judged, in_detail)

    def starts_and_whole(self) -> tuple[list[_Start], list[FloatArray]]:
        """What searches begin with; and of a simple mesh all of it in fewer triangles, which may
        leave nothing to search for.

        All of it is made at the same time, since each leaves a core idle, and so are the pictures
        that a simple mesh is judged by next.
        """
        run, surfaces = self.run, self.run.looks.surfaces

        def of_mesh() -> list[_Start]:
            if not run.decimated:
                return []
            return [_Start(_MESH, surfaces.of_mesh(self.budget, self.room))]

        def whole() -> list[FloatArray]:
            if run.simple:
                return self.detailed(*run.looks.rooms)
            if self.in_detail and run.decimated and thread_count() > 1:
                surfaces.reduced(self.budget)
            return []

        def of_mesh_and_whole() -> tuple[list[_Start], list[FloatArray]]:
            if surfaces.terrain_like and (run.decimated or self.in_detail):
                surfaces.reduced(self.budget)  # before both ask for it
            return run_both(of_mesh, whole)

        def of_solid() -> list[_Start]:
            made: list[_Start] = []
            # That of a sheet encloses nothing, so decimating its two sides would leave nothing.
            if run.decimated and not run.looks.original.solid.is_sheet:
                made = [_Start(_SOLID, surfaces.of_solid(self.budget, self.room))]
            if self.in_detail and run.simple:
                _ = run.judge
            return made

        (mesh, fine), solid = run_both(of_mesh_and_whole, of_solid)
        sections = _Start(_SECTIONS, pull_into(run.start, self.room))
        return [sections, *solid, *mesh, *self.glanced(fine)], fine

    def glanced(self, fine: Sequence[FloatArray]) -> list[_Start]:
        """Of the mesh in full detail, which is there already, what a draft's search gains by."""
        run = self.run
        if not run.glances:
            return []
        aims, least = run.options.refine, _BESIDE * run.share

        def is_worth_it(one: FloatArray) -> bool:
            return hidden_share(one, run.looks.room, run.looks.views, aims) >= least

        return [_Start(_DETAILED, one) for one in fine if is_worth_it(one)]

    def detailed(self, *rooms: Room) -> list[FloatArray]:
        """The mesh in full detail and fewer triangles, in each room."""
        if not self.in_detail:
            return []
        # Those that are fitted stick out, which settling mends.
        return self.run.looks.surfaces.fine(self.budget, rooms, fitted=self.run.settles)

    def best_of(self, found: Sequence[FloatArray], starts: Sequence[FloatArray]) -> FloatArray:
        """What the judge chooses, of the mesh in full detail as well, which no search has begun
        with, where that may be best."""
        judge, whole = self.run.judge, self.run.looks.room
        soups, few = [*found, *starts], self.budget <= MANY
        if few and _asks_for_detail(self.run.simple, found, starts, judge):
            return judge.best_of(soups, lambda: self.detailed(whole), 1.0)
        # What is thin sticks out by little, however far it is moved: all of the room is for it.
        return judge.best_of(soups, lambda: self.detailed(self.room, whole), MUCH if few else 1.0)

    def refined(
        self,
        best: FloatArray,
        found: Sequence[FloatArray],
        begun: Sequence[_Start],
        searched: str,
    ) -> Refined:
        """The best one, and what it is; ``searched`` says how the rest was ``found``."""
        bound = self.run.looks.room_of(best, self.budget).bound
        if any(best is one for one in found):
            return Refined(best, bound, searched)
        if len(best) == 0:
            words = "All that was found would hide too much wrongly, so the occluder is empty."
            return Refined(best, bound, words)
        name = next((one.words for one in begun if one.triangles is best), _DETAILED)
        words = f"No search did better than {name}, which became the occluder."
        return Refined(best, bound, words)


def _settled_whole(whole: Sequence[FloatArray], run: _Run) -> list[FloatArray]:
    """The best of the mesh in full detail that hides most of it, with its corners settled."""
    most = [one for one in whole if run.judge.recall(one) >= _MOSTLY]
    if not most:
        return []
    worths = run.judge.worths(most)
    best = most[worths.index(max(worths))]
    deadline = run.deadline.part(_SETTLING)

    def stopped() -> bool:
        return run.cancelled() or deadline.is_up

    return [settled(best, run.looks.room, run.judge, FLAWLESS, stopped)]


def _kept_whole(
    whole: Sequence[FloatArray], run: _Run, budget: int, enough: float
) -> Refined | None:
    """The best of the mesh in full detail, where there is nothing or no time to search for."""
    worths = run.judge.worths(whole)
    worth = max(worths)
    if worth >= enough:
        words = "The mesh in fewer triangles hides nearly all of it, so nothing was searched."
    elif worth > 0.0 and run.deadline.left < _JUDGED_SECONDS:
        words = "The mesh in fewer triangles was kept, since no time was left to search."
    else:
        return None
    best = whole[worths.index(worth)]
    return Refined(best, run.looks.room_of(best, budget).bound, words)


def _asks_for_detail(
    simple: bool, found: Sequence[FloatArray], starts: Sequence[FloatArray], judge: Judge
) -> bool:
    """Whether the mesh in full detail may be best where what was found is good: of a simple mesh,
    of what is smooth and has no start but sections, or where a start is better than what searches
    made of it."""
    worths = judge.worths([*starts, *found])
    before, after = max(worths[: len(starts)]), max(worths[len(starts) :], default=0.0)
    if max(before, after) < MUCH:
        return False
    smooth = after >= _SMOOTH and len(starts) == 1
    return simple or smooth or before > after


def _listed(names: Sequence[str]) -> str:
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def _closing_share(several: bool) -> float:
    """Of what a time limit leaves: for tidying up what was found, and for judging it."""
    return 0.08 if several else 0.18
