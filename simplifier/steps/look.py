"""TriangleMesh, Solid, Room -> Looks: what refining knows of the original before it has a start.

None of it asks for sections, so it may be made while these are cut.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from simplifier.device.choice import open_device
from simplifier.device.device import Device
from simplifier.device.remembering import remembering
from simplifier.geometry.mesh import FloatArray, IntArray, TriangleMesh, as_mesh
from simplifier.geometry.overrides import NO_OVERRIDES, Overrides
from simplifier.geometry.room import SURFACE, Room
from simplifier.geometry.solid import Solid
from simplifier.geometry.views import FRONT_DEPTH, BoundingSphere
from simplifier.kernels.bit_image import SIZE
from simplifier.kernels.threads import Ahead, Stopped, run_both
from simplifier.options.stages import TOUCHED_VOXELS, Options
from simplifier.progress import Deadline, Stopwatch, silent
from simplifier.refinement.annealing import RefineViews, by_looks
from simplifier.refinement.containment import narrowest_room
from simplifier.refinement.depths import NO_DEPTHS, Depths
from simplifier.refinement.finalists import FineViews, Judge, Outlines
from simplifier.refinement.starts import Surfaces
from simplifier.refinement.thin import thinned
from simplifier.selection.measure import search_projections, silhouettes
from simplifier.slicing.flats import directions_of_half
from simplifier.steps.time_limit import FEW_VIEWS, affordable_views

FINE_VIEWS = 12
"""Views that decide between what was found and the starts."""

MANY = 64
"""Triangles above which each may stick out by less."""

_FEW_FINE_VIEWS = 6  # where a time limit is short
_FRONT = 128  # pixels a side of pictures for front: as many as for overhang would tell no more
_SOON = 4_000  # triangles that take little time to decimate, beside a draft
_ALL_AROUND = 110.0  # times the overhang asked for: what the room could have all around
_EACH = 0.35  # the power of a budget by which more triangles reach all of the room sooner
_TINY = 1e-9


class StoppedError(Exception):
    """Time is up or the run is cancelled before there is a picture to refine by."""


@dataclass(frozen=True, eq=False)
class Original:
    """What pictures show, in the room's place, and how they are framed and drawn.

    ``mesh``    vertices (n, 3) and faces (m, 3), with what is drawn by hand.
    ``drawn``   (k, 3, 3) the triangles of it that are drawn by hand.
    ``margin``  cells that the room's place begins before the solid's.
    ``depth``   units by which an occluder may stand before the surface.
    """

    mesh: tuple[FloatArray, IntArray]
    drawn: FloatArray
    solid: Solid
    margin: float
    options: Options
    depth: float
    device: Device

    @classmethod
    def of(
        cls,
        mesh: TriangleMesh,
        shown: TriangleMesh,
        solid: Solid,
        margin: float,
        options: Options,
        by_hand: FloatArray,
    ) -> Original:
        """Of a mesh, which is ``shown`` in fewer triangles, and those (k, 3, 3) drawn by hand."""
        drawn = solid.core.to_grid(by_hand) + margin
        placed = solid.core.to_grid(shown.vertices)
        placed += margin
        pictured = _two_as_one((placed, shown.faces), as_mesh(drawn))
        depth = 2.0 * FRONT_DEPTH * BoundingSphere.of(mesh).radius / solid.core.cell_size
        device = remembering(open_device(options.device))
        return cls(pictured, drawn, solid, margin, options, depth, device)

    @cached_property
    def outlines(self) -> Outlines:
        """What tells searches how far they stick out; they do not see these pictures."""
        lines = self.lines(self.options.refine.outlines)
        depths = self.depths(lines, _FRONT)
        return Outlines.of(*self.mesh, lines, self.drawn, depths, self.device)

    def judge(self, several: bool, outlines: Outlines | None) -> Judge:
        """Of finer pictures: fewer where there is no time for ``several`` searches; overhang is
        judged by the ``outlines`` or, where none were made, by those of these pictures."""
        aims, fine = self.options.refine, self.lines(FINE_VIEWS if several else _FEW_FINE_VIEWS)
        if outlines is None:
            outlines = Outlines.of(*self.mesh, fine, self.drawn, device=self.device)
        pictures = FineViews.of(*self.mesh, fine, outlines)
        return Judge(pictures, aims.precision, aims.overhang, front=aims.front)

    def needs_outlines(self, several: bool) -> bool:
        """Whether they are judged by, in a run that has time for them.

        ``several``  whether searches may follow the first.
        """
        aims = self.options.refine
        return self.solid.reach > 0 and (several or aims.overhang < 1.0 or aims.front < 1.0)

    def lines(self, count: int) -> FloatArray:
        """(count, 2, 4) projections to 64 x 64 pixels."""
        return search_projections(self.solid, self.options, count, self.margin)

    def depths(self, lines: FloatArray, size: int) -> Depths:
        """By projections (V, 2, 4) to 64 x 64 pixels, in pictures of ``size``; none where what is
        in front costs nothing."""
        if self.options.refine.front >= 1.0:
            return NO_DEPTHS
        turned = self.options.solid.viewers != "above"
        return Depths.of(*self.mesh, lines, size, self.depth, turned, self.device)


@dataclass(frozen=True, eq=False)
class Looks:
    """The original in pictures, and its surfaces in fewer triangles.

    ``views``     what searches look at.
    ``surfaces``  what searches may begin with.
    ``glance``    whether a draft, which judges nothing else, looks at the mesh in full detail.
    """

    original: Original
    views: RefineViews
    surfaces: Surfaces
    room: Room
    glance: bool

    @property
    def rooms(self) -> list[Room]:
        """In which a mesh of few triangles, or with an outline, is decimated: the room, and of that
        of a sheet what lies within a cell's diagonal.  The wider one leaves no holes in few
        triangles, the narrower is nearer to the surface where it leaves none either."""
        room = self.room
        if not self.original.solid.is_sheet or room.limit <= SURFACE:
            return [room]
        narrower = room.within(TOUCHED_VOXELS + room.reaches[SURFACE])
        return [room] if narrower.limit == room.limit else [narrower, room]

    def room_for(self, budget: int) -> Room:
        """The room in which searches for so many triangles begin."""
        overhang = self.original.options.refine.overhang
        return narrowed_room(self.room, self.views, overhang, budget)

    def room_of(self, found: FloatArray, budget: int) -> Room:
        """That which a soup (m, 3, 3) keeps to, where such searches have found it: their room grows
        while next to nothing sticks out."""
        return narrowest_room(found, self.room_for(budget), self.room.limit)


@contextmanager
def looking(
    mesh: TriangleMesh,
    solid: Solid,
    room: Room | None,
    options: Options,
    watch: Stopwatch,
    deadline: Deadline,
    overrides: Overrides = NO_OVERRIDES,
) -> Iterator[Ahead[Looks]]:
    """Look at the mesh while the block cuts sections, which leaves a core idle.

    With a time limit the cut comes first, and the mesh is looked at when the block asks for it.
    That needs a ``room``.
    """

    def make(stopped: Stopped) -> Looks:
        assert room is not None
        heard = None if watch.is_alone and not deadline.limited else stopped
        return look(mesh, solid, room, options, deadline, overrides, heard)

    with closing(Ahead(make)) as looks:
        aims = options.refine
        if room is not None and aims.moves > 0 and not deadline.limited:
            looks.begin()
        yield looks


def look(
    mesh: TriangleMesh,
    solid: Solid,
    room: Room,
    options: Options,
    deadline: Deadline,
    overrides: Overrides = NO_OVERRIDES,
    stopped: Stopped | None = None,
) -> Looks:
    """The pictures that searches look at, outlines if these are needed and there is time, and the
    surface that starts of a sheet are made of; all else is made when it is asked for.

    Raises :class:`StoppedError` soon after ``stopped`` is true, if given.
    """
    # Of a draft mostly nothing is decimated, which would want it finer.
    coarsely = not (options.refine.decimated or solid.is_sheet)
    shown = thinned(mesh, coarsely=coarsely)
    original = Original.of(mesh, shown, solid, room.margin, options, overrides.triangles)
    surfaces = Surfaces(shown, solid.core, room, sheet=solid.is_sheet)

    budget = options.selection.budget
    glance = (
        not (deadline.limited or options.refine.decimated)
        and not overrides.drawn  # beside which triangles of the mesh may be wasted
        and original.needs_outlines(False)
        and surfaces.few
        and _is_told_soon(shown, budget)
    )

    def decimated() -> None:
        if deadline.limited:
            return
        if surfaces.terrain_like:
            surfaces.reduced(budget)
        elif glance:
            surfaces.fine(budget, [room])

    def pictured() -> RefineViews:
        if not deadline.limited and original.needs_outlines(options.refine.decimated):
            # First: they pay for a table of edges, by which smaller pictures are drawn as well.
            _ = original.outlines
        views = _views(original, deadline, stopped)
        return replace(views, depths=original.depths(views.projections, SIZE).rows_of_search())

    # First what takes one thread long: others help with pictures.
    _, views = run_both(decimated, pictured)
    return Looks(original, views, surfaces, room, glance)


def _is_told_soon(mesh: TriangleMesh, budget: int) -> bool:
    """Whether decimating a mesh to so many triangles takes little time beside a draft, or is worth
    more of it.  Of what is round the more triangles leave the less to be gained, so more of those
    that it has are worth the time; what is flat needs few."""
    few = max(_SOON, budget**2 // 4)
    return len(mesh.faces) <= few or directions_of_half(mesh) <= budget // 8


def _views(original: Original, deadline: Deadline, stopped: Stopped | None) -> RefineViews:
    """The original as the search sees it, in fewer views where a time limit is short."""

    def tell(share: float) -> None:
        if stopped is not None and stopped():
            raise StoppedError

    def drawn(count: int) -> RefineViews:
        tell(0.0)
        projections = by_looks(original.lines(count))
        drawing = deadline.rest()

        def keep_pace(share: float) -> None:
            tell(share)
            if share < 0.5 < drawing.share:  # so slow that nothing would be left for refining
                raise StoppedError

        heard = silent if stopped is None and not deadline.limited else keep_pace
        originals = silhouettes(*original.mesh, projections, heard, original.device)
        return RefineViews(projections, originals, original.drawn)

    most = original.options.refine.views
    if not deadline.limited:
        return drawn(most)
    before = deadline.left
    few = drawn(min(FEW_VIEWS, most))
    count = len(few.projections)
    more = affordable_views(most, count, before - deadline.left, deadline.left)
    if more > count:
        with suppress(StoppedError):
            return drawn(more)
    return few


def narrowed_room(room: Room, views: RefineViews, overhang: float, budget: int) -> Room:
    """No more of it than could give so much times the overhang asked for, all around.

    Few triangles cover few of many parts, and stick out by far less: then a search takes more.
    """
    reach = _ALL_AROUND * overhang / max(views.outline(room.slab), _TINY)
    return room.within(reach * min(1.0, MANY / budget) ** _EACH)


def _two_as_one(
    one: tuple[FloatArray, IntArray], other: tuple[FloatArray, IntArray]
) -> tuple[FloatArray, IntArray]:
    """Two meshes as one; the first is only copied where it must."""
    if len(other[1]) == 0:
        return one
    return np.concatenate([one[0], other[0]]), np.concatenate([one[1], other[1] + len(one[0])])
