"""Scene -> occluders of its tree, with the work spread over processes and nothing made twice.

What building a scene's occluders needs: several at once, each in its own process or thread.

A scene as files that several processes map into memory, so that none holds a copy.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import CancelledError, EmptyMeshError, MeshError, OutputError
from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.geometry.solid import grid_shape
from simplifier.hierarchy.node import is_own_occluder, node_occluder, node_options
from simplifier.hierarchy.node_plan import Keys, NodeJob, Plan, plan_occluders
from simplifier.hierarchy.parts import Parts, split_large
from simplifier.hierarchy.store import OccluderStore, Summary
from simplifier.hierarchy.tree import Tree, build_tree
from simplifier.kernels.threads import thread_count
from simplifier.memory.limit import check_need
from simplifier.memory.need import MIB, MemoryNeed, MeshSize
from simplifier.memory.runs import Judging, judging, simplifying
from simplifier.options.scene import SceneOptions
from simplifier.processes import JobOutcome, run_jobs, run_jobs_here
from simplifier.progress import Cancel, TellCount

_FEW_JOBS = 16  # are done sooner than other processes have started


@dataclass(frozen=True, eq=False)
class Build:
    """What was built.

    ``parts``      of the scene, which leaves hold.
    ``tree``       over the boxes of the parts.
    ``keys``       (k,) of the nodes' occluders, those that hide something.
    ``summaries``  of all occluders by key, those that hide nothing included.
    ``made``, ``kept``  how many come from this run, and from earlier ones.
    ``warnings``   which occluders could not be made, and why.
    """

    parts: Parts
    tree: Tree
    keys: tuple[Keys, ...]
    summaries: Mapping[str, Summary]
    made: int
    kept: int
    warnings: tuple[str, ...]


def build_occluders(
    scene: Scene,
    options: SceneOptions,
    store: OccluderStore,
    known: Mapping[str, Summary],
    tell: TellCount = lambda done, total: None,
    cancel: Cancel | None = None,
    memory_limit: float | None = None,
) -> Build:
    """Make an occluder for every node of a tree over the scene's objects, into the store.

    What is there is not made again, so a run that was cancelled or killed goes on from there, and a
    changed object costs its own occluders and those on its path to the root.  What is there but
    damaged is made again; ``known``, from an earlier manifest, finds that out without reading them.
    An occluder that cannot be made is left out with a warning.

    The same scene, options and seed give the same files on any number of processes, in one run or
    several.  Raises :class:`EmptyMeshError` for a scene without objects, :class:`CancelledError`,
    :class:`~simplifier.errors.MemoryLimitError` where all processes together would need more than
    ``memory_limit`` GiB, None for half of the machine's,
    :class:`~simplifier.errors.OutputError` when the store cannot be written, and
    :class:`~simplifier.errors.BackendUnavailableError` when no process can be started.
    """
    if len(scene) == 0:
        raise EmptyMeshError("the scene has no object", remedy="give a scene with objects")
    parts = split_large(scene)
    tree = build_tree(parts.scene.bounds(), options.width)
    plan = plan_occluders(parts, tree, options)
    summaries = _reusable(plan, store, known, cancel)
    kept = len(summaries)
    jobs = _missing(plan, parts, summaries)
    _check_memory(parts.scene, jobs, options, memory_limit)
    failures: dict[int, str] = {}
    tell(kept, len(plan.jobs))
    with closing(_outcomes(parts.scene, jobs, options, store, cancel)) as outcomes:
        for done, outcome in enumerate(outcomes, start=kept + 1):
            if outcome.answer.failure:
                failures[outcome.job] = outcome.answer.failure
            else:
                summaries[jobs[outcome.job].key] = outcome.answer.result
            tell(done, len(plan.jobs))
    _check(cancel)
    return Build(
        parts, tree, _worthwhile(plan.keys, summaries), summaries, len(summaries) - kept, kept,
        tuple(f"{_place(scene, parts, jobs[i])}: no occluder ({failures[i]})"
              for i in sorted(failures)),
    )  # fmt: skip


def _reusable(
    plan: Plan, store: OccluderStore, known: Mapping[str, Summary], cancel: Cancel | None
) -> dict[str, Summary]:
    """Of what earlier runs made and is not damaged."""
    summaries = {}
    for key in sorted(store.keys() & plan.jobs.keys()):
        _check(cancel)
        summary = store.kept(key, known.get(key))
        if summary is not None:
            summaries[key] = summary
    return summaries


def _missing(plan: Plan, parts: Parts, summaries: Mapping[str, Summary]) -> list[NodeJob]:
    """Large ones first, for an even end."""
    triangles = parts.scene.triangle_counts
    jobs = [job for key, job in plan.jobs.items() if key not in summaries]
    return sorted(jobs, key=lambda job: (-int(triangles[job.parts].sum()), job.key))


def _check(cancel: Cancel | None) -> None:
    if cancel is not None and cancel.is_set():
        raise CancelledError("cancelled; what was made is kept and not made again")


def _worthwhile(keys: Sequence[Keys], summaries: Mapping[str, Summary]) -> tuple[Keys, ...]:
    """Without occluders that hide nothing or failed, and far ones that spare no triangle."""

    def triangles(key: str | None) -> int:
        return summaries[key].triangles if key is not None and key in summaries else 0

    def kept(node: Keys) -> Keys:
        far, near = triangles(node.far), triangles(node.near)
        spares = far > 0 and (near == 0 or far < near)
        return Keys(node.far if spares else None, node.near if near > 0 else None)

    return tuple(map(kept, keys))


def _check_memory(
    scene: Scene, jobs: Sequence[NodeJob], options: SceneOptions, memory_limit: float | None
) -> None:
    at_once, apart = _crew(jobs)

    def at(resolution: int) -> MemoryNeed:
        coarser = replace(options, resolution=resolution)
        return need_of_building(scene, jobs, coarser, at_once, apart=apart)

    check_need(at(options.resolution), memory_limit, resolution=options.resolution, at=at)


def _crew(jobs: Sequence[NodeJob]) -> tuple[int, bool]:
    """How many work at a time, and whether in processes: in threads of this one where that is
    sooner."""
    at_once = min(thread_count(), len(jobs))
    return at_once, len(jobs) > _FEW_JOBS and at_once > 1


def _outcomes(
    scene: Scene,
    jobs: Sequence[NodeJob],
    options: SceneOptions,
    store: OccluderStore,
    cancel: Cancel | None,
) -> Generator[JobOutcome, None, None]:
    processes, apart = _crew(jobs)
    if not apart:
        here = partial(_make, scene, options, store, cancel)
        yield from run_jobs_here(here, jobs, thread_count(), cancel)
        return
    with tempfile.TemporaryDirectory(prefix="occluder-") as folder:
        pack(scene, Path(folder))
        yield from run_jobs(_maker, (folder, options, store), jobs, processes, cancel)


def _maker(
    folder: str, options: SceneOptions, store: OccluderStore
) -> Callable[[NodeJob], Summary]:
    """What a process does with a job."""
    return partial(_make, unpack(Path(folder)), options, store, None)


def _make(
    scene: Scene, options: SceneOptions, store: OccluderStore, cancel: Cancel | None, job: NodeJob
) -> Summary:
    if job.kind == "inner":
        mesh = scene.joined(job.parts)
    else:
        mesh = scene.meshes[scene.mesh_of[job.parts[0]]]
    if not np.isfinite(mesh.extent).all() or mesh.extent.max() == 0.0:
        raise MeshError("it has no extent", remedy="scale it up, or take it off the scene")
    return store.write(job.key, node_occluder(mesh, job.kind, job.stand, options, cancel))


def _place(scene: Scene, parts: Parts, job: NodeJob) -> str:
    """Which object or objects a message is about."""
    objects = np.unique(parts.object_of[job.parts])
    others = len(objects) - 1
    first = scene.names[objects[0]]
    return first if others == 0 else f"{first} and {others} more"


_COPIES = 2  # of the scene: as it was read, and in parts
_WORKER = 90 * MIB  # of a process beside the first: their libraries' pages are the same


def need_of_building(
    scene: Scene, jobs: Sequence[NodeJob], options: SceneOptions, at_once: int, *, apart: bool
) -> MemoryNeed:
    """``scene`` of parts; the ``at_once`` largest jobs count, which meet at worst.

    ``apart``  whether each runs in a process of its own, with libraries of its own.
    """
    sizes = np.array([(len(mesh.vertices), len(mesh.faces)) for mesh in scene.meshes])
    held = _COPIES * sum(MeshSize(*size).held for size in sizes.tolist())
    bounds = scene.bounds()
    needs = sorted(_bytes_of_job(scene, sizes, bounds, job, options) for job in jobs)
    largest = needs[len(needs) - at_once :]
    libraries = _WORKER * at_once if apart else 0
    return MemoryNeed({"occluders": held + libraries + sum(largest)})


def _bytes_of_job(
    scene: Scene, sizes: np.ndarray[tuple[int, int], np.dtype[np.int64]], bounds: FloatArray,
    job: NodeJob, options: SceneOptions,
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


_ARRAYS = ("vertices", "faces", "vertex_ends", "face_ends", "mesh_of", "transforms")


def pack(scene: Scene, folder: Path) -> None:
    """Write the geometry, without names and warnings.  Raises :class:`OutputError`."""
    arrays: tuple[NDArray[Any], ...] = (
        np.concatenate([mesh.vertices for mesh in scene.meshes]),
        np.concatenate([mesh.faces for mesh in scene.meshes]),
        np.cumsum([len(mesh.vertices) for mesh in scene.meshes]),
        np.cumsum([len(mesh.faces) for mesh in scene.meshes]),
        scene.mesh_of,
        scene.transforms,
    )
    try:
        for name, array in zip(_ARRAYS, arrays, strict=True):
            np.save(folder / f"{name}.npy", array)
    except OSError as error:
        raise OutputError(
            f"the scene cannot be handed to other processes ({error.strerror})",
            where=str(folder),
            remedy="free some space, set TMPDIR to another folder, or OCCLUDER_THREADS=1",
        ) from None


def unpack(folder: Path) -> Scene:
    """The geometry, read from the files when it is looked at; names are empty."""
    vertices, faces, vertex_ends, face_ends, mesh_of, transforms = (
        np.asarray(np.load(folder / f"{name}.npy", mmap_mode="r")) for name in _ARRAYS
    )
    meshes = [
        TriangleMesh(*pair)
        for pair in zip(
            np.split(vertices, vertex_ends[:-1]), np.split(faces, face_ends[:-1]), strict=True
        )
    ]
    return Scene(tuple(meshes), ("",) * len(mesh_of), mesh_of, transforms)
