"""Occluders of nodes: narrow near by, cheaper with a proved error from afar, glued above."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest

from simplifier import evaluate
from simplifier.accuracy.accuracy import AccuracyOptions, evaluate_accuracy
from simplifier.accuracy.deviation import SLACK, deviation
from simplifier.errors import CancelledError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.views import hemisphere_directions, image_axes
from simplifier.hierarchy.node import Stand, is_own_occluder, node_occluder
from simplifier.kernels.coverage import coverage_masks
from simplifier.options.scene import SceneOptions
from simplifier.options.stages import ERROR_VOXELS
from simplifier.selection.measure import directional_measures, hiding_radius
from simplifier.voxel.fill import fill
from simplifier.voxel.voxelize import voxelize
from tests.solids import blob, box, interior_of, joined, sphere, table

OPTIONS = SceneOptions(budget=12, resolution=16, moves=60)
SEEN_BY = AccuracyOptions(views=16, image=64, exact=True)
ANYHOW = Stand()
FINE = sphere(rings=12)


def within(convex, occluder):
    """Whether no corner of an occluder lies before the plane of any face of a convex mesh."""
    a, b, c = convex.vertices[convex.faces].swapaxes(0, 1)
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    before = normals @ occluder.vertices.T - (normals * a).sum(axis=1)[:, None]
    return bool(before.max() <= 1e-12)


def test_few_triangles_are_their_own_near_occluder():
    mesh = table()
    assert not is_own_occluder(mesh, OPTIONS)
    assert is_own_occluder(mesh, replace(OPTIONS, budget=15))
    occluder = node_occluder(mesh, "near", ANYHOW, replace(OPTIONS, budget=15))
    assert occluder.error_bound == 0.0
    np.testing.assert_array_equal(occluder.vertices, mesh.vertices)
    np.testing.assert_array_equal(occluder.faces, mesh.faces)


def test_a_near_occluder_covers_little_beside_its_mesh_and_hides_more_than_one_inside():
    narrow, inside = (
        node_occluder(FINE, "near", ANYHOW, replace(OPTIONS, overhang=share, moves=600))
        for share in (0.02, 0.0)
    )
    assert 0 < len(narrow.faces) <= OPTIONS.budget
    assert narrow.error_bound > 0.0
    judged = [evaluate(FINE, one, views=64, exact=True) for one in (narrow, inside)]
    assert judged[0].overhang.mean <= 0.02
    assert judged[0].precision > 0.99
    assert judged[0].recall > judged[1].recall


def test_without_overhang_a_near_occluder_keeps_inside():
    occluder = node_occluder(FINE, "near", ANYHOW, replace(OPTIONS, overhang=0.0))
    assert occluder.error_bound == 0.0
    assert 0 < len(occluder.faces) <= OPTIONS.budget
    assert within(FINE, occluder)
    assert evaluate_accuracy(FINE, occluder, SEEN_BY).precision == 1.0


@pytest.mark.parametrize("kind", ["far", "inner"])
def test_others_have_an_error_that_is_proved(kind):
    mesh = blob(rings=10)
    occluder = node_occluder(mesh, kind, ANYHOW, OPTIONS)
    assert 0 < len(occluder.faces) <= OPTIONS.budget
    cell = mesh.extent.max() / OPTIONS.resolution
    assert 0.0 < occluder.error_bound <= ERROR_VOXELS * cell
    touched = voxelize(mesh, 4 * OPTIONS.resolution)
    strays = deviation(occluder, mesh, interior_of(touched, fill(touched)))
    # A finer grid encloses less or as much, within one of its voxels.
    assert strays + SLACK * touched.cell_size <= occluder.error_bound + 2.0 * touched.cell_size


@pytest.mark.parametrize("kind", ["near", "far", "inner"])
def test_conservative_ones_hide_nothing_wrongly(kind):
    occluder = node_occluder(FINE, kind, ANYHOW, replace(OPTIONS, conservative=True))
    assert occluder.error_bound == 0.0
    assert len(occluder.faces) > 0
    assert within(FINE, occluder)
    assert evaluate_accuracy(FINE, occluder, SEEN_BY).precision == 1.0


def specks(count=300):
    """Leaves of a tree: triangles far apart, each much smaller than a voxel."""
    generator = np.random.default_rng(0)
    points = (
        generator.uniform(0.0, 10.0, (count, 1, 3)) + generator.normal(size=(count, 3, 3)) * 0.01
    )
    return TriangleMesh.from_soup(points.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


def needle():
    return box((10.0, 0.02, 0.02))


@pytest.mark.parametrize("mesh", [specks(), needle()], ids=["specks", "needle"])
@pytest.mark.parametrize("kind", ["near", "far"])
def test_what_hides_next_to_nothing_has_none(mesh, kind):
    """A far one of a needle may be as thick as its voxels, which is its error."""
    occluder = node_occluder(mesh, kind, ANYHOW, replace(OPTIONS, conservative=kind == "far"))
    assert len(occluder.faces) == 0 == len(occluder.vertices)
    assert occluder.error_bound >= 0.0


def test_neighbours_half_a_voxel_apart_become_one_solid():
    cell = 1.0 / 16
    pair = joined(
        box((0.5, 0.5, 0.5)), box((0.5 - 0.5 * cell, 0.5, 0.5), (0.5 + 0.5 * cell, 0.0, 0.0))
    )
    options = replace(OPTIONS, moves=2000)
    occluder = node_occluder(pair, "inner", ANYHOW, options)
    corners = occluder.vertices[occluder.faces][..., 0]
    across = (corners.min(axis=1) < 0.45) & (corners.max(axis=1) > 0.55)
    assert across.any()  # a triangle spans the gap
    touched = voxelize(pair, 16)
    assert deviation(occluder, pair, interior_of(touched, fill(touched))) <= occluder.error_bound


def test_ground_closes_an_open_base():
    bell = box((1.0, 1.0, 1.0), without=(2,))
    options = replace(OPTIONS, conservative=True, resolution=48)
    open_one = node_occluder(bell, "far", ANYHOW, options)
    own = bell.vertices.tolist()
    assert all(corner in own for corner in open_one.vertices.tolist())  # nothing is inside of it
    for stand in (Stand(ground="y"), Stand(smallest_hole=5.0)):  # a hole longer than the mesh, too
        found = node_occluder(bell, "far", stand, options).vertices.tolist()
        assert found
        assert not any(corner in own for corner in found)


def test_cancelled_while_refining_nothing_is_given():
    """The best so far would be kept under the key of what the whole search finds."""
    cancel = threading.Event()
    timer = threading.Timer(0.3, cancel.set)
    timer.start()
    with pytest.raises(CancelledError):
        node_occluder(FINE, "far", ANYHOW, replace(OPTIONS, moves=50_000_000), cancel)
    timer.cancel()


def occluder_of(mesh):
    return Occluder(mesh.vertices, mesh.faces, 0.0)


def exact_radius(mesh, directions=200, size=256):
    """By the distance transform of large pictures, from many directions."""
    axes = image_axes(hemisphere_directions(directions))[:, :2]
    reach = 1.05 * np.abs(mesh.vertices).max() * np.sqrt(3.0)
    linear = axes * (size / 2.0 / reach)
    projections = np.concatenate([linear, np.full((directions, 2, 1), size / 2.0)], axis=2)
    words = coverage_masks(mesh.vertices, mesh.faces, np.ascontiguousarray(projections), size, size)
    bits = np.unpackbits(words.view(np.uint8), axis=-1, bitorder="little")[..., :size]
    measures = directional_measures(bits.astype(np.bool_), 2.0 * reach / size)
    return np.cbrt(3.0 * measures.mean() / np.pi)


def disc(radius=1.0, corners=64):
    angle = 2.0 * np.pi * np.arange(corners) / corners
    points = np.column_stack([np.cos(angle), np.zeros(corners), np.sin(angle)]) * radius
    return TriangleMesh.from_soup(points, [[0, i, i + 1] for i in range(1, corners - 1)])


def test_a_ball_hides_as_its_own_disc():
    assert hiding_radius(occluder_of(sphere(2.5, rings=24))) == pytest.approx(2.5, rel=0.03)


@pytest.mark.parametrize(
    ("mesh", "share"),
    # What is flat looks otherwise from each of the few directions.
    [(disc(), 0.05), (box(low=(-0.5, -0.5, -0.5)), 0.03), (blob(rings=8), 0.03)],
    ids=["disc", "box", "blob"],
)
def test_the_mean_over_all_directions(mesh, share):
    assert hiding_radius(occluder_of(mesh)) == pytest.approx(exact_radius(mesh), rel=share)


def test_a_square_and_a_disc_from_the_front():
    """pi R^3 / 3 = a^3 / 6 where they face all directions alike, so their ratio is known."""
    square = TriangleMesh.from_soup(
        [[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], [[0, 1, 2], [0, 2, 3]]
    )
    ratio = hiding_radius(occluder_of(square)) / hiding_radius(occluder_of(disc()))
    assert ratio == pytest.approx(2.0 / np.cbrt(2.0 * np.pi), rel=0.04)


@pytest.mark.parametrize("scale", [1e-30, 1e-3, 1e3, 1e30])
def test_the_radius_grows_with_the_occluder(scale):
    mesh = blob(rings=8)
    scaled = Occluder(mesh.vertices * scale, mesh.faces)
    assert hiding_radius(scaled) / scale == pytest.approx(
        hiding_radius(occluder_of(mesh)), rel=0.01
    )


def test_the_radius_stays_where_the_occluder_goes():
    mesh = blob(rings=8)
    there = Occluder(mesh.vertices + np.array([5.2e6, 0.0, -1.4e6]), mesh.faces)
    assert hiding_radius(there) == pytest.approx(hiding_radius(occluder_of(mesh)), rel=0.01)


def test_the_radius_is_the_same_far_from_the_origin():
    """Where a picture had no digits left, it was divided by nothing."""
    mesh = blob(rings=8)
    vertices = np.round(mesh.vertices * 2.0**8) / 2.0**8
    there = Occluder(vertices + 2.0**44, mesh.faces)
    assert hiding_radius(there) == hiding_radius(Occluder(vertices, mesh.faces)) > 0.0


def test_nothing_has_no_radius():
    assert hiding_radius(Occluder(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32))) == 0.0


def test_an_open_mesh_of_many_triangles_lends_its_largest():
    """Nothing keeps inside of two walls and their ornaments, which are all they hide with."""
    walls = np.array([
        [[0, 0, 0], [8, 0, 0], [8, 4, 0]], [[0, 0, 0], [8, 4, 0], [0, 4, 0]],
        [[0, 0, 0], [0, 0, 8], [0, 4, 8]], [[0, 0, 0], [0, 4, 8], [0, 4, 0]],
    ], dtype=np.float64)  # fmt: skip
    generator = np.random.default_rng(1)
    bits = generator.uniform(0.0, 4.0, (200, 1, 3)) + generator.uniform(0.0, 0.1, (200, 3, 3))
    corners = np.concatenate([bits[:100], walls, bits[100:]])
    mesh = TriangleMesh.from_soup(corners.reshape(-1, 3), np.arange(612).reshape(-1, 3))
    occluder = node_occluder(mesh, "near", ANYHOW, OPTIONS)
    assert occluder.error_bound == 0.0
    assert len(occluder.faces) == 4 * OPTIONS.budget
    made = {tuple(sorted(map(tuple, one))) for one in occluder.vertices[occluder.faces].tolist()}
    own = {tuple(sorted(map(tuple, one))) for one in corners.tolist()}
    assert made <= own
    assert {tuple(sorted(map(tuple, one))) for one in walls.tolist()} <= made
