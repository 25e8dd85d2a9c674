"""What occluders hide in a dense city, by several ways to make them: a part of ``bench.scenes``.

The depth buffer that culling uses draws the occluders of all buildings from every camera of a
walk and tests the buildings' boxes; an item buffer of four times its resolution is the truth, as in
``docs/culling.md``.  What all triangles hide is the most that boxes can show, and what they hide
wrongly is what pixels miss.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.inner_boxes import inner_boxes
from bench.peers import meshoptimizer, missing
from bench.record import Row
from simplifier.camera_paths.generate import generate_path
from simplifier.culling.depth_buffer import DepthBuffer
from simplifier.culling.fate import Counts, Fate, fates
from simplifier.culling.item_buffer import ItemBuffer
from simplifier.geometry.camera import Camera
from simplifier.geometry.mesh import FloatArray, IntArray, TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.hierarchy.occluder_tree import leaf_occluders
from simplifier.hierarchy.scene_build import build_occluders
from simplifier.hierarchy.scene_file import load_occluder_tree, occluder_store, write_manifest
from simplifier.options.scene import CullOptions, PathOptions, SceneOptions
from simplifier.options.stages import make_options
from simplifier.progress import Stopwatch
from simplifier.steps.solid import solidify

FRAMES = 40
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
    name: str, scene: Scene, folder: Path, frames: int = FRAMES, **options: object
) -> Iterator[Row]:
    """A row a way to make occluders; ``options`` of the scene's own beside ``up`` and ``ground``.

    ``folder`` is emptied, and holds the scene's own occluders after.
    """
    path = generate_path(scene, PathOptions("street", frames, "z"))
    truths = [truth(scene, camera) for camera in path.cameras]

    def ours(city: Scene) -> Soup:
        return scene_occluders(city, folder, **options)

    makers: Mapping[str, Callable[[Scene], Soup]] = {
        "all triangles": all_triangles,
        f"meshoptimizer, {BUDGET} a building": few_triangles,
        "inner box": largest_inner_boxes,
        "near occluders of the scene": ours,
    }
    for method, make in makers.items():
        row: Row = {"city": name, "method": method}
        if method.startswith("meshoptimizer") and missing("meshoptimizer"):
            yield {**row, "note": f"skipped: {missing('meshoptimizer')}"}
            continue
        begin = time.perf_counter()
        soup = make(scene)
        yield {**row, "made_s": time.perf_counter() - begin, **judged(scene, truths, soup)}


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


def few_triangles(scene: Scene) -> Soup:
    """Each building by quadric edge collapse, as the peer of ``bench.quality`` is called."""

    def few(mesh: TriangleMesh) -> Soup:
        points, faces = meshoptimizer(mesh.vertices, mesh.faces.astype(np.int64), BUDGET)
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


def scene_occluders(scene: Scene, folder: Path, **options: object) -> Soup:
    """The near occluders of all leaves of a build, as ``occluder scene`` makes them."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    chosen = SceneOptions(up="z", ground=True, **options)
    build = build_occluders(scene, chosen, occluder_store(folder), {})
    write_manifest(folder, scene, chosen, build)
    return all_triangles(leaf_occluders(load_occluder_tree(folder)))


def _placed(scene: Scene, soups: Sequence[Soup]) -> Soup:
    """Those of the meshes at the places of all objects, as one."""
    vertices, faces, count = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.int32)], 0
    for mesh, transform in zip(scene.mesh_of, scene.transforms, strict=True):
        points, corners = soups[mesh]
        vertices.append(points @ transform[:3, :3].T + transform[:3, 3])
        faces.append(corners + np.int32(count))
        count += len(points)
    return np.concatenate(vertices), np.concatenate(faces)
