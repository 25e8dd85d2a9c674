"""Large objects in pieces: nothing lost, nothing doubled, no piece longer than its share."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.mesh import TriangleMesh
from simplifier.hierarchy.parts import LEAST, SHARE, split_large
from tests.hierarchy.scenes import fine_box, moved, scene_of, street, turned
from tests.solids import box, sphere


def corners(mesh):
    return mesh.vertices[mesh.faces]


def triples(soup):
    """(m, 9) triangles in one order."""
    rows = soup.reshape(len(soup), 9)
    return rows[np.lexsort(rows.T)]


def soup(generator, count, longest):
    points = generator.uniform(-50.0, 50.0, (count, 1, 3))
    spread = generator.normal(size=(count, 3, 3)) * generator.uniform(0.01, longest)
    triangles = (points + spread).reshape(-1, 3)
    return TriangleMesh.from_soup(triangles, np.arange(3 * count).reshape(-1, 3))


@settings(max_examples=30)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 400),
    st.sampled_from([1, 8, 64]),
    st.sampled_from([2, 16]),
    st.sampled_from([0.5, 60.0]),
)
def test_every_triangle_is_in_one_piece(seed, count, least, share, longest):
    generator = np.random.default_rng(seed)
    meshes = [soup(generator, count, longest), box()]
    linear = turned("y", 30.0) * 3.0
    scene = scene_of(meshes, [0, 1, 0], [moved(), moved(5.0), moved(7.0, linear=linear)])
    parts = split_large(scene, share, least)
    made = parts.scene
    low, high = scene.bounds()[:, 0].min(axis=0), scene.bounds()[:, 1].max(axis=0)
    limit = (high - low).max() / share
    for index in range(3):
        pieces = [made.meshes[mesh] for mesh in made.mesh_of[parts.object_of == index]]
        np.testing.assert_array_equal(
            triples(np.concatenate([corners(piece) for piece in pieces])),
            triples(corners(scene.meshes[scene.mesh_of[index]])),
        )
        assert (made.transforms[parts.object_of == index] == scene.transforms[index]).all()
    np.testing.assert_array_equal(parts.bounds, made.bounds())
    for piece in made.meshes[:-1]:
        # The larger instance is three times as large.
        assert len(piece.faces) <= least or 3.0 * piece.extent.max() <= limit * (1.0 + 1e-9)


def test_instances_stay_instances_and_names_are_unique():
    mesh = fine_box((60.0, 3.0, 3.0), cuts=8)
    scene = scene_of(
        [mesh, box()], [0, 1, 0], [moved(), moved(1.0), moved(0.0, 20.0)], ["a", "a/0", "b"]
    )
    parts = split_large(scene)
    counts = np.bincount(parts.object_of)
    assert counts[0] == counts[2] > 1 == counts[1]
    first, last = (parts.scene.mesh_of[parts.object_of == index] for index in (0, 2))
    np.testing.assert_array_equal(first, last)
    assert (np.diff(parts.object_of) >= 0).all()
    assert len(set(parts.scene.names)) == len(parts.scene.names) == len(parts.object_of)
    owners = [name.rpartition("/")[0] for name in parts.scene.names]
    assert owners == [scene.names[index] for index in parts.object_of]


def test_nothing_is_cut_in_a_scene_of_small_objects():
    scene = street(80)
    parts = split_large(scene)
    assert parts.scene.meshes == scene.meshes
    np.testing.assert_array_equal(parts.object_of, np.arange(80))
    np.testing.assert_array_equal(parts.scene.mesh_of, scene.mesh_of)


def test_a_huge_pair_of_triangles_stays_whole():
    ground = TriangleMesh.from_soup(
        [[0, 0, 0], [1e4, 0, 0], [1e4, 0, 1e4], [0, 0, 1e4]], [[0, 1, 2], [0, 2, 3]]
    )
    parts = split_large(scene_of([ground, box()], [0, 1], [moved(), moved()]))
    assert parts.scene.meshes[0] is ground


def test_triangles_with_one_centre_are_cut_by_number():
    size = np.linspace(10.0, 20.0, 3 * LEAST)[:, None, None]
    spokes = size * np.array([[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [0.0, 0.0, 2.0]])
    mesh = TriangleMesh.from_soup(spokes.reshape(-1, 3), np.arange(9 * LEAST).reshape(-1, 3))
    pieces = split_large(scene_of([mesh], [0], [moved()])).scene.meshes
    assert len(pieces) == 4
    assert max(len(piece.faces) for piece in pieces) <= LEAST


def test_a_level_of_one_mesh_is_cut_and_meshes_that_nothing_uses_are_not():
    level, unused = sphere(rings=40), sphere(rings=20)
    parts = split_large(scene_of([level, unused], [0], [moved(linear=np.diag([1.0, 1.0, -1.0]))]))
    assert len(parts.object_of) > SHARE
    assert parts.scene.meshes[-1] is unused


@pytest.mark.parametrize("scale", [1e-30, 1e30])
def test_scale_does_not_matter(scale):
    mesh = sphere(rings=20)
    scaled = TriangleMesh.from_soup(mesh.vertices * scale, mesh.faces)
    counts = [len(split_large(scene_of([one], [0], [moved()])).object_of) for one in (mesh, scaled)]
    assert counts[0] == counts[1] > 1
