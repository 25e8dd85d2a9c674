"""An error bound that is asked for is kept, whatever the grid of the sections."""

from __future__ import annotations

import numpy as np
import pytest

import simplifier
from simplifier.accuracy.deviation import deviation_from_solid
from simplifier.errors import OptionError
from simplifier.geometry.overrides import OpenRegion, Overrides, Region
from simplifier.options.stages import ERROR_VOXELS
from tests.solids import blob, box, random_soup, sphere, table, torus

MESHES = {
    "blob": blob, "open box": lambda: box(without=(3,)), "soup": lambda: random_soup(3, 300, 0.2),
    "sphere": sphere, "table": table, "torus": torus,
}  # fmt: skip


def made_of(mesh, share, **options):
    longest = float(mesh.extent.max())
    quick = {"preset": "draft", "budget": 24, "error_share": share, **options}
    made = simplifier.simplify(mesh, **quick).made
    return made, longest


def check_kept(made, mesh, bound):
    found = made.occluder
    assert len(found.faces) > 0
    assert deviation_from_solid(found, mesh, made.solid) <= found.error_bound <= bound


@pytest.mark.sweep(6)
@pytest.mark.parametrize("share", [0.2, 0.04, 0.012])
@pytest.mark.parametrize("name", MESHES)
def test_it_is_kept_in_the_default_grid(name, share):
    mesh = MESHES[name]()
    made, longest = made_of(mesh, share)
    check_kept(made, mesh, share * longest)
    assert max(made.solid.touched.shape) == 64


def test_what_lies_inside_is_at_no_distance_where_it_is_known_in_fine_voxels():
    """The bound counts from there, so the interior of a ball fills it but for a fine shell."""
    mesh = sphere()
    made, _ = made_of(mesh, 0.02)
    shape = np.array(made.solid.interior.inside.shape)
    assert (shape == 4 * np.array(made.solid.touched.shape)).all()
    volume = made.solid.interior.count * made.solid.interior.cell_size**3
    assert 0.93 < volume / (4.0 / 3.0 * np.pi) < 1.0


@pytest.mark.slow
def test_a_finer_bound_needs_a_finer_grid_and_a_coarse_one_is_refused():
    mesh = blob()
    made, longest = made_of(mesh, 0.005, moves=500)
    assert max(made.solid.touched.shape) == 347
    check_kept(made, mesh, 0.005 * longest)
    with pytest.raises(OptionError, match="16 cannot keep the error share; choose 87 or more"):
        made_of(mesh, 0.02, resolution=16)
    made, longest = made_of(mesh, 0.04, resolution=16)
    check_kept(made, mesh, 0.04 * longest)


@pytest.mark.sweep(2)
@pytest.mark.parametrize(
    "options", [{"time_limit": 0.2}, {"moves": 0}, {"overhang": 1.0}, {"seed": 5, "ground": True}]
)
def test_it_is_kept_with_other_options(options):
    mesh = blob()
    made, longest = made_of(mesh, 0.04, **options)
    check_kept(made, mesh, 0.04 * longest)


@pytest.mark.sweep(5)
@pytest.mark.parametrize("overhang", [0.011, 0.03, 0.2])
@pytest.mark.parametrize("name", ["blob", "soup", "table"])
def test_more_overhang_has_more_room_within_the_bound_of_the_grid(name, overhang):
    mesh = MESHES[name]()
    made = simplifier.simplify(mesh, preset="draft", budget=24, overhang=overhang).made
    check_kept(made, mesh, ERROR_VOXELS * made.solid.core.cell_size * (1.0 + 1e-9))


def test_more_overhang_hides_more():
    mesh = torus(around=16, tube=0.3)
    found = [
        simplifier.simplify(
            mesh, preset="draft", resolution=40, budget=16, overhang=share
        ).measure()
        for share in (0.005, 0.05)
    ]
    assert found[1].accuracies[0].recall > found[0].accuracies[0].recall + 0.05
    assert found[1].overhangs[0].mean < 0.055


def test_it_is_kept_beside_an_open_region_and_where_the_mesh_is_its_own_occluder():
    mesh, middle = blob(), blob().bounds.mean(axis=0)
    region = Region.of(middle, np.full(3, 0.2), np.array([0.0, 0.0, 0.0, 1.0]))
    regions = Overrides(open=(OpenRegion("middle", region),))
    longest = float(mesh.extent.max())
    made = simplifier.simplify(
        mesh, overrides=regions, preset="draft", error_bound=0.04 * longest
    ).made
    check_kept(made, mesh, 0.04 * longest)
    own, longest = made_of(box(), 0.01)
    check_kept(own, box(), 0.01 * longest)
