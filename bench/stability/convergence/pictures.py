"""An occluder whose refinement looks at smaller pictures than the 64 pixels of a machine word."""

from __future__ import annotations

import numpy as np

from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.options.stages import Options
from simplifier.pipeline import cut_solid
from simplifier.progress import Deadline, Stopwatch
from simplifier.refinement.annealing import RefineViews, by_looks
from simplifier.refinement.finalists import FineViews, Judge, Outlines
from simplifier.refinement.search import hidden_share, pull_into, refine
from simplifier.refinement.second_search import search_again
from simplifier.refinement.starts import Surfaces
from simplifier.refinement.thin import thinned
from simplifier.selection.measure import search_projections, silhouettes
from simplifier.steps.look import FINE_VIEWS, OUTLINES, narrowed_room
from simplifier.steps.refine import MUCH_BEGUN
from simplifier.steps.room import open_room, solid_to_cut
from simplifier.steps.solid import solidify

_WHOLE = 64  # pixels a side that the search's pictures have


def made_by_pictures(mesh: TriangleMesh, options: Options, pixels: int) -> Occluder:
    """As the pipeline makes it from a preset that decimates; only the search's pictures differ.

    ``pixels`` 1 to 64 of a side; 64 give the pipeline's very bytes.
    """
    watch = Stopwatch()
    solid = solidify(mesh, options.solid, watch)
    room = open_room(mesh, solid, options)
    cut = cut_solid(mesh, solid_to_cut(solid, room), options, watch, Deadline.after(None))
    margin = room.margin
    shown = thinned(mesh)
    original = solid.core.to_grid(shown.vertices) + margin, shown.faces
    seen_from = by_looks(search_projections(solid, options, options.refine.views, margin))
    small = shrunk(seen_from, pixels)
    views = RefineViews(small, silhouettes(*original, small))
    aims, budget = options.refine, options.selection.budget
    whole_room, room = room, narrowed_room(room, views, aims.overhang, budget)
    starts = [pull_into(cut + margin, room)]
    if hidden_share(cut + margin, whole_room, views, aims) < MUCH_BEGUN:
        starts += Surfaces(shown, solid.core).decimated(budget, room)
    outlines = Outlines.of(*original, search_projections(solid, options, OUTLINES, margin))
    found = refine(starts, room, views, budget, aims, options.seed, outlines=outlines)
    fine = search_projections(solid, options, FINE_VIEWS, margin)
    judge = Judge(FineViews.of(*original, fine, outlines), aims.precision, aims.overhang)
    best = judge.best_of([*found, *starts])
    better = search_again(found, best, room, views, judge, budget, aims, options.seed)
    if better is not None:
        best, room = better
    bound = room.bound * solid.core.cell_size
    return Occluder.of(solid.core.to_world(best - margin), bound, watch.timings)


def shrunk(projections: FloatArray, pixels: int) -> FloatArray:
    """The same pictures, ``pixels`` wide in the middle of 64."""
    scale = pixels / _WHOLE
    small = projections * scale
    small[..., 3] += (1.0 - scale) * _WHOLE / 2.0
    return np.ascontiguousarray(small)
