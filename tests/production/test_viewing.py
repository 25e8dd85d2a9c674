"""Meshes to files that a browser can show."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import simplifier
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.geometry.views import BoundingSphere
from simplifier.io.gltf_container import open_document
from simplifier.production.viewing import save_scene_for_viewing
from tests.solids import box, sphere

FAR = np.array([5_176_000.25, -3.5, 1_841_000.125])


def test_what_is_written_can_be_read_and_keeps_its_place_far_away(tmp_path: Path) -> None:
    ball = sphere(radius=2.0, rings=12)
    mesh = TriangleMesh.from_soup(ball.vertices + FAR, ball.faces)
    simplifier.save_for_viewing(mesh, tmp_path / "original.glb")
    back = simplifier.load(tmp_path / "original.glb")
    assert len(back.faces) == len(mesh.faces)
    assert np.abs(back.bounds - mesh.bounds).max() < 1e-6


def test_the_file_tells_the_bounding_sphere_of_the_mesh_before_it_was_thinned(
    tmp_path: Path,
) -> None:
    mesh = sphere(rings=80)
    simplifier.save_for_viewing(mesh, tmp_path / "original.glb", most_triangles=1000)
    assert len(simplifier.load(tmp_path / "original.glb").faces) <= 1000
    root = open_document((tmp_path / "original.glb").read_bytes(), "original.glb").root
    told = root.members["nodes"][0]["extras"]["bounding_sphere"]
    asked = BoundingSphere.of(mesh)
    assert told == {"centre": asked.centre.tolist(), "radius": asked.radius}


def test_a_mesh_beyond_32_bits_is_refused(tmp_path: Path) -> None:
    with pytest.raises(simplifier.OutputError):
        simplifier.save_for_viewing(box(extent=(1e39, 1e39, 1e39)), tmp_path / "original.glb")
    assert not list(tmp_path.iterdir())


def test_too_few_triangles_are_refused(tmp_path: Path) -> None:
    with pytest.raises(simplifier.OptionError, match="most_triangles"):
        simplifier.save_for_viewing(box(), tmp_path / "original.glb", most_triangles=10)


@pytest.mark.parametrize(("most", "boxed"), [(300_000, []), (1500, [1]), (1000, [1, 2])])
def test_a_scene_has_its_objects_in_turn_the_largest_as_boxes(
    tmp_path: Path, most: int, boxed: list[int]
) -> None:
    meshes = (box(), sphere(rings=24), sphere(rings=18))
    transforms = np.tile(np.eye(4), (4, 1, 1))
    transforms[:, 0, 3] = [0.0, 5.0, 10.0, 15.0]
    scene = Scene(meshes, tuple("abcd"), np.array([0, 1, 2, 0], dtype=np.int32), transforms)
    counts = save_scene_for_viewing(scene, tmp_path / "scene.glb", most_triangles=most)
    own = scene.triangle_counts
    assert [one for one in range(4) if counts[one] != own[one]] == boxed
    assert counts.sum() <= most
    shown = simplifier.load(tmp_path / "scene.glb")
    for one, faces in enumerate(np.split(shown.faces, np.cumsum(counts)[:-1])):
        points = shown.vertices[faces].reshape(-1, 3)
        found = np.stack([points.min(axis=0), points.max(axis=0)])
        assert np.abs(found - scene.bounds()[one]).max() < 1e-5
