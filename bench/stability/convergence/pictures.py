"""An occluder whose refinement looks at smaller pictures than the 64 pixels of a machine word."""

from __future__ import annotations

import numpy as np

from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.options.stages import ERROR_VOXELS, Options
from simplifier.pipeline import cut_solid
from simplifier.progress import Deadline, Stopwatch
from simplifier.refinement.annealing import RefineViews
from simplifier.refinement.finalists import FineViews, best_of
from simplifier.refinement.search import pull_into, refine
from simplifier.refinement.starts import enclosed_start, sheet_start
from simplifier.refinement.thin import thin_for_pictures
from simplifier.selection.measure import search_projections, silhouettes
from simplifier.steps.solid import solidify
from simplifier.voxel.morphology import dilate

_WHOLE = 64  # pixels a side that the search's pictures have
_FINE_VIEWS = 12  # that decide at the end, in pictures of 256 pixels whatever the search's


def made_by_pictures(mesh: TriangleMesh, options: Options, pixels: int) -> Occluder:
    """As the pipeline makes it from a preset that decimates; only the search's pictures differ.

    ``pixels`` 1 to 64 of a side; 64 give the pipeline's very bytes.
    """
    watch = Stopwatch()
    solid = solidify(mesh, options.solid, watch)
    cut = cut_solid(solid, options, watch, Deadline.after(None))
    allowed, margin = dilate(solid.core, solid.reach)
    original = thin_for_pictures(solid.core.to_grid(mesh.vertices) + margin, mesh.faces)
    small = shrunk(search_projections(solid, options, options.refine.views, margin), pixels)
    budget, starts = options.selection.budget, [pull_into(cut + margin, allowed)]
    for vertices, faces in (
        enclosed_start(solid.core, allowed, margin, budget),
        sheet_start(mesh, solid.core, allowed, margin, budget),
    ):
        starts.append(pull_into(vertices[faces] + margin, allowed))
    views = RefineViews(small, silhouettes(*original, small))
    found = refine(starts, allowed, views, budget, options.refine, options.seed)
    fine = FineViews.of(*original, search_projections(solid, options, _FINE_VIEWS, margin))
    best = best_of([*found, *starts], fine, options.refine.precision)
    return Occluder.of(
        solid.core.to_world(best - margin), ERROR_VOXELS * solid.core.cell_size, watch.timings
    )


def shrunk(projections: FloatArray, pixels: int) -> FloatArray:
    """The same pictures, ``pixels`` wide in the middle of 64."""
    scale = pixels / _WHOLE
    small = projections * scale
    small[..., 3] += (1.0 - scale) * _WHOLE / 2.0
    return np.ascontiguousarray(small)
