"""When a mesh is its own occluder, and which of its triangles are buried."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.geometry.overrides import NO_OVERRIDES, DrawnPart, Overrides
from simplifier.options.stages import SolidOptions
from simplifier.progress import Stopwatch
from simplifier.steps.solid import solidify
from simplifier.steps.verbatim import is_own_occluder, seen_triangles
from tests.solids import box, joined


def solid_of(mesh, resolution=32, **options):
    return solidify(mesh, SolidOptions(resolution, **options), Stopwatch())


def within(inset):
    """A box of 32 voxels, and one within it, so many voxels below its surface."""
    return joined(box([32.0] * 3), box([32.0 - 2.0 * inset] * 3, [inset] * 3))


@pytest.mark.parametrize(("budget", "fitting"), [(11, False), (12, True), (13, True)])
def test_as_many_triangles_as_the_budget_fit(budget, fitting):
    mesh = box()
    assert is_own_occluder(mesh, solid_of(mesh), budget, NO_OVERRIDES) is fitting


def test_what_has_to_stay_within_or_was_drawn_over_does_not_fit():
    mesh = box()
    drawn = Overrides(drawn=(DrawnPart("box", mesh.vertices[mesh.faces]),))
    assert not is_own_occluder(mesh, solid_of(mesh, conservative=True), 12, NO_OVERRIDES)
    assert not is_own_occluder(mesh, solid_of(mesh), 12, drawn)


@pytest.mark.parametrize(("inset", "seen"), [(0.5, 24), (2.5, 24), (3.5, 12), (12.0, 12)])
def test_what_is_deeper_than_three_voxels_is_buried(inset, seen):
    mesh = within(inset)
    found = seen_triangles(mesh, solid_of(mesh))
    assert len(found) == seen
    assert np.array_equal(found[:12], mesh.vertices[mesh.faces[:12]])
