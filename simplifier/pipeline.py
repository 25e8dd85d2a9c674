"""TriangleMesh -> Occluder: the steps of the paper (section 4), and what goes past it, in order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from simplifier.device.choice import open_device
from simplifier.errors import OptionError
from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.overrides import NO_OVERRIDES, NOTHING, Overrides
from simplifier.geometry.solid import Solid
from simplifier.kernels.threads import running
from simplifier.options.stages import ERROR_VOXELS, Options, fineness
from simplifier.progress import Cancel, Deadline, Listener, Stopwatch
from simplifier.slicing.flats import flat_directions
from simplifier.steps.cut import (
    build_chains,
    choose_triangles,
    cut_sections,
    open_slicer,
    trace_outlines,
)
from simplifier.steps.largest import may_lend, with_largest
from simplifier.steps.look import looking
from simplifier.steps.refine import improve
from simplifier.steps.room import open_room, solid_to_cut, with_inner
from simplifier.steps.solid import solid_decisions, solid_warnings, solidify
from simplifier.steps.time_limit import start_in_time
from simplifier.steps.verbatim import is_own_occluder, own_triangles

_COARSE = 32  # voxels: the more there are, the less room have few triangles


@dataclass(frozen=True, eq=False)
class Simplification:
    """An occluder, the solid that it was cut from, and what the user should know.

    ``interrupted``  whether the run was cancelled, so that this is the best so far.
    ``decisions``    what was decided on the way, a sentence each.
    """

    occluder: Occluder
    solid: Solid
    warnings: tuple[str, ...]
    interrupted: bool = False
    decisions: tuple[str, ...] = ()

    @property
    def timings(self) -> Mapping[str, float]:
        """Seconds by stage."""
        return self.occluder.timings


@running()
def simplify_mesh(
    mesh: TriangleMesh,
    options: Options,
    listener: Listener | None = None,
    cancel: Cancel | None = None,
    overrides: Overrides = NO_OVERRIDES,
    *,
    warn: bool = True,
) -> Simplification:
    """Turn a triangle soup into an occluder of at most ``options.selection.budget`` triangles.

    Of ``overrides`` the drawn parts count, and what they hide need not be hidden again; the error
    bound is that of all other triangles.

    ``listener`` is told about the progress; what it raises ends the run.  ``cancel``, once set,
    ends it soon: with the best so far from refining on, before that with
    :class:`~simplifier.errors.CancelledError`.  ``warn`` is whether to look for what a user should
    know of the solid: where it leaks, what would close it is tried, which may take as long as
    refining a draft.  Raises
    :class:`~simplifier.errors.BackendUnavailableError` for a slicer that cannot run here and
    :class:`~simplifier.errors.OptionError` for drawn parts beyond the budget.
    """
    left = options.selection.budget - len(overrides.triangles)
    _check_left(left, options, overrides)
    deadline = Deadline.after(options.time_limit)
    watch = Stopwatch(listener, cancel)
    # 1. Voxelize the mesh and fill what it encloses (section 4.1), in the voxels of a room to come.
    own = is_own_occluder(mesh, options.solid, left, overrides)
    finely = options.marks_finely and left > 0 and not own and not overrides.open
    size = fineness(options.solid.resolution) if finely else 1
    solid = solidify(mesh, options.solid, watch, overrides, size)
    # Before refining, which uses up what a time limit leaves.
    warnings = solid_warnings(mesh, solid, options.solid, overrides) if warn else []
    warnings.extend(open_device(options.device).remarks)
    decisions = solid_decisions(solid, options.solid)
    interrupted, bound = False, ERROR_VOXELS
    if left == 0:
        triangles = NOTHING
    elif (covering := own_triangles(mesh, solid, options.solid, left, overrides)) is not None:
        triangles, words = covering
        solid = replace(solid, finer=None)
        decisions.append(words)
    else:
        rest = replace(options, selection=replace(options.selection, budget=left))
        by_hand = solid.core.to_grid(overrides.triangles)
        room = open_room(mesh, solid, rest, overrides)
        solid = with_inner(solid, room)
        with looking(mesh, solid, room, rest, watch, deadline, overrides) as looks:
            # 2. to 5. Cut it, and choose what hides most.
            cut = solid_to_cut(solid, room)
            triangles = cut_solid(mesh, cut, rest, watch, deadline, by_hand)
            # 6. Past the paper: move the triangles under the same measure.
            with watch.stage("refine", cancels=False):
                refined = improve(
                    triangles, mesh, solid, room, looks, rest, watch, deadline, overrides
                )
                interrupted = watch.cancelled
        triangles, bound = solid.core.to_world(refined.triangles), refined.bound
        decisions.append(refined.words)
        if solid.wholly_inside and may_lend(options.solid, overrides):
            triangles, more = with_largest(triangles, mesh, solid, rest)
            decisions.extend(more)
    # A voxel wholly inside is interior, at no distance at all.
    bound = 0.0 if solid.wholly_inside else bound * solid.core.cell_size
    if options.error_bound is not None:  # no more for rounding, nor of the mesh itself
        bound = min(bound, options.error_bound)
    triangles = np.concatenate([overrides.triangles, triangles])
    occluder = Occluder.of(triangles, bound, watch.timings)
    if len(occluder.faces) == 0 < solid.core.count:
        warnings.append(_empty(options))
    if interrupted:
        warnings.append("interrupted: this is the best occluder so far")
    return Simplification(occluder, solid, tuple(warnings), interrupted, tuple(decisions))


def cut_solid(
    mesh: TriangleMesh,
    solid: Solid,
    options: Options,
    watch: Stopwatch,
    deadline: Deadline,
    drawn: FloatArray = NOTHING,
) -> FloatArray:
    """(m, 3, 3) triangles in grid space, m within the budget, that add to what is ``drawn``.

    They are cut from the solid of the mesh, whose flat parts say where to cut as well.
    """
    with open_slicer(solid, options, watch) as slicer:
        with watch.timed("sections"):
            flats = flat_directions(mesh)

        def start(options: Options, watch: Stopwatch) -> FloatArray:
            # 2. Cut it by many planes; the largest slice of each bin stays (section 4.2).
            sections = cut_sections(slicer, solid, flats, options.sections, watch)
            # 3. Trace their outlines (section 4.3).
            polygons = trace_outlines(sections, watch)
            # 4. Simplify these, join their holes, and go on to ever simpler ones (4.3, 4.4).
            chains = build_chains(sections, polygons, watch)
            # 5. Choose polygons and levels by what they hide, and triangulate them (4.5).
            return choose_triangles(chains, solid, options, drawn, watch)

        return start_in_time(start, solid, flats, options, watch, deadline)


def _empty(options: Options) -> str:
    change = "raise" if options.solid.resolution <= _COARSE else "lower"
    return (
        "all that was found would hide too much of what is visible, so the occluder is empty; allow"
        f" more triangles or more overhang, {change} the resolution, or lower the minimum precision"
    )


def _check_left(left: int, options: Options, overrides: Overrides) -> None:
    if left < 0:
        raise OptionError(
            f"{options.selection.budget} triangles are fewer than the"
            f" {len(overrides.triangles)} that the overrides draw",
            where="budget",
            remedy=f"raise it to {len(overrides.triangles)} or more, or draw fewer",
        )
