"""Change the input in ways whose effect on the occluder is known, and look for that effect.

Where the arithmetic stays exact the occluder must follow bit by bit.  Elsewhere a rounding error
may move a point across a voxel's face, so precision and recall are compared.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import simplifier
from simplifier.geometry.mesh import TriangleMesh
from tests.solids import box, joined, sphere, table

# So few moves that a price which follows what they find would go its own way each time.
FAST = {"budget": 20, "resolution": 20, "preset": "draft", "moves": 400, "overhang": 1.0}

few = settings(max_examples=8, deadline=None)
seeds = st.integers(0, 2**32 - 1)


def dyadic(seed):
    """A few boxes with corners at multiples of 1/1024: sums and halves of them are exact."""
    generator = np.random.default_rng(seed)
    boxes = [
        box(generator.integers(100, 1500, 3) / 1024.0, generator.integers(-1024, 1024, 3) / 1024.0)
        for _ in range(4)
    ]
    return joined(*boxes)


def changed(mesh, vertices=None, faces=None):
    return TriangleMesh.from_soup(
        mesh.vertices if vertices is None else vertices, mesh.faces if faces is None else faces
    )


def occluder_of(mesh):
    return simplifier.simplify(mesh, **FAST).occluder


def same(one, other):
    """Bit by bit."""
    assert len(one.faces) > 0
    assert np.array_equal(one.faces, other.faces)
    assert np.array_equal(one.vertices, other.vertices)
    assert one.error_bound == other.error_bound


@few
@given(seeds)
def test_order_of_triangles(seed):
    mesh = dyadic(seed)
    order = np.random.default_rng(seed).permutation(len(mesh.faces))
    same(occluder_of(mesh), occluder_of(changed(mesh, faces=mesh.faces[order])))


@few
@given(seeds)
def test_duplicate_triangles(seed):
    mesh = dyadic(seed)
    twice = np.random.default_rng(seed).integers(0, len(mesh.faces), 30)
    faces = np.concatenate([mesh.faces, mesh.faces[twice]])
    same(occluder_of(mesh), occluder_of(changed(mesh, faces=faces)))


@few
@given(seeds)
def test_winding(seed):
    mesh = dyadic(seed)
    faces = mesh.faces.copy()
    flipped = np.random.default_rng(seed).random(len(faces)) < 0.5
    faces[flipped] = faces[flipped][:, ::-1]
    same(occluder_of(mesh), occluder_of(changed(mesh, faces=faces)))


@few
@given(seeds)
def test_first_corner_of_each_triangle(seed):
    mesh = dyadic(seed)
    turn = np.random.default_rng(seed).integers(0, 3, (len(mesh.faces), 1))
    faces = np.take_along_axis(mesh.faces, (np.arange(3) + turn) % 3, axis=1)
    same(occluder_of(mesh), occluder_of(changed(mesh, faces=faces)))


@few
@given(seeds)
def test_order_of_vertices(seed):
    mesh = dyadic(seed)
    order = np.random.default_rng(seed).permutation(len(mesh.vertices))
    place = np.argsort(order)
    same(occluder_of(mesh), occluder_of(changed(mesh, mesh.vertices[order], place[mesh.faces])))


@few
@given(seeds)
def test_vertices_of_their_own_for_each_triangle(seed):
    mesh = dyadic(seed)
    vertices = mesh.vertices[mesh.faces].reshape(-1, 3)
    faces = np.arange(len(vertices)).reshape(-1, 3)
    same(occluder_of(mesh), occluder_of(changed(mesh, vertices, faces)))


@few
@given(seeds, st.integers(-60, 60))
def test_scale_by_a_power_of_two_is_exact(seed, power):
    mesh, scale = dyadic(seed), 2.0**power
    here, there = occluder_of(mesh), occluder_of(changed(mesh, mesh.vertices * scale))
    assert np.array_equal(there.faces, here.faces)
    assert np.array_equal(there.vertices, here.vertices * scale)
    assert there.error_bound == here.error_bound * scale


@few
@given(seeds, st.lists(st.integers(-(2**20), 2**20), min_size=3, max_size=3))
def test_translation_by_whole_numbers(seed, offset):
    # Grid space is the same bit by bit; only the way back to the world rounds.
    mesh = dyadic(seed)
    there = occluder_of(changed(mesh, mesh.vertices + np.array(offset)))
    here = occluder_of(mesh)
    assert np.array_equal(there.faces, here.faces)
    assert there.error_bound == here.error_bound
    assert there.vertices - offset == pytest.approx(here.vertices, abs=1e-9)


def judged(mesh, occluder):
    report = simplifier.evaluate(mesh, occluder, views=48, image=96, exact=True).accuracy
    return report.precision, report.recall


def check_alike(mesh, other):
    """Judged each against its own mesh."""
    precision, recall = judged(mesh, occluder_of(mesh))
    changed_precision, changed_recall = judged(other, occluder_of(other))
    assert changed_recall == pytest.approx(recall, abs=0.06)
    assert changed_precision == pytest.approx(precision, abs=0.02)


SOLIDS = {"boxes": dyadic(5), "sphere": sphere(), "table": table()}


@pytest.mark.sweep(4)
@pytest.mark.parametrize("scale", [1e-6, 1.0 / 3.0, 1e6])
@pytest.mark.parametrize("name", SOLIDS)
def test_any_scale(name, scale):
    mesh = SOLIDS[name]
    other = changed(mesh, mesh.vertices * scale)
    check_alike(mesh, other)
    assert occluder_of(other).error_bound == pytest.approx(
        occluder_of(mesh).error_bound * scale, rel=1e-9
    )


@pytest.mark.sweep(3)
@pytest.mark.parametrize("name", SOLIDS)
def test_a_million_extents_away(name):
    mesh = SOLIDS[name]
    offset = 1e6 * float(mesh.extent.max()) * np.array([1.0, -0.7, 0.3])
    other = changed(mesh, mesh.vertices + offset)
    check_alike(mesh, other)
    assert occluder_of(other).error_bound == pytest.approx(occluder_of(mesh).error_bound, rel=1e-6)


@pytest.mark.sweep(3)
@pytest.mark.parametrize("name", SOLIDS)
def test_quarter_turns_and_mirrors(name):
    # The direction bins do not turn with the mesh, so other sections are found, about as good ones.
    mesh = SOLIDS[name]
    turned = changed(mesh, mesh.vertices[:, [2, 0, 1]])
    mirrored = changed(mesh, mesh.vertices * [-1.0, 1.0, 1.0])
    thorough = {**FAST, "preset": "balanced", "moves": 4000}
    found = [
        judged(one, simplifier.simplify(one, **thorough).occluder)
        for one in (mesh, turned, mirrored)
    ]
    precisions, recalls = np.transpose(found)
    assert np.ptp(recalls) < 0.2
    assert np.ptp(precisions) < 0.02


def test_a_finer_grid_tightens_the_bound():
    bounds = [
        simplifier.simplify(sphere(), **{**FAST, "resolution": resolution}).occluder.error_bound
        for resolution in (8, 16, 32)
    ]
    assert bounds == pytest.approx([4 * bounds[2], 2 * bounds[2], bounds[2]], rel=1e-6)
