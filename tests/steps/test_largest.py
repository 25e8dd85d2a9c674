"""Triangles of the mesh among those that keep inside: they hide nothing else, and may hide most."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.accuracy.accuracy import AccuracyOptions, evaluate_accuracy
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.overrides import OpenRegion, Overrides, Region
from simplifier.options.stages import make_options
from simplifier.pipeline import simplify_mesh
from simplifier.steps import largest as largest_step
from simplifier.steps.largest import largest_triangles, with_largest
from tests.solids import as_soup, box, joined, random_soup, sphere

LENT = "Triangles of the mesh itself, which hide nothing else, are among them."
WALLS = joined(box((4.0, 3.0, 0.02)), box((0.02, 3.0, 4.0)), box((4.0, 3.0, 0.02), (0.0, 0.0, 4.0)))
"""Thinner than a voxel, so nothing is wholly inside."""


def inside(mesh, budget=12, overrides=None, **options):
    options = {"conservative": True, "resolution": 32, "moves": 600, **options}
    chosen = make_options(float(mesh.extent.max()), budget=budget, **options)
    return simplify_mesh(mesh, chosen, **({} if overrides is None else {"overrides": overrides}))


def judged(mesh, occluder):
    return evaluate_accuracy(mesh, occluder, AccuracyOptions(64, 256, exact=True))


def corners(triangles):
    return {tuple(map(tuple, triangle)) for triangle in triangles.tolist()}


@pytest.mark.parametrize("most", [400, 1])
def test_thin_walls_hide_by_their_own_triangles(monkeypatch, most):
    """They hid nothing: the occluder was empty."""
    monkeypatch.setattr(largest_step, "_MOST", most)  # more take the largest, whatever they add
    made = inside(WALLS)
    assert made.decisions[-1] == LENT
    assert made.warnings == (
        "no voxel lies wholly inside, so only triangles of the mesh itself hide; raise the"
        " resolution or, if the mesh encloses nothing, allow some overhang",
    )
    occluder = made.occluder
    assert 0 < len(occluder.faces) <= 12
    assert corners(occluder.vertices[occluder.faces]) <= corners(WALLS.vertices[WALLS.faces])
    found = judged(WALLS, occluder)
    assert found.precision == 1.0
    assert found.recall > (0.95 if most > 12 else 0.9)
    assert occluder.error_bound == 0.0


@pytest.mark.parametrize("seed", range(4))
def test_nothing_that_is_visible_is_hidden_by_a_soup(seed):
    mesh = random_soup(seed, 60, 1.0)
    made = inside(mesh, 16, resolution=16)
    assert made.decisions[-1] == LENT
    found = judged(mesh, made.occluder)
    assert found.precision == 1.0
    assert found.recall > 0.1


def test_what_no_picture_shows_hides_by_its_largest():
    needle = box((100.0, 0.1, 0.1))
    occluder = inside(needle, 3).occluder
    assert corners(occluder.vertices[occluder.faces]) <= corners(needle.vertices[needle.faces])
    assert len(occluder.faces) == 3


def test_what_is_thick_keeps_its_distance():
    made = inside(sphere(rings=16), 48)
    assert LENT not in made.decisions
    assert np.linalg.norm(made.occluder.vertices, axis=1).max() < 0.99


def test_nothing_is_lent_where_a_length_is_kept_or_a_person_decided():
    assert len(inside(WALLS, shrink=0.01).occluder.faces) == 0
    standing = np.array([0.0, 0.0, 0.0, 1.0])
    region = Region.of(np.array([1.0, 1.0, 0.0]), np.array([0.5, 0.5, 0.5]), standing)
    beside = Overrides(open=(OpenRegion("gap", region),))
    made = inside(WALLS, overrides=beside)
    assert len(made.occluder.faces) == 0
    assert made.warnings[-1].startswith("no voxel lies wholly inside, so the occluder is empty; ")


def test_the_largest_are_told_in_the_order_of_the_mesh():
    soup = np.zeros((4, 3, 3))
    soup[:, 1, 0] = soup[:, 2, 1] = [1.0, 3.0, 2.0, 3.0]
    mesh = as_soup(soup)
    np.testing.assert_array_equal(largest_triangles(mesh, 2), soup[[1, 3]])
    np.testing.assert_array_equal(largest_triangles(mesh, 3), soup[[1, 2, 3]])
    np.testing.assert_array_equal(largest_triangles(mesh, 9), soup)
    alike = as_soup(np.concatenate([soup, soup]))  # of those as large the first
    np.testing.assert_array_equal(largest_triangles(alike, 3), soup[[1, 3, 1]])
    np.testing.assert_array_equal(largest_triangles(alike, 5), soup[[1, 2, 3, 1, 3]])


def plain_choice(images, budget):
    """One after another, the first of those that add most pixels."""
    chosen, seen = [], np.zeros_like(images[0])
    while len(chosen) < budget:
        added = [int(np.bitwise_count(image & ~seen).sum()) for image in images]
        if max(added) == 0:
            break
        chosen.append(added.index(max(added)))
        seen |= images[chosen[-1]]
    return sorted(chosen)


@pytest.mark.parametrize("budget", [1, 5, 40])
def test_those_that_add_most_are_chosen_one_after_another(monkeypatch, budget):
    mesh = random_soup(7, 30, 0.6)
    mesh = TriangleMesh.from_soup(mesh.vertices, np.concatenate([mesh.faces, mesh.faces[:4]]))
    made, pictures = inside(mesh, budget, resolution=16), []
    draw = largest_step.draw_soup

    def drawn(placed, projections, depths, standing, images, layers):
        draw(placed, projections, depths, standing, images, layers)
        pictures.append(images.copy())

    monkeypatch.setattr(largest_step, "draw_soup", drawn)
    options = make_options(1.0, budget=budget, conservative=True, resolution=16)
    chosen, words = with_largest(np.empty((0, 3, 3)), mesh, made.solid, options)
    assert words == [LENT]
    own = largest_triangles(mesh, 4 * budget)
    np.testing.assert_array_equal(chosen, own[plain_choice(pictures[0], budget)])
