"""What building a scene's occluders needs: several at once, each in its own process or thread."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simplifier.geometry.grid import grid_shape
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.scene import Scene
from simplifier.hierarchy.node import is_own_occluder, node_options
from simplifier.hierarchy.node_plan import Job
from simplifier.hierarchy.options import SceneOptions
from simplifier.memory.need import MIB, MemoryNeed
from simplifier.memory.runs import Judging, judging, simplifying
from simplifier.memory.stages import MeshSize

_COPIES = 2  # of the scene: as it was read, and in parts
_WORKER = 90 * MIB  # of a process beside the first: their libraries' pages are the same


def need_of_building(
    scene: Scene, jobs: Sequence[Job], options: SceneOptions, at_once: int, *, apart: bool
) -> MemoryNeed:
    """``scene`` of parts; the ``at_once`` largest jobs count, which meet at worst.

    ``apart``  whether each runs in a process of its own, with libraries of its own.
    """
    sizes = np.array([(len(mesh.vertices), len(mesh.faces)) for mesh in scene.meshes])
    held = _COPIES * sum(MeshSize(*size).held for size in sizes.tolist())
    bounds = scene.bounds()
    needs = sorted(_need(scene, sizes, bounds, job, options) for job in jobs)
    largest = needs[len(needs) - at_once :]
    libraries = _WORKER * at_once if apart else 0
    return MemoryNeed({"occluders": held + libraries + sum(largest)})


def _need(
    scene: Scene, sizes: np.ndarray[tuple[int, int], np.dtype[np.int64]], bounds: FloatArray,
    job: Job, options: SceneOptions,
) -> int:  # fmt: skip
    """Bytes of one job, beside the scene."""
    meshes = scene.mesh_of[job.parts]
    vertices, triangles = sizes[meshes].sum(axis=0).tolist()
    size = MeshSize(vertices, triangles)
    if job.kind == "inner":
        extent = bounds[job.parts, 1].max(axis=0) - bounds[job.parts, 0].min(axis=0)
    else:
        mesh = scene.meshes[meshes[0]]
        if job.kind == "near" and is_own_occluder(mesh, options):
            return size.held
        extent = mesh.extent
    longest = float(extent.max())
    if not 0.0 < longest < np.inf:  # no occluder can be made, which the job says
        return size.held
    chosen = node_options(longest, job.kind, job.stand, options)
    shape = grid_shape(extent, chosen.solid.resolution)
    making = simplifying(size, shape, longest / chosen.solid.resolution, chosen)
    both = making.joined(judging(size, shape, chosen, Judging(views=1)))
    return both.stages[both.largest]
