"""Times of an occluder and of its accuracy report, and peak memory at 256 voxels a side.

Yields one row a measurement, so that a reader sees figures as they come.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import simplifier
from bench.meshes import STAND_INS, cube, load_stand_in, stand_in_named
from bench.point import Measurement, load_kernels, measure, measure_command
from bench.record import Row

OCCLUDER_TARGETS = {"draft": 0.3, "balanced": 1.0, "best": 5.0}  # seconds from mesh to occluder
ACCURACY_TARGET = 1.5  # seconds for a report of 256 views of a mesh of 100,000 triangles
LIMITS = (0.001, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 3.0)  # seconds asked for
LIMIT_SLACK = 1.1  # of a limit, that a run may take
MEMORY_TARGET = 1024.0  # MiB at 256 voxels a side


def occluder_times(repeats: int) -> Iterator[Row]:
    """Mesh in memory to occluder, kernels warm, all cores, at the budgets of the paper's table."""
    for stand_in in STAND_INS:
        if stand_in.missing:
            yield skipped(stand_in.name, stand_in.missing)
            continue
        for preset, target in OCCLUDER_TARGETS.items():
            point = measure("simplify", stand_in.name, repeats, preset=preset, **stand_in.options)
            yield {
                "mesh": stand_in.name, "triangles": point.triangles, "budget": stand_in.budget,
                "preset": preset, **point.summary, "target_s": target,
                "target": met(point.summary["median_s"] <= target), **stages(point),
            }  # fmt: skip


def accuracy_times(repeats: int) -> Iterator[Row]:
    """The report of 256 views, sampled and exact; the target is for 100,000 triangles."""
    cases: list[tuple[str, str, dict[str, Any]]] = [("bumpy-100000", "", {})]
    cases += [(item.name, item.missing, item.options) for item in STAND_INS]
    for name, missing, options in cases:
        if missing:
            yield skipped(name, missing)
            continue
        for exact in (False, True):
            made = {"preset": "draft", **options}
            point = measure("evaluate", name, repeats, simplify=made, exact=exact)
            yield {
                "mesh": name, "triangles": point.triangles,
                "quads": "all" if exact else "32000 a view", **point.summary,
                **_accuracy_target(name, point),
            }  # fmt: skip


def _accuracy_target(name: str, point: Measurement) -> Row:
    if name != "bumpy-100000":
        return {}
    reached = point.summary["median_s"] <= ACCURACY_TARGET
    return {"target_s": ACCURACY_TARGET, "target": met(reached)}


def limit_times(repeats: int) -> Iterator[Row]:
    """What a time limit takes, and what it gives: mesh in memory to occluder, kernels warm.

    The first limit of each mesh is too short for anything: what it takes is the least time.
    """
    load_kernels()
    for stand_in in STAND_INS:
        if stand_in.missing:
            yield skipped(stand_in.name, stand_in.missing)
            continue
        mesh, least = load_stand_in(stand_in), 0.0
        for limit in LIMITS:
            seconds = []
            for _ in range(repeats):
                begin = time.perf_counter()
                occluder = simplifier.simplify(mesh, time_limit=limit, **stand_in.options).occluder
                seconds.append(time.perf_counter() - begin)
            least = least or max(seconds)
            judged = simplifier.evaluate(mesh, occluder).accuracy
            yield {
                "mesh": stand_in.name, "triangles": len(mesh.faces), "limit_s": limit,
                "median_s": statistics.median(seconds), "min_s": min(seconds),
                "max_s": max(seconds), "allowed_s": max(LIMIT_SLACK * limit, least),
                "limit": met(max(seconds) <= max(LIMIT_SLACK * limit, least)),
                "recall": judged.recall, "precision": judged.precision,
            }  # fmt: skip


def memory_at_256(repeats: int) -> Iterator[Row]:
    """Peak of the whole ``occluder simplify`` process, from file to report, once a mesh.

    The cube fills the grid to its last voxel: nothing holds more of it.
    """
    del repeats  # the peak is the same every time
    dragon = stand_in_named("dragon_871k")
    with tempfile.TemporaryDirectory() as folder:
        solid = Path(folder) / "cube.ply"
        mesh = cube(10_800)
        simplifier.save(simplifier.Occluder(mesh.vertices, mesh.faces), solid)
        for name, path in (("cube-10800", solid), (dragon.name, dragon.path)):
            if not path.exists():
                yield skipped(name, dragon.missing)
                continue
            target = str(Path(folder) / "occluder.glb")
            seconds, mib = measure_command(
                "simplify", str(path), "-o", target, "--resolution", "256"
            )
            yield {
                "mesh": name, "seconds": seconds, "peak_mib": mib, "target_mib": MEMORY_TARGET,
                "target": met(mib <= MEMORY_TARGET),
            }  # fmt: skip


def stages(point: Measurement) -> Row:
    """The median time of each stage, a column each."""
    return {f"{name}_s": seconds for name, seconds in point.stages.items()}


def skipped(name: str, reason: str) -> Row:
    """The row of a mesh that could not be measured."""
    return {"mesh": name, "note": f"skipped: {reason}"}


def met(reached: bool) -> str:
    """How a target fared, in words."""
    return "met" if reached else "not met"
