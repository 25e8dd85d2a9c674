"""Thinning: fewer triangles, corners on the surface, outlines as before."""

from __future__ import annotations

import numpy as np
import pytest

from bench.meshes import bumpy_sphere
from simplifier.geometry.views import BoundingSphere, image_axes, random_directions
from simplifier.kernels.coverage import coverage_masks, unpack_masks
from simplifier.refinement import thin
from simplifier.refinement.thin import CELLS, thin_for_pictures
from tests.extremes.transforms import REWRITINGS
from tests.pictures import sphere_projections


def plain(vertices, faces):
    """The same by dictionaries."""
    low, extent = vertices.min(axis=0), np.ptp(vertices, axis=0).max()
    first = {}
    cells = [tuple(cell) for cell in ((vertices - low) / (extent / CELLS)).astype(int).tolist()]
    chosen = [first.setdefault(cell, len(first)) for cell in cells]
    corners = [[chosen[i] for i in face] for face in faces.tolist()]
    return [face for face in corners if len(set(face)) == 3], len(first)


@pytest.fixture(scope="module")
def ball():
    mesh = bumpy_sphere(400_000)
    return np.array(mesh.vertices), np.array(mesh.faces)


def test_it_is_what_dictionaries_give(ball):
    points, faces = thin_for_pictures(*ball)
    expected, count = plain(*ball)
    assert faces.tolist() == expected
    assert len(points) == count


def test_corners_are_vertices_of_the_input_and_most_triangles_go(ball):
    points, faces = thin_for_pictures(*ball)
    assert {point.tobytes() for point in points} <= {vertex.tobytes() for vertex in ball[0]}
    assert 0.1 < len(faces) / len(ball[1]) < 0.9
    assert (faces >= 0).all()
    assert (faces < len(points)).all()


def test_a_closed_surface_stays_closed(ball):
    _, faces = thin_for_pictures(*ball)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    _, uses = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    assert (uses % 2 == 0).all()


def test_outlines_stay_and_do_not_grow(ball):
    mesh = bumpy_sphere(400_000)
    sphere = BoundingSphere.of(mesh)
    maps = sphere_projections(image_axes(random_directions(24, 1)), sphere.centre, sphere.radius)
    whole = unpack_masks(coverage_masks(*ball, maps, 64, 64), 64)
    fewer = unpack_masks(coverage_masks(*thin_for_pictures(*ball), maps, 64, 64), 64)
    assert (whole & ~fewer).sum() < 0.01 * whole.sum()
    assert (fewer & ~whole).sum() < 0.001 * whole.sum()


def test_few_triangles_are_left_alone(ball, monkeypatch):
    vertices, faces = ball
    some = faces[: thin._LEAST - 1]
    same = thin_for_pictures(vertices, some)
    assert same[0] is vertices
    assert same[1] is some
    monkeypatch.setattr(thin, "_LEAST", 1)
    assert len(thin_for_pictures(vertices, some)[1]) < len(some)


def test_slits_opened_along_the_edges_of_a_surface_cut_in_halves(monkeypatch):
    # Half of each edge belonged to one side only; pictures of a scan were full of lines of light.
    monkeypatch.setattr(thin, "_LEAST", 1)
    mesh = bumpy_sphere(40_000)
    halves = next(one for one in REWRITINGS if one.name == "cut in halves").of(mesh)
    sphere = BoundingSphere.of(mesh)
    maps = sphere_projections(image_axes(random_directions(8, 1)), sphere.centre, sphere.radius)

    def picture(vertices, faces):
        return unpack_masks(coverage_masks(vertices, faces, maps, 256, 256), 256)

    whole = picture(mesh.vertices, mesh.faces)
    fewer = picture(*thin_for_pictures(np.array(halves.vertices), np.array(halves.faces)))
    assert (whole & ~fewer).sum() < 0.003 * whole.sum()
    assert (fewer & ~whole).sum() < 0.003 * whole.sum()
