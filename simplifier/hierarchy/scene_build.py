"""Scene -> occluders of its tree, with the work spread over a pool and nothing made twice.

What building a scene's occluders needs: several at once, each in its own process or thread.

A scene as arrays that all processes of a machine map into memory, so that none holds a copy.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from simplifier.errors import CancelledError, EmptyMeshError, MeshError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.geometry.solid import grid_shape
from simplifier.hierarchy.node import Stand, is_own_occluder, node_occluder, node_options
from simplifier.hierarchy.node_plan import Keys, NodeJob, Plan, plan_occluders
from simplifier.hierarchy.packing import WeldedMesh
from simplifier.hierarchy.parts import Parts, split_large
from simplifier.hierarchy.store import OccluderFile, OccluderStore, Summary
from simplifier.hierarchy.tree import Tree, build_tree
from simplifier.kernels.threads import thread_count
from simplifier.memory.limit import check_need
from simplifier.memory.need import MIB, MemoryNeed, MeshSize
from simplifier.memory.runs import Judging, judging, simplifying
from simplifier.options.scene import SceneOptions
from simplifier.pools import Arrived, LocalPool, Pool, PoolJob, Shared, Work
from simplifier.processes import JobOutcome, run_jobs_here
from simplifier.progress import Cancel, TellCount

_FEW_JOBS = 16  # are done sooner than other processes have started

LEAST_IN_POOL = 64
"""Occluders that other machines are asked for: fewer are made here before a scene has arrived there
and processes have started, at about a second of a processor each."""


@dataclass(frozen=True, eq=False)
class Build:
    """What was built.

    ``parts``      of the scene, which leaves hold.
    ``tree``       over the boxes of the parts.
    ``keys``       (k,) of the nodes' occluders, those that hide something.
    ``summaries``  of all occluders by key, those that hide nothing included.
    ``meshes``     of those from this run, by key, as ``scene.occs`` is to have them.
    ``made``, ``kept``  how many come from this run, and from earlier ones.
    ``warnings``   which occluders could not be made, and why.
    """

    parts: Parts
    tree: Tree
    keys: tuple[Keys, ...]
    summaries: Mapping[str, Summary]
    meshes: Mapping[str, WeldedMesh]
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
    pool: Pool | None = None,
    say: Callable[[str], None] = lambda line: None,
) -> Build:
    """Make an occluder for every node of a tree over the scene's objects, into the store.

    What is there is not made again, so a run that was cancelled or killed goes on from there, and a
    changed object costs its own occluders and those on its path to the root.  What is there but
    damaged is made again; ``known``, from an earlier manifest, finds that out without reading them.
    An occluder that cannot be made is left out with a warning.

    ``pool``  makes them in place of this machine, where :data:`LEAST_IN_POOL` are to be made; the
    memory of its machines is its own matter.  ``say`` hears in a sentence where they are made.

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
    tree = build_tree(parts.bounds, options.width)
    plan = plan_occluders(parts, tree, options)
    summaries = _reusable(plan, store, known, cancel)
    kept = len(summaries)
    jobs = _missing(plan, parts, summaries)
    pool = _worth_a_pool(pool, jobs, say)
    needs = list(_job_needs(parts, jobs, options))
    _check_memory(parts, jobs, needs, options, memory_limit, pool)
    failures: dict[int, str] = {}
    meshes: dict[str, WeldedMesh] = {}
    tell(kept, len(plan.jobs))
    with closing(_outcomes(parts.scene, jobs, needs, options, pool, cancel)) as outcomes:
        for done, outcome in enumerate(outcomes, start=kept + 1):
            key, failure = jobs[outcome.job].key, outcome.answer.failure
            if not failure:
                try:
                    file = _unpacked(outcome.answer.result)
                    summaries[key] = store.write(key, file)
                    if file.mesh is not None:
                        meshes[key] = file.mesh
                except MeshError as error:
                    failure = str(error)
            if failure:
                failures[outcome.job] = failure
            tell(done, len(plan.jobs))
    _check(cancel)
    return Build(
        parts, tree, _worthwhile(plan.keys, summaries), summaries, meshes, len(summaries) - kept,
        kept,
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


def _worth_a_pool(
    pool: Pool | None, jobs: Sequence[NodeJob], say: Callable[[str], None]
) -> Pool | None:
    if pool is None or not jobs:
        return None
    if len(jobs) < LEAST_IN_POOL:
        few = f"{len(jobs)} to make, and others take {LEAST_IN_POOL} and more"
        say(f"occluders are made on this machine: {few}")
        return None
    say(f"occluders are made {pool.where}")
    return pool


def _check_memory(
    parts: Parts,
    jobs: Sequence[NodeJob],
    needs: Sequence[int],
    options: SceneOptions,
    memory_limit: float | None,
    pool: Pool | None,
) -> None:
    at_once, apart = _crew(jobs) if pool is None else (0, False)

    def at(resolution: int) -> MemoryNeed:
        coarser = replace(options, resolution=resolution)
        some = needs if coarser == options else list(_job_needs(parts, jobs, coarser))
        return need_of_building(parts.scene, some, at_once, apart=apart)

    check_need(at(options.resolution), memory_limit, resolution=options.resolution, at=at)


def _crew(jobs: Sequence[NodeJob]) -> tuple[int, bool]:
    """How many work at a time, and whether in processes: in threads of this one where that is
    sooner."""
    at_once = min(thread_count(), len(jobs))
    return at_once, len(jobs) > _FEW_JOBS and at_once > 1


def _outcomes(
    scene: Scene,
    jobs: Sequence[NodeJob],
    needs: Sequence[int],
    options: SceneOptions,
    pool: Pool | None,
    cancel: Cancel | None,
) -> Generator[JobOutcome, None, None]:
    """The file of each, as :func:`_packed` has it, or why there is none."""
    if pool is None:
        processes, apart = _crew(jobs)
        if not apart:
            here = partial(_made, scene, options, cancel)
            yield from run_jobs_here(here, jobs, thread_count(), cancel)
            return
        pool = LocalPool(processes)
    told = [PoolJob(_job_data(job), need) for job, need in zip(jobs, needs, strict=True)]
    yield from pool.run_jobs(
        f"{__name__}:{occluder_maker.__name__}", pack(scene, options), told, cancel
    )


def _job_data(job: NodeJob) -> bytes:
    stand = [job.stand.ground, job.stand.smallest_hole]
    return json.dumps([job.kind, job.parts.tolist(), *stand]).encode()


def occluder_maker(arrived: Arrived) -> Work:
    """What a worker of a pool does with a job."""
    scene, options = unpack(arrived)

    def make(data: bytes) -> bytes:
        kind, parts, *stand = json.loads(data)
        job = NodeJob("", kind, np.array(parts, dtype=np.int32), Stand(*stand))
        return _made(scene, options, None, job)

    return make


def _made(scene: Scene, options: SceneOptions, cancel: Cancel | None, job: NodeJob) -> bytes:
    if job.kind == "inner":
        mesh = scene.joined(job.parts)
    else:
        mesh = scene.meshes[scene.mesh_of[job.parts[0]]]
    if not np.isfinite(mesh.extent).all() or mesh.extent.max() == 0.0:
        raise MeshError("it has no extent", remedy="scale it up, or take it off the scene")
    return _packed(OccluderFile.of(node_occluder(mesh, job.kind, job.stand, options, cancel)))


def _packed(file: OccluderFile) -> bytes:
    """A line of JSON, then the bytes of the file, and those of the mesh."""
    mesh, head, body = file.mesh, asdict(file.summary), file.data
    if mesh is not None:
        head["mesh"] = [mesh.origin.tolist(), len(mesh.positions), len(mesh.faces)]
        body += mesh.positions.tobytes() + mesh.faces.tobytes()
    head["whole"] = zlib.crc32(body)
    return json.dumps(head).encode() + b"\n" + body


def _unpacked(answer: bytes) -> OccluderFile:
    """Raises :class:`MeshError` for what no worker of this release says."""
    head, _, body = answer.partition(b"\n")
    try:
        said = json.loads(head)
        data, mesh = _mesh_behind(body, said.get("mesh"))
        numbers = int(said["triangles"]), float(said["error_bound"]), float(said["radius"])
        summary = Summary(*numbers, zlib.crc32(data))
        if summary.checksum != said["checksum"] or zlib.crc32(body) != said["whole"]:
            raise ValueError
    except (ValueError, KeyError, TypeError, AttributeError):
        raise MeshError("its occluder arrived damaged", remedy="build the scene again") from None
    return OccluderFile(data, summary, mesh)


def _mesh_behind(body: bytes, said: Any) -> tuple[bytes, WeldedMesh | None]:
    """The bytes of the file, and the mesh that is behind them if one was said to be."""
    if said is None:
        return body, None
    origin, vertices, triangles = said
    size = 12 * (vertices + triangles)
    positions = np.frombuffer(body, np.float32, 3 * vertices, len(body) - size)
    faces = np.frombuffer(body, np.int32, 3 * triangles, len(body) - 12 * triangles)
    mesh = WeldedMesh(np.array(origin), positions.reshape(-1, 3), faces.reshape(-1, 3))
    return body[: len(body) - size], mesh


def _place(scene: Scene, parts: Parts, job: NodeJob) -> str:
    """Which object or objects a message is about."""
    objects = np.unique(parts.object_of[job.parts])
    others = len(objects) - 1
    first = scene.names[objects[0]]
    return first if others == 0 else f"{first} and {others} more"


_COPIES = 2  # of the scene: as it was read, and in parts
_WORKER = 90 * MIB  # of a process beside the first: their libraries' pages are the same


def need_of_building(
    scene: Scene, needs: Sequence[int], at_once: int, *, apart: bool
) -> MemoryNeed:
    """``scene`` of parts; of the ``needs`` of jobs the ``at_once`` largest count, which meet at
    worst.

    ``apart``  whether each runs in a process of its own, with libraries of its own.
    """
    held = _COPIES * sum(MeshSize(*size).held for size in _mesh_sizes(scene).tolist())
    largest = sorted(needs)[len(needs) - at_once :]
    libraries = _WORKER * at_once if apart else 0
    return MemoryNeed({"occluders": held + libraries + sum(largest)})


def _bytes_of_job(
    parts: Parts, sizes: np.ndarray[tuple[int, int], np.dtype[np.int64]], job: NodeJob,
    options: SceneOptions,
) -> int:  # fmt: skip
    """Bytes of one job, beside the scene."""
    scene, bounds = parts.scene, parts.bounds
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


def _job_needs(parts: Parts, jobs: Sequence[NodeJob], options: SceneOptions) -> Iterator[int]:
    """Bytes of each job, beside the scene."""
    sizes = _mesh_sizes(parts.scene)
    return (_bytes_of_job(parts, sizes, job, options) for job in jobs)


def _mesh_sizes(scene: Scene) -> np.ndarray[tuple[int, int], np.dtype[np.int64]]:
    return np.array([(len(mesh.vertices), len(mesh.faces)) for mesh in scene.meshes])


def pack(scene: Scene, options: SceneOptions) -> Shared:
    """The options and the geometry, without names and warnings."""
    return Shared(
        json.dumps(asdict(options)).encode(),
        {
            "vertices": [mesh.vertices for mesh in scene.meshes],
            "faces": [mesh.faces for mesh in scene.meshes],
            "vertex_ends": [np.cumsum([len(mesh.vertices) for mesh in scene.meshes])],
            "face_ends": [np.cumsum([len(mesh.faces) for mesh in scene.meshes])],
            "mesh_of": [scene.mesh_of],
            "transforms": [scene.transforms],
        },
    )


def unpack(arrived: Arrived) -> tuple[Scene, SceneOptions]:
    """The geometry, read when it is looked at, whose names are empty, and the options."""
    arrays = arrived.arrays
    meshes = [
        TriangleMesh(*pair)
        for pair in zip(
            np.split(arrays["vertices"], arrays["vertex_ends"][:-1]),
            np.split(arrays["faces"], arrays["face_ends"][:-1]),
            strict=True,
        )
    ]
    mesh_of = arrays["mesh_of"]
    scene = Scene(tuple(meshes), ("",) * len(mesh_of), mesh_of, arrays["transforms"])
    return scene, SceneOptions.of(json.loads(arrived.settings))
