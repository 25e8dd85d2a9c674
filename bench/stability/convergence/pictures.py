"""An occluder whose refinement looks at smaller pictures than the 64 pixels of a machine word."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace

import numpy as np

from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.kernels.bit_image import SIZE
from simplifier.kernels.threads import Ahead
from simplifier.options.stages import Options, fineness
from simplifier.pipeline import cut_solid
from simplifier.progress import Deadline, Stopwatch
from simplifier.selection.measure import silhouettes
from simplifier.steps.look import Looks, look
from simplifier.steps.refine import improve
from simplifier.steps.room import open_room, solid_to_cut, with_inner
from simplifier.steps.solid import solidify


def made_by_pictures(mesh: TriangleMesh, options: Options, pixels: int) -> Occluder:
    """As the pipeline makes it of what has to be searched for; only the search's pictures differ.

    ``pixels`` 1 to 64 of a side; 64 give the pipeline's very bytes.
    """
    watch, deadline = Stopwatch(), Deadline.after(None)
    size = fineness(options.solid.resolution) if options.marks_finely else 1
    solid = solidify(mesh, options.solid, watch, size=size)
    room = open_room(mesh, solid, options)
    if room is None:
        raise ValueError("triangles that are not moved are not looked at")
    solid = with_inner(solid, room)
    looks = in_pixels(look(mesh, solid, room, options, deadline), pixels)
    cut = cut_solid(mesh, solid_to_cut(solid, room), options, watch, deadline)
    with closing(Ahead(lambda stopped: looks)) as ahead, watch.stage("refine"):
        found = improve(cut, mesh, solid, room, ahead, options, watch, deadline)
    triangles = solid.core.to_world(found.triangles)
    return Occluder.of(triangles, found.bound * solid.core.cell_size, watch.timings)


def in_pixels(looks: Looks, pixels: int) -> Looks:
    """The same looks, with smaller pictures for the search; what judges it stays as it is."""
    small = shrunk(looks.views.projections, pixels)
    originals = silhouettes(*looks.original.mesh, small)
    return replace(looks, views=replace(looks.views, projections=small, originals=originals))


def shrunk(projections: FloatArray, pixels: int) -> FloatArray:
    """The same pictures, ``pixels`` wide in the middle of 64."""
    scale = pixels / SIZE
    small = projections * scale
    small[..., 3] += (1.0 - scale) * SIZE / 2.0
    return np.ascontiguousarray(small)
