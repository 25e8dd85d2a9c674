"""Thinning: fewer triangles, corners on the surface, outlines as before."""

from __future__ import annotations

import numpy as np
import pytest

from bench.meshes import bumpy_sphere
from simplifier.geometry.mesh import TriangleMesh, as_mesh
from simplifier.geometry.views import BoundingSphere, image_axes, random_directions
from simplifier.kernels.coverage import coverage_masks, unpack_masks
from simplifier.kernels.thin import border_places
from simplifier.refinement import thin
from simplifier.refinement.thin import COARSE, FINE, thinned
from tests.extremes.transforms import REWRITINGS
from tests.pictures import sphere_projections


def plain(vertices, faces, coarsely):
    """The same by dictionaries."""
    low, extent = vertices.min(axis=0), np.ptp(vertices, axis=0)
    step = extent.max() / (COARSE if coarsely else FINE)
    within = (vertices - low) / step
    away = ((within - 0.5 * extent / step) ** 2).sum(axis=1)
    places, chosen, kept = {}, [], []
    for index, cell in enumerate(map(tuple, within.astype(int).tolist())):
        chosen.append(places.setdefault(cell, len(places)))
        if chosen[-1] == len(kept):
            kept.append(index)
        elif coarsely and away[index] > away[kept[chosen[-1]]]:
            kept[chosen[-1]] = index
    corners = [[chosen[i] for i in face] for face in faces.tolist()]
    return [face for face in corners if len(set(face)) == 3], vertices[kept]


@pytest.fixture(scope="module")
def ball():
    return bumpy_sphere(200_000)


@pytest.fixture(scope="module")
def few(ball):
    return thinned(ball)


@pytest.mark.parametrize("coarsely", [False, True])
def test_it_is_what_dictionaries_give(ball, coarsely):
    faces, points = plain(ball.vertices, ball.faces, coarsely)
    few = thinned(ball, coarsely=coarsely)
    assert few.faces.tolist() == faces
    assert np.array_equal(few.vertices, points)


def test_coarse_cells_leave_less_and_keep_what_is_outermost(ball):
    few, fewer = thinned(ball), thinned(ball, coarsely=True)
    assert len(fewer.faces) < 0.8 * len(few.faces)
    whole, fine, coarse = (
        np.linalg.norm(mesh.vertices, axis=1).mean() for mesh in (ball, few, fewer)
    )
    assert coarse > fine
    assert coarse > whole


def test_corners_are_vertices_of_the_input_and_most_triangles_go(ball, few):
    inputs = {vertex.tobytes() for vertex in ball.vertices}
    assert {point.tobytes() for point in few.vertices} <= inputs
    assert 0.1 < len(few.faces) / len(ball.faces) < 0.9
    assert (few.faces >= 0).all()
    assert (few.faces < len(few.vertices)).all()


def test_a_closed_surface_stays_closed(few):
    faces = few.faces
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    ends = np.sort(edges, axis=1).astype(np.int64)
    _, uses = np.unique(ends[:, 0] * len(few.vertices) + ends[:, 1], return_counts=True)
    assert (uses % 2 == 0).all()


def picture(mesh, maps, pixels):
    return unpack_masks(coverage_masks(mesh.vertices, mesh.faces, maps, pixels, pixels), pixels)


def test_outlines_stay_and_do_not_grow(ball, few):
    sphere = BoundingSphere.of(ball)
    maps = sphere_projections(image_axes(random_directions(24, 1)), sphere.centre, sphere.radius)
    whole, left = picture(ball, maps, 64), picture(few, maps, 64)
    assert (whole & ~left).sum() < 0.01 * whole.sum()
    assert (left & ~whole).sum() < 0.001 * whole.sum()


def test_few_triangles_are_left_alone(ball, monkeypatch):
    some = TriangleMesh(ball.vertices, ball.faces[: thin._LEAST - 1].copy())
    assert thinned(some) is some
    monkeypatch.setattr(thin, "_LEAST", 1)
    assert len(thinned(some).faces) < len(some.faces)


def test_dust_of_which_nothing_would_be_left_is_left_alone(monkeypatch):
    monkeypatch.setattr(thin, "_LEAST", 1)
    generator = np.random.default_rng(7)
    specks = generator.random((50, 1, 3)) + 1e-4 * generator.random((50, 3, 3))
    middles = np.floor(specks.mean(axis=1, keepdims=True) * 64.0) / 64.0 + 1e-3
    dust = TriangleMesh.from_soup(*as_mesh(specks - specks[:, :1] + middles))
    assert thinned(dust) is dust


def test_slits_opened_along_the_edges_of_a_surface_cut_in_halves(monkeypatch):
    # Half of each edge belonged to one side only; pictures of a scan were full of lines of light.
    monkeypatch.setattr(thin, "_LEAST", 1)
    mesh = bumpy_sphere(40_000)
    halves = next(one for one in REWRITINGS if one.name == "cut in halves").of(mesh)
    sphere = BoundingSphere.of(mesh)
    maps = sphere_projections(image_axes(random_directions(8, 1)), sphere.centre, sphere.radius)
    whole, left = picture(mesh, maps, 256), picture(thinned(halves), maps, 256)
    assert (whole & ~left).sum() < 0.003 * whole.sum()
    assert (left & ~whole).sum() < 0.003 * whole.sum()


def test_what_closes_slits_stays_closed_in_larger_cells(monkeypatch):
    """So that starts, which are made of what is left, need not look for T-junctions again."""
    monkeypatch.setattr(thin, "_LEAST", 1)
    mesh = bumpy_sphere(40_000)
    halves = next(one for one in REWRITINGS if one.name == "cut in halves").of(mesh)
    few = thinned(halves)
    assert border_places(halves.faces, len(halves.vertices)).any()
    assert not border_places(few.faces, len(few.vertices)).any()
