"""A scene, built and culled: everything that can be seen is told to be so."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np

from simplifier import simplify_scene
from simplifier.culling.culler import Culler
from simplifier.culling.depth_buffer import DepthBuffer, Verdict
from simplifier.geometry.camera import Camera
from simplifier.hierarchy.scene_file import load_occluder_tree
from simplifier.io.objects import Objects
from simplifier.io.scene import usable_scene
from simplifier.io.scene_writer import write_scene
from tests.fuzz.cases import Case, mesh_of
from tests.fuzz.promises import check_sentence, promise
from tests.fuzz.promises.mesh_files import check_scene
from tests.fuzz.promises.scene_folders import check_tree


def check_built_scene(case: Case, folder: Path) -> None:
    """Raises ``OccluderError`` for what is refused.

    The builder's processes are this one where ``OCCLUDER_THREADS`` is 1.
    """
    meshes = [mesh_of(soup) for soup in case["meshes"]]
    mesh_of_object = np.array(case["mesh_of"], dtype=np.int64)
    objects = Objects(
        [f"object {index}" for index in range(len(mesh_of_object))],
        [(mesh.vertices, mesh.faces.astype(np.int64)) for mesh in meshes],
        mesh_of_object,
        np.array(case["transforms"], dtype=np.float64).reshape(-1, 4, 4),
        [0] * len(meshes),
        np.zeros(len(mesh_of_object), dtype=np.bool_),
    )
    scene = usable_scene(objects, "case")
    check_scene(scene)
    place = folder / "built"
    tree = simplify_scene(scene, place, **case["options"])
    check_tree(tree)
    again = load_occluder_tree(place)
    promise(np.array_equal(again.tree.bounds, tree.tree.bounds), "a tree comes back as it was")
    for warning in scene.warnings:
        check_sentence(warning)
    for camera in map(_camera, case["cameras"]):
        one = Culler(tree, DepthBuffer(18, 32, "inner")).cull(camera).verdicts
        other = Culler(again, DepthBuffer(18, 32, "inner")).cull(camera).verdicts
        promise(np.array_equal(one, other), "a tree culls as it did when it was built")
        promise(set(one.tolist()) <= set(Verdict), "a verdict is one of three")
    write_scene(scene, folder / "scene.glb")
    shutil.rmtree(place)


def _camera(given: Case) -> Camera:
    up = np.array([0.0, 1.0, 0.0])
    return Camera.looking(
        np.array(given["position"]), np.array(given["forward"]), up, given["fov"], given["near"]
    )
