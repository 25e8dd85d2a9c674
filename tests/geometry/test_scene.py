"""Scenes: boxes of many instances against the plain way, and objects joined to one soup."""

from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene, scales
from tests.solids import blob, box, sphere


def plain_bounds(scene):
    """Every vertex of every object, one after the other."""
    boxes = []
    for mesh, transform in zip(scene.mesh_of, scene.transforms, strict=True):
        points = scene.meshes[mesh].vertices @ transform[:3, :3].T + transform[:3, 3]
        boxes.append([points.min(axis=0), points.max(axis=0)])
    return np.array(boxes)


def scene_of(meshes, mesh_of, transforms):
    names = tuple(f"object {i}" for i in range(len(mesh_of)))
    return Scene(tuple(meshes), names, np.asarray(mesh_of, dtype=np.int32), np.asarray(transforms))


def placed(generator, count, far=100.0):
    """Any affine transforms, about half of them mirroring."""
    transforms = np.tile(np.eye(4), (count, 1, 1))
    transforms[:, :3, :3] = generator.normal(size=(count, 3, 3))
    transforms[:, :3, 3] = generator.uniform(-far, far, (count, 3))
    return transforms


def sheet():
    """100 points of a plane: Qhull has no hull for them."""
    x, y = (part.ravel() for part in np.meshgrid(np.arange(10.0), np.arange(10.0)))
    faces = [[i, i + 1, i + 10] for i in range(89) if i % 10 < 9]
    return TriangleMesh.from_soup(np.stack([x, y, 0.5 * x - 0.25 * y + 3.0], axis=1), faces)


MESHES = (box(), sphere(rings=6), blob(rings=8), sheet())


@settings(max_examples=30)
@given(
    st.integers(0, 2**32 - 1),
    st.lists(st.sampled_from(range(len(MESHES))), min_size=1, max_size=3),
    st.sampled_from([1, 3, 63, 64, 200]),
    st.sampled_from([0.0, 5_176_000.0]),
    st.sampled_from([0, 10**9]),
)
def test_bounds_are_those_of_all_vertices(seed, kinds, count, offset, many):
    """On both sides of the number of instances and vertices from which a hull is taken."""
    generator = np.random.default_rng(seed)
    meshes = [
        TriangleMesh.from_soup(MESHES[kind].vertices + offset, MESHES[kind].faces) for kind in kinds
    ]
    scene = scene_of(meshes, generator.integers(0, len(meshes), count), placed(generator, count))
    expected = plain_bounds(scene)
    tolerance = 1e-14 * max(1.0, np.abs(expected).max(), offset)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("simplifier.geometry.scene._MANY_POINTS", many)
        bounds = scene.bounds()
    np.testing.assert_allclose(bounds, expected, rtol=0.0, atol=4.0 * tolerance)


@pytest.mark.parametrize("scale", [1e-120, 1e-6, 1e90])
def test_bounds_of_tiny_and_huge_meshes(scale):
    mesh = blob(rings=8)
    mesh = TriangleMesh.from_soup(mesh.vertices * scale, mesh.faces)
    scene = scene_of([mesh], np.zeros(70), placed(np.random.default_rng(1), 70, far=0.0))
    np.testing.assert_allclose(scene.bounds() / scale, plain_bounds(scene) / scale, atol=1e-13)


def test_bounds_are_the_callers_own():
    scene = Scene.of(box())
    scene.bounds()[:] = 7.0
    assert scene.bounds().tolist() == [[[0.0] * 3, [1.0] * 3]]


def test_bounds_when_a_mesh_is_not_used_or_no_object_is_left():
    transforms = placed(np.random.default_rng(2), 2)
    scene = scene_of(MESHES, [3, 1], transforms)
    np.testing.assert_allclose(scene.bounds(), plain_bounds(scene), atol=1e-12)
    assert scene_of(MESHES, [], transforms[:0]).bounds().shape == (0, 2, 3)


def test_bounds_of_a_hundred_thousand_instances_take_a_moment():
    """It was a minute by all vertices; the limit is ten times what it takes now."""
    generator = np.random.default_rng(3)
    scene = scene_of([sphere(rings=16)], np.zeros(100_000), placed(generator, 100_000))
    begin = time.process_time()
    boxes = scene.bounds()
    assert time.process_time() - begin < 3.0
    some = generator.integers(0, 100_000, 20)
    picked = scene_of(scene.meshes, np.zeros(20), scene.transforms[some])
    np.testing.assert_allclose(boxes[some], plain_bounds(picked), atol=1e-12)


def test_joined_keeps_order_and_places_every_triangle():
    generator = np.random.default_rng(4)
    scene = scene_of([box(), sphere(rings=4)], [0, 1, 0], placed(generator, 3))
    mesh = scene.joined([2, 1])
    own = scene.meshes[0].vertices[scene.meshes[0].faces]
    expected = own @ scene.transforms[2, :3, :3].T + scene.transforms[2, :3, 3]
    np.testing.assert_allclose(mesh.vertices[mesh.faces][:12], expected, atol=1e-12)
    assert len(mesh.faces) == scene.triangle_counts[[2, 1]].sum()
    np.testing.assert_allclose(
        mesh.bounds,
        [scene.bounds()[[1, 2], 0].min(axis=0), scene.bounds()[[1, 2], 1].max(axis=0)],
        atol=1e-12,
    )


def test_counts_and_length():
    scene = scene_of([box(), box(without=(0,))], [1, 0, 1], np.tile(np.eye(4), (3, 1, 1)))
    assert len(scene) == 3
    assert scene.triangle_counts.tolist() == [10, 12, 10]


def test_scales_are_the_largest_stretch():
    transforms = np.tile(np.eye(4), (3, 1, 1))
    transforms[1, :3, :3] = np.diag([-3.0, 2.0, 1.0])
    transforms[2, :3, :3] = [[0.0, 0.0, 0.5], [0.5, 0.0, 0.0], [0.0, 0.25, 0.0]]
    assert scales(transforms).tolist() == pytest.approx([1.0, 3.0, 0.5])


def test_arrays_are_read_only():
    scene = scene_of([box()], [0], np.eye(4)[None])
    with pytest.raises(ValueError):
        scene.transforms[0, 0, 3] = 1.0
    with pytest.raises(ValueError):
        scene.mesh_of[0] = 1
