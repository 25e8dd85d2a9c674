"""Directions of large flat parts."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import simplifier
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.solid import VoxelGrid
from simplifier.options.stages import SectionOptions
from simplifier.slicing.flats import directions_of_half, flat_directions
from simplifier.slicing.planes import plan_sections
from tests.solids import box, hills, sphere, turned


def plain_directions(mesh):
    """As told of the function, pair by pair: whole normals, no bins."""
    corners = mesh.vertices[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    units = normals / areas[:, None]
    near = np.abs(units @ units.T) > np.cos(np.radians(2.0))
    shares = near @ areas / areas.sum()
    found = list(np.eye(3))
    for index in np.argsort(-shares):
        apart = np.abs(np.array(found) @ units[index]).max() < np.cos(np.radians(5.0))
        if shares[index] >= 0.03 and apart and len(found) < 11:
            found.append(units[index])
    return np.array(found[3:]).reshape(-1, 3)


def unlike(found, expected):
    """Degrees from each of the expected to the nearest found."""
    return np.degrees(np.arccos(np.minimum(np.abs(expected @ found.T).max(axis=1), 1.0)))


@given(st.integers(0, 10_000))
def test_a_turned_box_has_the_directions_of_its_sides(seed):
    rotation = Rotation.random(rng=np.random.default_rng(seed))
    mesh = turned(box((4.0, 3.0, 2.0)), rotation.as_matrix())
    found, expected = flat_directions(mesh), plain_directions(mesh)
    assert len(found) == len(expected)
    if len(found):
        assert unlike(found, expected).max() < 1e-4
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0, rtol=1e-12)


def test_what_stands_straight_and_what_is_round_have_none():
    assert len(flat_directions(box((4.0, 3.0, 2.0)))) == 0
    assert len(flat_directions(sphere())) == 0


@pytest.mark.parametrize("normal", [(1, 1, 1), (1, -1, 0), (1, 0, 0.3), (0.5, 0.5, 0.0)])
def test_a_rough_part_is_one_wherever_the_seams_of_bins_run(normal):
    generator = np.random.default_rng(3)
    normal = np.array(normal) / np.linalg.norm(normal)
    steady = np.linalg.svd(normal[None])[2][1:]
    corners = generator.uniform(-5.0, 5.0, (2000, 1, 2)) + generator.normal(0.0, 0.1, (2000, 3, 2))
    soup = corners @ steady + generator.normal(0.0, 4e-4, (2000, 3, 1)) * normal
    mesh = TriangleMesh.from_soup(soup.reshape(-1, 3), np.arange(6000).reshape(-1, 3))
    (found,) = flat_directions(mesh)
    assert np.degrees(np.arccos(min(abs(found @ normal), 1.0))) < 0.3


@pytest.mark.parametrize(
    ("mesh", "least", "most"),
    [(box(), 2, 2), (box((4.0, 1.0, 1.0)), 2, 2), (box((9.0, 9.0, 1.0)), 1, 1), (hills(9), 2, 128),
     (sphere(rings=40), 200, 2000)],
)  # fmt: skip
def test_half_of_what_is_flat_faces_few_directions(mesh, least, most):
    assert least <= directions_of_half(mesh) <= most


def test_there_are_eight_at_most_the_largest_first():
    angles = 2.0 * np.pi * (np.arange(32) + 0.3) / 32.0
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1) * [1.2, 1.0]
    low, high = (np.column_stack([ring, np.full(32, z)]) for z in (0.0, 2.0))
    side = np.arange(32)
    other = (side + 1) % 32
    faces = [np.stack([side, other, 32 + side], 1), np.stack([other, 32 + other, 32 + side], 1)]
    mesh = TriangleMesh.from_soup(np.concatenate([low, high]), np.concatenate(faces))
    found = flat_directions(mesh)
    assert len(found) == 8
    normals = np.cross(*(np.diff(mesh.vertices[mesh.faces], axis=1).transpose(1, 0, 2)))
    areas = np.linalg.norm(normals, axis=1)
    near = np.abs(normals @ found.T) > np.cos(np.radians(2.0)) * areas[:, None]
    shares = (areas[:, None] * near).sum(axis=0)
    assert (np.diff(shares) <= 1e-9 * shares[0]).all()


def test_order_scale_and_threads_do_not_matter(monkeypatch):
    rotation = Rotation.from_euler("xyz", (20, 33, 41), degrees=True)
    mesh = turned(box((4.0, 3.0, 2.0)), rotation.as_matrix())
    expected = flat_directions(mesh)
    assert len(expected) == 3
    order = np.random.default_rng(0).permutation(len(mesh.faces))
    for other in (
        TriangleMesh.from_soup(mesh.vertices, mesh.faces[order][:, [1, 2, 0]]),
        TriangleMesh.from_soup(8.0 * mesh.vertices, mesh.faces[:, ::-1]),
    ):
        assert np.array_equal(flat_directions(other), expected)
    monkeypatch.setenv("OCCLUDER_THREADS", "1")
    assert np.array_equal(flat_directions(mesh), expected)


@pytest.mark.parametrize("scale", [1e-75, 1e-70, 1e70, 1e77])
def test_scales_at_the_ends_of_floats_change_nothing(scale):
    """Squares of areas of 1e77 overflowed, found by a mesh made at random."""
    rotation = Rotation.random(rng=np.random.default_rng(3))
    mesh = turned(box((1.0, 2.0, 3.0)), rotation.as_matrix())
    far = TriangleMesh.from_soup(mesh.vertices * scale, mesh.faces)
    assert np.allclose(flat_directions(far), flat_directions(mesh), atol=1e-6)


def test_sections_are_cut_along_them():
    flats = np.array([[0.6, 0.8, 0.0], [0.0, 0.6, 0.8]])
    grid = VoxelGrid(np.ones((9, 9, 9), dtype=np.bool_), np.zeros(3), 1.0)
    plain, plan = (plan_sections(grid, SectionOptions(directions=4), d) for d in (flats[:0], flats))
    assert len(plan.frames) == len(plain.frames) + 2
    assert plan.bins == plain.bins + 2 * SectionOptions().depths
    for frame, direction in zip(plan.frames[3:5], flats, strict=True):
        np.testing.assert_allclose(frame.axes[2], direction, atol=1e-15)
    assert set(plan.frame_of) == set(range(len(plan.frames)))


def test_a_slab_that_leans_is_covered_by_two_triangles():
    """Even directions are fifteen degrees from its own: a section across it is a strip."""
    rotation = Rotation.from_euler("z", 17.0, degrees=True)
    slab = turned(box((1.0, 20.0, 30.0)), rotation.as_matrix())
    made = simplifier.simplify(slab, budget=2, preset="draft", moves=0, overhang=1.0)
    assert simplifier.evaluate(slab, made.occluder).recall > 0.8
