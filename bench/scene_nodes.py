"""Scenes by several nodes: ``python -m bench.scene_nodes [--only PART] [--objects N] ...``.

    nodes  a part of Lyon by one process, by one Ray node and by two: time, traffic, the same bytes
    large  a generated scene, every mesh of which is used once: what it takes to plan it and to hand
           it over, memory a node, traffic; and of every so many-th occluder, what all would take

Each node has one processor, on loopback of this machine, so that two take all that two cores have.
Traffic is what the second node's sockets have received, as ``ss`` tells it.  Needs the extra
``ray``.  ``scene_nodes_PART.csv`` hold the figures.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from bench.meshes import ASSETS
from bench.record import Row, told, write_page, write_table
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.hierarchy.scene_build import Build, build_occluders
from simplifier.hierarchy.scene_file import occluder_store
from simplifier.io.scene import load_scene
from simplifier.options.scene import SceneOptions
from simplifier.pools import Answer, JobOutcome, LocalPool, Pool, PoolJob, Shared
from simplifier.progress import Cancel
from tests.cluster.pool_nodes import RayCluster, RayNode, ray_cluster

RESULTS = Path("bench/results")
MIB = float(1 << 20)
_NOT_TAKEN = "not of the sample"


def node_rows(arguments: argparse.Namespace) -> Iterator[Row]:
    """Each build from nothing, of a scene in memory, by processes that are yet to start."""
    whole = load_scene(ASSETS / "city_lyon_buildings.glb")
    scene = whole.some(np.arange(len(whole)) < arguments.objects)
    options = SceneOptions(up="z", ground=True)
    made: dict[str, bytes] = {}
    for by, nodes in (("one process", 0), ("one node", 1), ("two nodes", 2)):
        with tempfile.TemporaryDirectory() as folder:
            if nodes == 0:
                counted = CountedPool(LocalPool(1))
                seconds, build = _timed(scene, options, counted, folder)
                moved = 0
            else:
                with ray_cluster(nodes) as cluster, cluster.pool() as pool:
                    counted = CountedPool(pool)
                    seconds, build = _timed(scene, options, counted, folder)
                    moved = _received(cluster.nodes[-1]) if nodes == 2 else 0
            files = {path.name: path.read_bytes() for path in Path(folder).rglob("*.glb")}
        made = made or files
        yield {
            "by": by, "objects": len(scene), "occluders": build.made,
            "seconds": round(seconds, 1), "put_mib": round(counted.put / MIB, 2),
            "answers_mib": round(counted.answered / MIB, 2), "second_node_received_mib":
            round(moved / MIB, 2), "same_bytes": files == made,
        }  # fmt: skip


def large_rows(arguments: argparse.Namespace) -> Iterator[Row]:
    for triangles in arguments.triangles:
        objects = max(round(triangles / arguments.each), 1)
        begin = time.perf_counter()
        scene = generated_scene(objects, arguments.each)
        generated = time.perf_counter() - begin
        store = int(1.3 * sum(m.vertices.nbytes + m.faces.nbytes for m in scene.meshes)) + (
            256 << 20
        )
        with (
            ray_cluster(2, store=store) as cluster,
            cluster.pool() as pool,
            tempfile.TemporaryDirectory() as folder,
        ):
            counted = CountedPool(pool, arguments.every, cluster)
            _timed(scene, SceneOptions(), counted, folder)
            moved = _received(cluster.nodes[-1])
        times, jobs = counted.times, counted.jobs
        took = times[-2] - counted.begun  # without the largest, which comes last
        planned = counted.begun - counted.made
        yield {
            "triangles": int(scene.triangle_counts.sum()), "objects": objects,
            "generate_s": round(generated, 1), "plan_s": round(planned, 1),
            "first_answer_s": round(times[0] - counted.begun, 1),
            "put_mib": round(counted.put / MIB), "second_node_received_mib": round(moved / MIB),
            "driver_gib": round(_peak() / 2**30, 2),
            "worker_own_mib": round(counted.own / MIB), "worker_shared_mib":
            round(counted.mapped / MIB),
            "occluders": jobs, "sampled": len(times) - 1, "sample_s": round(took),
            "largest_job_s": round(times[-1] - times[-3], 1),
            "all_by_two_processors_h": round(took * jobs / (len(times) - 1) / 3600.0, 2),
        }  # fmt: skip


def generated_scene(objects: int, triangles: int, seed: int = 0) -> Scene:
    """Boulders on a square of ground, each of a mesh of its own with about so many triangles.

    Closed, a few units wide, twelve apart, +y up.  The same arguments give the same scene.
    """
    random = np.random.default_rng(seed)
    rings = max(int(np.ceil(0.5 * (1.0 + np.sqrt(1.0 + triangles)))), 3)
    directions, faces = _sphere(rings)
    side = int(np.ceil(np.sqrt(objects)))
    meshes, transforms = [], np.tile(np.eye(4), (objects, 1, 1))
    for place in range(objects):
        waves = random.normal(size=(6, 3)) * 3.0
        bumps = 1.0 + 0.08 * np.sin(directions @ waves.T + random.uniform(0.0, 6.3, 6)).sum(axis=1)
        size = random.uniform(2.0, 5.0, 3)
        meshes.append(TriangleMesh(directions * size * bumps[:, None], faces.copy()))
        transforms[place, :3, 3] = 12.0 * (place % side), 0.0, 12.0 * (place // side)
    names = tuple(f"boulder {place}" for place in range(objects))
    return Scene(tuple(meshes), names, np.arange(objects, dtype=np.int32), transforms)


def _sphere(rings: int) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors (n, 3), and faces (m, 3) between them, 4 ``rings`` (``rings`` - 1) of them."""
    around = 2 * rings
    high = np.pi * np.arange(1, rings) / rings
    turn = 2.0 * np.pi * np.arange(around) / around
    ring = np.stack(
        [np.outer(np.sin(high), np.cos(turn)), np.outer(np.cos(high), np.ones(around)),
         np.outer(np.sin(high), np.sin(turn))], axis=-1,
    ).reshape(-1, 3)  # fmt: skip
    points = np.concatenate([ring, [[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]])
    here = np.arange(around)
    beside = (here + 1) % around
    faces = [np.column_stack([np.full(around, len(ring)), beside, here])]
    for row in range(rings - 2):
        a, b = row * around, (row + 1) * around
        faces += [np.column_stack([a + here, a + beside, b + here]),
                  np.column_stack([a + beside, b + beside, b + here])]  # fmt: skip
    last = (rings - 2) * around
    faces.append(np.column_stack([np.full(around, len(ring) + 1), last + here, last + beside]))
    return points, np.concatenate(faces).astype(np.int32)


@dataclass(eq=False)
class CountedPool:
    """A pool that does every ``every``-th of the jobs, and what crossed; the jobs come with the
    largest first, so that the sample has large and small ones as all have.

    Of a sample the largest of all jobs is done as well, after the others.  ``times`` are those of
    the answers, ``own`` and ``mapped`` the most that a worker held meanwhile.
    """

    pool: Pool
    every: int = 1
    cluster: RayCluster | None = None
    put: int = 0
    answered: int = 0
    jobs: int = 0
    made: float = 0.0
    begun: float = 0.0
    times: list[float] = field(default_factory=list)
    own: int = 0
    mapped: int = 0

    def __post_init__(self) -> None:
        self.made = time.perf_counter()

    @property
    def where(self) -> str:
        return self.pool.where

    def run_jobs(
        self, work: str, shared: Shared, jobs: Sequence[PoolJob], cancel: Cancel | None = None
    ) -> Generator[JobOutcome, None, None]:
        taken = list(range(self.every // 2, len(jobs), self.every))
        taken += [0] if self.every > 1 else []
        self.jobs, self.begun = len(jobs), time.perf_counter()
        self.put = shared.nbytes + sum(len(jobs[place].data) for place in taken)
        over = threading.Event()
        looking = threading.Thread(target=self._look_on, args=(over,))
        looking.start()
        try:
            some = [jobs[place] for place in taken]
            for outcome in self.pool.run_jobs(work, shared, some, cancel):
                self.times.append(time.perf_counter())
                self.answered += len(outcome.answer.result or b"")
                yield JobOutcome(taken[outcome.job], outcome.answer)
        finally:
            over.set()
            looking.join()
        for place in sorted(set(range(len(jobs))) - set(taken)):
            yield JobOutcome(place, Answer(failure=_NOT_TAKEN))

    def _look_on(self, over: threading.Event) -> None:
        while not over.wait(0.2):
            self._look()

    def _look(self) -> None:
        """At the memory of workers: their own, and of the object store."""
        for node in self.cluster.nodes if self.cluster is not None else ():
            for pid in node.named("ray::do_job"):
                try:
                    text = Path(f"/proc/{pid}/status").read_text()
                except OSError:
                    continue
                kib = dict(re.findall(r"^(Rss\w+):\s+(\d+) kB", text, re.MULTILINE))
                self.own = max(self.own, 1024 * int(kib.get("RssAnon", 0)))
                self.mapped = max(self.mapped, 1024 * int(kib.get("RssShmem", 0)))


def _timed(scene: Scene, options: SceneOptions, pool: Pool, folder: str) -> tuple[float, Build]:
    begin = time.perf_counter()
    store = occluder_store(Path(folder))
    build = build_occluders(scene, options, store, {}, memory_limit=64.0, pool=pool)
    others = [warning for warning in build.warnings if _NOT_TAKEN not in warning]
    assert not others, others
    return time.perf_counter() - begin, build


def _received(node: RayNode) -> int:
    """Bytes by connections that are open, of the node's own processes but its workers."""
    listed = subprocess.run(
        ["ss", "-tinpHO"], capture_output=True, text=True, check=True
    ).stdout.splitlines()
    own = [line for line in listed if any(f"pid={pid}," in line for pid in node.named("raylet"))]
    return sum(int(found) for line in own for found in re.findall(r"bytes_received:(\d+)", line))


def _peak() -> int:
    """Bytes that this process has held at most."""
    found = re.search(r"VmHWM:\s+(\d+)", Path("/proc/self/status").read_text())
    return 1024 * int(found[1]) if found else 0


PARTS: dict[str, Callable[[argparse.Namespace], Iterator[Row]]] = {
    "nodes": node_rows,
    "large": large_rows,
}


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.scene_nodes")
    parser.add_argument("--only", choices=PARTS, action="append")
    parser.add_argument("--objects", type=int, default=600, help="of Lyon")
    parser.add_argument("--triangles", type=float, nargs="+", default=[1e6, 1e7])
    parser.add_argument("--each", type=int, default=5000, help="triangles of a generated object")
    parser.add_argument("--every", type=int, default=100, help="one occluder of so many is made")
    arguments = parser.parse_args()
    command = "python -m bench.scene_nodes " + " ".join(sys.argv[1:])
    for name in arguments.only or PARTS:
        rows = []
        for row in PARTS[name](arguments):
            print(f"{name}: {told(row)}", flush=True)
            rows.append(row)
        write_table(RESULTS / f"scene_nodes_{name}.csv", rows, command.strip())
    write_page(RESULTS, "scene_nodes", PARTS)


if __name__ == "__main__":
    main()
