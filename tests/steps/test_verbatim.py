"""When a mesh is its own occluder, in as few triangles, and which of its triangles are buried."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.geometry.overrides import NO_OVERRIDES, DrawnPart, Overrides
from simplifier.options.stages import SolidOptions
from simplifier.progress import Stopwatch
from simplifier.steps.solid import solidify
from simplifier.steps.verbatim import is_own_occluder, own_triangles, seen_triangles
from tests.extremes.shapes import finer
from tests.solids import box, joined, sphere


def solid_of(mesh, resolution=32, **options):
    return solidify(mesh, SolidOptions(resolution, **options), Stopwatch())


def within(inset):
    """A box of 32 voxels, and one within it, so many voxels below its surface."""
    return joined(box([32.0] * 3), box([32.0 - 2.0 * inset] * 3, [inset] * 3))


@pytest.mark.parametrize(("budget", "fitting"), [(11, False), (12, True), (13, True)])
def test_as_many_triangles_as_the_budget_fit(budget, fitting):
    mesh = box()
    assert is_own_occluder(mesh, SolidOptions(32), budget, NO_OVERRIDES) is fitting


def test_what_has_to_stay_within_or_was_drawn_over_does_not_fit():
    mesh = box()
    drawn = Overrides(drawn=(DrawnPart("box", mesh.vertices[mesh.faces]),))
    assert not is_own_occluder(mesh, SolidOptions(32, conservative=True), 12, NO_OVERRIDES)
    assert not is_own_occluder(mesh, SolidOptions(32), 12, drawn)


def own(mesh, budget, overrides=NO_OVERRIDES, **options):
    chosen = SolidOptions(32, **options)
    return own_triangles(mesh, solid_of(mesh, **options), chosen, budget, overrides)


@pytest.mark.parametrize("offset", [0.0, 5_176_000.0])
def test_flat_parts_take_as_few_triangles_as_cover_them(offset):
    whole = box([9.0, 5.0, 7.0], [offset] * 3)
    found, words = own(finer(whole), 12)
    assert len(found) == 12
    assert words.startswith("Its flat parts take no more triangles")
    away = np.abs(found.reshape(-1, 1, 3) - whole.vertices).max(axis=2).min(axis=1)
    assert away.max() <= 2e-5 * 9.0
    assert own(finer(whole), 11) is None


def test_of_the_own_triangles_and_those_that_cover_them_the_fewer_are_kept():
    whole = box([9.0, 5.0, 7.0])
    found, words = own(whole, 64)
    assert np.array_equal(found, whole.vertices[whole.faces])
    assert words.startswith("The mesh has no more triangles")
    assert len(own(finer(whole, 1), 64)[0]) == 12  # of 48


def test_what_is_buried_needs_no_triangle():
    mesh = finer(within(12.0))
    found, _ = own(mesh, 12)
    assert len(found) == 12
    assert (np.abs(found - 16.0).max(axis=2) > 15.9).all()


def test_what_is_round_or_was_decided_by_hand_is_not_covered():
    flat = finer(box([9.0, 5.0, 7.0]))
    drawn = Overrides(drawn=(DrawnPart("box", flat.vertices[flat.faces]),))
    assert own(sphere(rings=30), 64) is None
    assert own(flat, 64) is not None
    assert own(flat, 64, drawn) is None
    assert own(flat, 64, conservative=True) is None
    assert own(flat, 64, glue=True) is None


@pytest.mark.parametrize(("inset", "seen"), [(0.5, 24), (2.5, 24), (3.5, 12), (12.0, 12)])
def test_what_is_deeper_than_three_voxels_is_buried(inset, seen):
    mesh = within(inset)
    found = seen_triangles(mesh, solid_of(mesh))
    assert len(found) == seen
    assert np.array_equal(found[:12], mesh.vertices[mesh.faces[:12]])
