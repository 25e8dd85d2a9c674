"""Precision and recall: closed forms, symmetries, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from simplifier.accuracy import silhouette_views
from simplifier.accuracy.accuracy import (
    AccuracyOptions,
    evaluate_accuracies,
    evaluate_accuracy,
    view_masks,
)
from simplifier.errors import MeshError, OptionError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from tests.solids import blob

SMALL = AccuracyOptions(views=24, image=64, quads=2000)
FRONT = np.array([[0.0, 0.0, 1.0]])


def box(low=(-1.0, -1.0, -1.0), high=(1.0, 1.0, 1.0)):
    shape = trimesh.creation.box(bounds=[low, high])
    return np.asarray(shape.vertices, np.float64), np.asarray(shape.faces, np.int32)


def mesh_of(vertices, faces):
    return TriangleMesh.from_soup(vertices, faces)


def occluder_of(vertices, faces):
    return Occluder(np.array(vertices, np.float64), np.array(faces, np.int32).reshape(-1, 3))


NOTHING = occluder_of(np.zeros((0, 3)), [])


@pytest.mark.parametrize("exact", [False, True])
def test_the_original_itself_is_perfect(exact):
    vertices, faces = box()
    options = AccuracyOptions(views=24, image=64, quads=2000, exact=exact)
    report = evaluate_accuracy(mesh_of(vertices, faces), occluder_of(vertices, faces), options)
    assert (report.precision, report.recall) == (1.0, 1.0)
    assert (report.recall_by_view == 1.0).all()
    assert (report.nt > 0).all()


@pytest.mark.parametrize("exact", [False, True])
def test_no_triangles_hide_nothing(exact):
    options = AccuracyOptions(views=8, image=32, quads=500, exact=exact)
    report = evaluate_accuracy(mesh_of(*box()), NOTHING, options)
    assert (report.precision, report.recall) == (1.0, 0.0)
    assert (report.precision_by_view == 1.0).all()
    assert report.worst_view == 0


def test_part_of_a_square_in_closed_form():
    # A front view of a cube: a square of n pixels a side.  The occluder covers k of its columns, so
    # recall is the share of weighted intervals, n (n + 1) (n + 2) / 3 - n for a run of n.
    vertices, faces = box()
    plate, plate_faces = box((-1.0, -1.0, -0.1), (0.25, 1.0, 0.1))
    options = AccuracyOptions(views=1, image=128, exact=True)
    mesh, occluder = mesh_of(vertices, faces), occluder_of(plate, plate_faces)
    report = evaluate_accuracy(mesh, occluder, options, directions=FRONT)
    original, hidden = view_masks(mesh, occluder, FRONT, 128)
    n, k = original[0].any(axis=0).sum(), hidden[0].any(axis=0).sum()
    assert original.sum() == n * n
    assert hidden.sum() == n * k

    def weighted(run):
        return run * (run + 1) * (run + 2) / 3 - run

    assert report.recall == pytest.approx(weighted(k) / weighted(n), rel=1e-12)
    assert report.precision == 1.0
    assert report.nt[0] + report.pf[0] == pytest.approx((weighted(n) / n**2) ** 2, rel=1e-12)


def test_recall_and_precision_tell_small_from_large():
    mesh = mesh_of(*trimesh_sphere(1.0))
    small = evaluate_accuracy(mesh, occluder_of(*trimesh_sphere(0.8)), SMALL)
    large = evaluate_accuracy(mesh, occluder_of(*trimesh_sphere(1.2)), SMALL)
    assert small.precision == 1.0
    assert 0.2 < small.recall < 0.9
    assert large.recall == 1.0
    assert 0.5 < large.precision < 1.0


def trimesh_sphere(radius):
    shape = trimesh.creation.icosphere(3, radius)
    return np.asarray(shape.vertices), np.asarray(shape.faces)


def lopsided():
    """Original and occluder with neither symmetry nor perfect figures."""
    vertices, faces = trimesh_sphere(1.0)
    stretched = vertices * [1.0, 1.5, 0.5]
    part, part_faces = box((-0.5, -1.0, -0.3), (0.6, 1.2, 0.6))
    return mesh_of(stretched, faces), occluder_of(part, part_faces)


def test_the_sums_are_those_of_the_views():
    mesh, occluder = lopsided()
    report = evaluate_accuracy(mesh, occluder, SMALL)
    assert 0.3 < report.recall < 1.0
    assert 0.9 < report.precision < 1.0
    assert report.recall == report.nt.sum() / (report.nt + report.pf).sum()
    assert report.precision == report.nt.sum() / (report.nt + report.nf).sum()
    assert report.recall_by_view[report.worst_view] == report.recall_by_view.min()
    worst = report.worst_precision_view
    assert report.precision_by_view[worst] == report.precision_by_view.min()
    assert report.recall_quantiles[0] == report.recall_by_view.min()
    assert report.recall_quantiles[3] == np.median(report.recall_by_view)
    assert report.precision_quantiles[-1] == report.precision_by_view.max()
    np.testing.assert_allclose(np.linalg.norm(report.directions, axis=1), 1.0)


def test_sampled_agrees_with_exact():
    mesh, occluder = lopsided()
    sampled = evaluate_accuracy(mesh, occluder, AccuracyOptions(views=64, image=128))
    exact = evaluate_accuracy(mesh, occluder, AccuracyOptions(views=64, image=128, exact=True))
    assert sampled.recall == pytest.approx(exact.recall, abs=3e-3)
    assert sampled.precision == pytest.approx(exact.precision, abs=1e-3)
    assert sampled.recall != exact.recall


@pytest.mark.parametrize("scale", [2.0**-30, 2.0**40])
def test_scale_does_not_matter(scale):
    mesh, occluder = lopsided()
    scaled = evaluate_accuracy(
        mesh_of(mesh.vertices * scale, mesh.faces),
        occluder_of(occluder.vertices * scale, occluder.faces),
        SMALL,
    )
    assert_same(scaled, evaluate_accuracy(mesh, occluder, SMALL))


def test_map_coordinates_keep_all_their_digits():
    # Sixteenths at 2^23 are exact in float64; scaling before centring would lose them.
    mesh, occluder = lopsided()
    moved = np.array([2.0**23, -(2.0**23), 2.0**22])
    coarse = np.round(mesh.vertices * 16) / 16, np.round(occluder.vertices * 16) / 16
    reports = [
        evaluate_accuracy(
            mesh_of(coarse[0] + shift, mesh.faces),
            occluder_of(coarse[1] + shift, occluder.faces),
            SMALL,
        )
        for shift in (0.0, moved)
    ]
    assert_same(*reports)


def assert_same(report, other):
    for name in ("nt", "pf", "nf"):
        assert (getattr(report, name) == getattr(other, name)).all()


def test_neither_threads_nor_blocks_change_the_report(monkeypatch):
    mesh, occluder = lopsided()
    whole = evaluate_accuracy(mesh, occluder, SMALL)
    monkeypatch.setenv("OCCLUDER_THREADS", "1")
    assert_same(whole, evaluate_accuracy(mesh, occluder, SMALL))
    monkeypatch.setattr(silhouette_views, "_BLOCK_BYTES", 1)
    assert_same(whole, evaluate_accuracy(mesh, occluder, SMALL))


def test_seed_and_directions_are_used():
    mesh, occluder = lopsided()
    first = evaluate_accuracy(mesh, occluder, SMALL)
    other = evaluate_accuracy(
        mesh, occluder, AccuracyOptions(views=24, image=64, quads=2000, seed=1)
    )
    assert (first.directions != other.directions).any()
    given = evaluate_accuracy(mesh, occluder, SMALL, directions=first.directions[:5])
    assert (given.nt == first.nt[:5]).all()


def test_picture_rows_start_at_the_bottom():
    # An upright spike on a plate, seen along +z: v is +y, so the spike is in the last rows.
    vertices, faces = box((-1.0, -1.0, -0.1), (1.0, -0.5, 0.1))
    spike, spike_faces = box((-0.1, -1.0, -0.1), (0.1, 1.0, 0.1))
    mesh = mesh_of(np.concatenate([vertices, spike]), np.concatenate([faces, spike_faces + 8]))
    original, hidden = view_masks(mesh, occluder_of(spike, spike_faces), FRONT, 64)
    assert original.shape == hidden.shape == (1, 64, 64)
    rows = np.nonzero(original[0].any(axis=1))[0]
    widths = original[0].sum(axis=1)
    assert widths[rows[0]] > 5 * widths[rows[-1]]
    assert (hidden <= original).all()


def test_image_spans_the_bounding_sphere():
    # The cube's corners lie on the sphere, so seen along a face its side is 1 / sqrt(3).
    original, _ = view_masks(mesh_of(*box()), NOTHING, FRONT, 1024)
    assert original[0].any(axis=1).sum() == pytest.approx(1024 / np.sqrt(3), abs=1.0)


def test_edge_on_sheet_counts_as_found():
    # Nothing of it can be hidden in that view, and nothing is.
    sheet = mesh_of([[0, 0, 0], [1, 0, 0], [0, 0, 1]], [[0, 1, 2]])
    report = evaluate_accuracy(sheet, NOTHING, SMALL, directions=np.array([[1.0, 0.0, 0.0]]))
    assert (report.precision, report.recall) == (1.0, 1.0)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("views", 0),
        ("views", 65537),
        ("views", 1.5),
        ("views", True),
        ("image", 7),
        ("image", 4097),
        ("quads", 0),
        ("quads", 10_000_001),
        ("seed", -1),
        ("seed", 2**63),
    ],
)
def test_options_out_of_range_are_refused(name, value):
    with pytest.raises(OptionError, match=name):
        AccuracyOptions(**{name: value})


@pytest.mark.parametrize(
    "directions", [np.zeros((0, 3)), np.zeros((1, 3)), np.ones((2, 2)), np.full((1, 3), np.nan)]
)
def test_directions_must_be_unit_vectors(directions):
    with pytest.raises(OptionError, match="directions"):
        evaluate_accuracy(mesh_of(*box()), NOTHING, SMALL, directions=directions)


@pytest.mark.parametrize(
    ("vertices", "faces"),
    [
        ([[0, 0, np.nan], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]),
        ([[0, 0, 1e200], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 3]]),
    ],
)
def test_occluder_that_cannot_be_drawn_is_refused(vertices, faces):
    with pytest.raises(MeshError, match="occluder"):
        evaluate_accuracy(mesh_of(*box()), occluder_of(vertices, faces), SMALL)


def test_real_mesh_against_half_of_itself(asset):
    loaded = trimesh.load(asset("bunny_4968.ply"), process=False)
    mesh = mesh_of(loaded.vertices, loaded.faces)
    half = occluder_of(mesh.vertices, mesh.faces[::2])
    reports = [
        evaluate_accuracy(mesh, half, AccuracyOptions(views=64, exact=exact))
        for exact in (False, True)
    ]
    assert reports[0].precision == reports[1].precision == 1.0
    assert reports[0].recall == pytest.approx(reports[1].recall, rel=0.02)


def test_several_occluders_are_judged_as_each_alone():
    mesh = blob()
    occluders = [Occluder(mesh.vertices, mesh.faces[:count]) for count in (len(mesh.faces), 40, 0)]
    for exact in (False, True):
        options = AccuracyOptions(views=5, image=48, quads=200, seed=3, exact=exact)
        together = evaluate_accuracies(mesh, occluders, options)
        assert len(together) == 3
        for occluder, report in zip(occluders, together, strict=True):
            alone = evaluate_accuracy(mesh, occluder, options)
            assert np.array_equal(alone.nt, report.nt)
            assert np.array_equal(alone.pf, report.pf)
            assert np.array_equal(alone.nf, report.nf)
            assert (alone.recall, alone.precision) == (report.recall, report.precision)
    assert evaluate_accuracies(mesh, [], AccuracyOptions(views=2)) == ()
