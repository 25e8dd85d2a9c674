"""What gluing does to a solid."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from simplifier.accuracy.deviation import deviation
from simplifier.geometry.mesh import TriangleMesh
from simplifier.options.stages import ERROR_VOXELS, Options, RefineOptions, SolidOptions
from simplifier.pipeline import simplify_mesh
from simplifier.progress import Stopwatch
from simplifier.steps.solid import solid_decisions, solidify
from simplifier.voxel.voxelize import voxelize
from tests.solids import blob, box, joined

VOXEL = 1.0 / 24


def pair(gap):
    """Two closed boxes that many voxels apart, 1 long together."""
    half = 0.5 * (1.0 - gap * VOXEL)
    return joined(box((half, 0.4, 0.4)), box((half, 0.4, 0.4), (1.0 - half, 0.0, 0.0)))


def solid_of(mesh, **options):
    return solidify(mesh, SolidOptions(resolution=24, **options), Stopwatch())


def pieces(solid):
    return ndimage.label(solid.filled.inside)[1]


def test_neighbours_grow_together():
    mesh = pair(2.9)
    assert pieces(solid_of(mesh)) == 2
    assert pieces(solid_of(mesh, glue=True)) == 1
    assert pieces(solid_of(pair(6.0), glue=True)) == 2


def test_the_step_is_taken_before_the_fill_and_not_past_the_box():
    plain, glued = solid_of(blob()), solid_of(blob(), glue=True)
    touched = voxelize(blob(), 24)
    expected = ndimage.binary_dilation(touched.inside, np.ones((3, 3, 3)))
    np.testing.assert_array_equal(glued.touched.inside, expected)
    assert glued.filled.shape == plain.filled.shape
    assert (glued.filled.inside | ~plain.filled.inside).all()
    assert (plain.reach, glued.reach) == (1, 0)


@pytest.mark.parametrize("options", [{"conservative": True}, {"shrink": 0.1}])
def test_without_effect_where_all_is_wholly_inside(options):
    plain, glued = (solid_of(blob(), glue=glue, **options) for glue in (False, True))
    np.testing.assert_array_equal(plain.core.inside, glued.core.inside)


@pytest.mark.parametrize("mesh", [pair(0.5), pair(1.5), blob()], ids=["close", "apart", "blob"])
def test_the_error_bound_holds(mesh: TriangleMesh):
    options = Options(
        SolidOptions(resolution=24, glue=True), refine=RefineOptions(moves=2000, views=32)
    )
    made = simplify_mesh(mesh, options)
    assert len(made.occluder.faces) > 0
    cell = made.solid.core.cell_size
    assert 0.5 < made.occluder.error_bound / (ERROR_VOXELS * cell) <= 1.0
    # Against the plain solid: what gluing alone encloses counts as outside.
    plain = solid_of(mesh)
    assert deviation(made.occluder, mesh, plain.interior) <= ERROR_VOXELS * cell


def decisions_of(mesh, **options):
    chosen = SolidOptions(resolution=24, **options)
    return solid_decisions(solidify(mesh, chosen, Stopwatch()), chosen)


def test_what_is_decided_is_said():
    closed = decisions_of(box())
    assert closed[0] == "The longest edge of the mesh is cut into 24 voxels of 0.04167 units each."
    [_, inside] = closed
    assert inside == "The surface itself encloses 77.0 % of the solid."  # (22 / 24) ** 3
    [_, seen] = decisions_of(box(without=[3]))
    assert seen.endswith(
        "counts as inside because viewers see it from at most 10 % of all directions."
    )
    [_, ground] = decisions_of(box(without=[2]), ground=True)
    assert ground.endswith("counts as inside because the ground closes the mesh from below.")
    assert decisions_of(box(), conservative=True)[-1] == "Only what lies wholly inside may hide."
    assert "drawn in" in decisions_of(box(without=[3]), conservative=True)[-1]
