"""Scene -> occluders of its tree, with the work spread over processes and nothing made twice."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from simplifier.errors import CancelledError, MeshError, OccluderError
from simplifier.geometry.scene import Scene
from simplifier.hierarchy.node import Summary, node_occluder
from simplifier.hierarchy.options import SceneOptions
from simplifier.hierarchy.packed import pack, unpack
from simplifier.hierarchy.parts import Parts, split_large
from simplifier.hierarchy.plan import Job, Keys, plan_occluders
from simplifier.hierarchy.store import OccluderStore
from simplifier.hierarchy.tree import Tree, build_tree
from simplifier.hierarchy.workers import Outcome, run_jobs
from simplifier.kernels.threads import thread_count
from simplifier.progress import Cancel

Tell = Callable[[int, int], None]
"""Told how many occluders are there and how many there will be."""

_FEW_JOBS = 16  # are done sooner than other processes have started


@dataclass(frozen=True, eq=False)
class Build:
    """What was built.

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
    tell: Tell = lambda done, total: None,
    cancel: Cancel | None = None,
) -> Build:
    """Make an occluder for every node of a tree over the scene's objects, into the store.

    What is there is not made again, so a run that was cancelled or killed goes on from there, and a
    changed object costs its own occluder and those on its path to the root.  ``known`` spares
    reading those that are there.  An occluder that cannot be made is left out with a warning.
    Raises :class:`~simplifier.errors.CancelledError`.
    """
    parts = split_large(scene)
    tree = build_tree(parts.scene.bounds(), options.width)
    plan = plan_occluders(parts, tree, options)
    there = store.keys() & plan.jobs.keys()
    missing = [job for key, job in plan.jobs.items() if key not in there]
    missing.sort(key=lambda job: (-len(job.parts), job.key))  # long ones first, for an even end
    tell(len(there), len(plan.jobs))
    summaries, failures = {}, []
    for done, outcome in enumerate(_outcomes(parts, missing, options, store, cancel), start=1):
        job = missing[outcome.job]
        if outcome.failure:
            failures.append(f"{_place(parts, job)}: no occluder ({outcome.failure})")
        else:
            summaries[job.key] = outcome.result
        tell(len(there) + done, len(plan.jobs))
    if cancel is not None and cancel.is_set():
        raise CancelledError("cancelled; what was made is kept and not made again")
    made = len(summaries)
    summaries |= {key: known.get(key) or Summary.of(store.read(key)) for key in sorted(there)}
    return Build(
        parts, tree, _worthwhile(plan.keys, summaries), summaries, made, len(there), tuple(failures)
    )


def _worthwhile(keys: Sequence[Keys], summaries: Mapping[str, Summary]) -> tuple[Keys, ...]:
    """Without occluders that hide nothing or failed, and far ones that spare no triangle."""

    def triangles(key: str | None) -> int:
        return summaries[key].triangles if key is not None and key in summaries else 0

    def kept(node: Keys) -> Keys:
        far, near = triangles(node.far), triangles(node.near)
        spares = far > 0 and (near == 0 or far < near)
        return Keys(node.far if spares else None, node.near if near > 0 else None)

    return tuple(map(kept, keys))


def _outcomes(
    parts: Parts,
    jobs: Sequence[Job],
    options: SceneOptions,
    store: OccluderStore,
    cancel: Cancel | None,
) -> Iterator[Outcome]:
    """In this process, on all threads, where that is sooner."""
    processes = min(thread_count(), len(jobs))
    if len(jobs) <= _FEW_JOBS or processes < 2:
        for index, job in enumerate(jobs):
            yield _outcome_here(parts.scene, options, store, cancel, index, job)
        return
    with tempfile.TemporaryDirectory(prefix="occluder-") as folder:
        pack(parts.scene, Path(folder))
        arguments = (folder, options, store)
        yield from run_jobs(_maker, arguments, jobs, processes, cancel)


def _outcome_here(
    scene: Scene,
    options: SceneOptions,
    store: OccluderStore,
    cancel: Cancel | None,
    index: int,
    job: Job,
) -> Outcome:
    try:
        return Outcome(index, _make(scene, options, store, cancel, job))
    except CancelledError:
        raise
    except OccluderError as error:
        return Outcome(index, failure=str(error))


def _maker(folder: str, options: SceneOptions, store: OccluderStore) -> Callable[[Job], Summary]:
    """What a process does with a job."""
    return partial(_make, unpack(Path(folder)), options, store, None)


def _make(
    scene: Scene, options: SceneOptions, store: OccluderStore, cancel: Cancel | None, job: Job
) -> Summary:
    if job.kind == "inner":
        mesh = scene.joined(job.parts)
    else:
        mesh = scene.meshes[scene.mesh_of[job.parts[0]]]
    if not np.isfinite(mesh.extent).all() or mesh.extent.max() == 0.0:
        raise MeshError("it has no extent")
    occluder = node_occluder(mesh, job.kind, job.stand, options, cancel)
    store.write(job.key, occluder)
    return Summary.of(occluder)


def _place(parts: Parts, job: Job) -> str:
    """Which object or objects a message is about."""
    first = parts.scene.names[min(job.parts)]
    others = len(job.parts) - 1
    return first if others == 0 else f"{first} and {others} others"
