"""What occluders hide in a dense city, by several ways to make them: a part of ``bench.scenes``.

The depth buffer that culling uses draws the occluders of all buildings from every camera of a
walk and tests the buildings' boxes; an item buffer of four times its resolution is the truth, as in
``docs/culling.md``.  What all triangles hide is the most that boxes can show, and what they hide
wrongly is what pixels miss.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.inner_boxes import inner_boxes
from bench.peers import meshoptimizer, missing
from bench.record import Row
from simplifier.culling.depth_buffer import DepthBuffer
from simplifier.culling.fate import Counts, Fate, fates
from simplifier.culling.item_buffer import ItemBuffer
from simplifier.geometry.camera import Camera, CameraPath
from simplifier.geometry.mesh import FloatArray, IntArray, TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.hierarchy.node import node_occluder
from simplifier.hierarchy.node_plan import plan_occluders
from simplifier.hierarchy.parts import split_large
from simplifier.hierarchy.tree import build_tree
from simplifier.kernels.threads import run_chunks
from simplifier.options.scene import CullOptions, SceneOptions
from simplifier.options.stages import make_options
from simplifier.progress import Stopwatch
from simplifier.steps.solid import solidify

BUDGET = 32  # triangles of a building
RESOLUTION = 64  # voxels along the longest edge of a building that inner boxes are made of

Soup = tuple[FloatArray, IntArray]
"""Vertices (n, 3), world units, and faces (m, 3) of all buildings' occluders."""


@dataclass(frozen=True, eq=False)
class Truth:
    """Of a frame: pixels that each object covers alone, and those that it is the nearest in."""

    camera: Camera
    fragments: np.ndarray
    visible: np.ndarray


def dense_rows(
    scene: Scene, path: CameraPath, budget: int = BUDGET, **options: object
) -> Iterator[Row]:
    """A row a way to make occluders; ``options`` of the scene beside its budget and its ground."""
    truths = [truth(scene, camera) for camera in path.cameras]
    ours = SceneOptions(budget=budget, up="z", ground=True, **options)
    makers: Mapping[str, Callable[[Scene], Soup]] = {
        "all triangles": all_triangles,
        "inner box": largest_inner_boxes,
        "meshoptimizer": lambda city: few_triangles(city, budget),
        "near occluders": lambda city: near_occluders(city, ours),
        "near occluders, --overhang 0": lambda city: near_occluders(
            city, replace(ours, overhang=0.0)
        ),
    }
    for method, make in makers.items():
        if method == "meshoptimizer" and missing(method):
            yield {"method": method, "note": f"skipped: {missing(method)}"}
            continue
        begin = time.perf_counter()
        soup = make(scene)
        yield {"method": method, "made_s": time.perf_counter() - begin} | judged(
            scene, truths, soup
        )


def truth(scene: Scene, camera: Camera) -> Truth:
    """What an item buffer as that of ``occluder cull`` says."""
    chosen = CullOptions()
    buffer = ItemBuffer(chosen.rows * chosen.detail, chosen.columns * chosen.detail)
    buffer.draw(scene, camera)
    return Truth(camera, buffer.fragments, buffer.visible)


def judged(scene: Scene, truths: Sequence[Truth], soup: Soup) -> Row:
    """The sums over all frames, and the median time of drawing and testing in one."""
    chosen, boxes = CullOptions(), scene.bounds()
    buffer = DepthBuffer(chosen.rows, chosen.columns)
    found, wrong, covered, milliseconds = [], 0, 0, []
    for one in truths:
        begin = time.perf_counter()
        buffer.clear()
        buffer.draw_mesh(*soup, one.camera)
        verdicts = buffer.test(boxes, one.camera)
        milliseconds.append(1e3 * (time.perf_counter() - begin))
        fate = fates(verdicts, one.fragments, one.visible)
        found.append(Counts.of(fate))
        wrong += int(one.visible[fate == Fate.WRONG].sum())
        covered += int(one.visible.sum())
    total = Counts.total(found)
    return {
        "triangles": len(soup[1]), "hidden": total.hidden, "recall": total.recall,
        "wrong_pixels": wrong, "wrong_share": wrong / max(covered, 1),
        "wrong_objects": total.wrong, "ms": float(np.median(milliseconds)),
    }  # fmt: skip


def all_triangles(scene: Scene) -> Soup:
    """The scene itself."""
    return _placed(scene, [(mesh.vertices, mesh.faces) for mesh in scene.meshes])


def few_triangles(scene: Scene, budget: int) -> Soup:
    """Each building by quadric edge collapse, as the peer of ``bench.quality`` is called."""

    def few(mesh: TriangleMesh) -> Soup:
        points, faces = meshoptimizer(mesh.vertices, mesh.faces.astype(np.int64), budget)
        used, corners = np.unique(faces, return_inverse=True)
        return points[used], corners.reshape(-1, 3).astype(np.int32)

    return _placed(scene, [few(mesh) for mesh in scene.meshes])


def largest_inner_boxes(scene: Scene) -> Soup:
    """The largest box of voxels wholly inside each building, whose base is closed for it."""

    def box(mesh: TriangleMesh) -> Soup:
        options = make_options(
            float(mesh.extent.max()), resolution=RESOLUTION, up="z", ground=True, conservative=True
        )
        points, faces = inner_boxes(solidify(mesh, options.solid, Stopwatch()).core, 1)
        return points, faces.astype(np.int32)

    return _placed(scene, [box(mesh) for mesh in scene.meshes])


def near_occluders(scene: Scene, options: SceneOptions) -> Soup:
    """Of all leaves, as ``occluder scene`` makes them, which makes those of all other nodes too."""
    parts = split_large(scene)
    plan = plan_occluders(parts, build_tree(parts.bounds, options.width), options)
    jobs = [job for job in plan.jobs.values() if job.kind == "near"]
    meshes = parts.scene.mesh_of
    soups: list[Soup] = [(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32))] * len(meshes)

    def make(begin: int, end: int) -> None:
        for job in jobs[begin:end]:
            mesh = int(meshes[job.parts[0]])
            made = node_occluder(parts.scene.meshes[mesh], "near", job.stand, options)
            soups[mesh] = made.vertices, made.faces

    run_chunks(make, len(jobs))
    return _placed(parts.scene, soups)


def _placed(scene: Scene, soups: Sequence[Soup]) -> Soup:
    """Those of the meshes at the places of all objects, as one."""
    vertices, faces, count = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.int32)], 0
    for mesh, transform in zip(scene.mesh_of, scene.transforms, strict=True):
        points, corners = soups[mesh]
        vertices.append(points @ transform[:3, :3].T + transform[:3, 3])
        faces.append(corners + np.int32(count))
        count += len(points)
    return np.concatenate(vertices), np.concatenate(faces)
