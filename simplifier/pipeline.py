"""TriangleMesh -> Occluder: the paper's steps and what goes past it, in order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from simplifier.cut import cut_solid
from simplifier.deadline import Deadline
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.solid import Solid
from simplifier.improve import improve
from simplifier.itself import fits, seen_triangles
from simplifier.options import ERROR_VOXELS, Options
from simplifier.progress import Cancel, Listener, Stopwatch
from simplifier.solidify import solid_warnings, solidify

_EMPTY = (
    "nothing within the error bound hides more rightly than wrongly, so the occluder is empty; "
    "raise the resolution"
)


@dataclass(frozen=True, eq=False)
class Simplification:
    """An occluder, the solid that it was cut from, and what the user should know.

    ``interrupted``  whether the run was cancelled, so that this is the best so far.
    """

    occluder: Occluder
    solid: Solid
    warnings: tuple[str, ...]
    interrupted: bool = False

    @property
    def timings(self) -> Mapping[str, float]:
        """Seconds by stage."""
        return self.occluder.timings


def simplify_mesh(
    mesh: TriangleMesh,
    options: Options,
    listener: Listener | None = None,
    cancel: Cancel | None = None,
) -> Simplification:
    """Turn a triangle soup into an occluder of at most ``options.selection.budget`` triangles.

    ``listener`` is told about the progress; what it raises ends the run.  ``cancel``, once set,
    ends it soon: with the best so far from refining on, before that with
    :class:`~simplifier.errors.CancelledError`.  Raises
    :class:`~simplifier.errors.BackendUnavailableError` for a slicer that cannot run here.
    """
    deadline = Deadline.after(options.time_limit)
    watch = Stopwatch(listener, cancel)
    solid = solidify(mesh, options.solid, watch)
    # Before refining, which uses up what a time limit leaves.
    warnings = solid_warnings(mesh, solid, options.solid)
    if fits(mesh, solid, options.selection.budget):
        triangles, interrupted = seen_triangles(mesh, solid), False
    else:
        triangles = cut_solid(solid, options, watch, deadline)
        with watch.stage("refine", cancels=False):
            triangles = improve(triangles, mesh, solid, options, watch, deadline)
            interrupted = watch.cancelled
        triangles = solid.core.to_world(triangles)
    # A voxel wholly inside is interior, at no distance at all.
    bound = 0.0 if solid.wholly_inside else ERROR_VOXELS * solid.core.cell_size
    occluder = Occluder.of(triangles, bound, watch.timings)
    if len(occluder.faces) == 0 < solid.core.count:
        warnings.append(_EMPTY)
    if interrupted:
        warnings.append("interrupted: the best so far")
    return Simplification(occluder, solid, tuple(warnings), interrupted)
