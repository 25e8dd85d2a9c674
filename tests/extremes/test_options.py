"""Every option at the ends of its range, on a solid whose undisturbed result is good."""

from __future__ import annotations

import math

import numpy as np
import pytest

import simplifier
from bench.meshes import bumpy_sphere
from simplifier import SimplifyOptions
from simplifier.errors import OptionError
from simplifier.options.stages import ERROR_VOXELS, SectionOptions, make_options
from tests.extremes.shapes import SHAPES

MESH = bumpy_sphere(2_000)
LONGEST = float(MESH.extent.max())
QUICK = {"preset": "draft", "moves": 600, "views": 12, "image": 64, "exact": True}


def produced(mesh=MESH, **options):
    product = simplifier.simplify(mesh, SimplifyOptions(**QUICK | options)).measure()
    for level in product.levels:
        assert np.isfinite(level.occluder.vertices).all()
        assert level.deviation <= level.error_bound
        assert level.triangles <= options.get("budget", 64)
    return product


def recall(product):
    return product.accuracies[0].recall


@pytest.fixture(scope="module")
def undisturbed():
    return produced()


@pytest.mark.parametrize(("resolution", "least"), [(1, 0.3), (2, 0.3), (3, 0.25)])
def test_a_few_voxels_are_enough_for_something(resolution, least):
    product = produced(resolution=resolution, preset="balanced")
    assert recall(product) > least
    assert product.accuracies[0].precision > 0.98
    assert 0.0 < product.levels[0].error_bound <= ERROR_VOXELS * LONGEST / resolution


def test_a_thousand_voxels_are_the_most():
    assert make_options(LONGEST, resolution=1024).solid.resolution == 1024
    with pytest.raises(OptionError, match="choose 1 to 1,024"):
        produced(resolution=1025)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["bunny_69k.ply", "building_duplex.glb"])
def test_512_voxels_of_a_real_mesh(asset, name):
    product = produced(simplifier.load(asset(name)), resolution=512, ground=True)
    assert product.levels[0].triangles > 0
    assert sum(product.timings.values()) < 300.0


@pytest.mark.parametrize("budget", [1, 2])
def test_one_triangle_hides_something(budget):
    product = produced(budget=budget)
    assert product.levels[0].triangles == budget
    assert 0.005 < recall(product) < 0.3


def test_a_budget_that_holds_the_mesh_gives_the_mesh():
    product = produced(budget=10_000)
    assert product.levels[0].triangles == len(MESH.faces)
    assert recall(product) == product.accuracies[0].precision == 1.0
    assert product.levels[0].deviation < 1e-12


@pytest.mark.slow
def test_a_budget_of_ten_thousand_for_a_larger_mesh():
    product = produced(bumpy_sphere(40_000), budget=10_000, overhang=1.0)
    assert recall(product) > 0.95
    assert sum(product.timings.values()) < 300.0


@pytest.mark.parametrize("alpha", [0.0, 1.0])
def test_alpha_at_its_ends(alpha, undisturbed):
    """At 1 the cut ends with its first polygon, and refining has to make up for it."""
    assert recall(produced(alpha=alpha, resolution=32, moves=3000)) > 0.75 * recall(undisturbed)


@pytest.mark.sweep(2)
@pytest.mark.parametrize("bound", [LONGEST, 10.0 * LONGEST, 1e308])
def test_an_error_bound_longer_than_the_mesh_changes_nothing(bound):
    product = produced(error_bound=bound)
    assert product.levels[0].error_bound <= bound
    assert max(product.result.made.solid.touched.shape) == 64


@pytest.mark.parametrize("bound", [1e-12 * LONGEST, 1e-45, 5e-324])
def test_an_error_bound_that_float32_cannot_hold_is_refused(bound):
    """The least is a 300th of the mesh, and 32 bits relative to its centre hold a 2**24th."""
    with pytest.raises(OptionError, match=r"more than 1024 voxels.*; choose 0\.00\d+ or more"):
        produced(error_bound=bound)


def test_a_far_occluder_keeps_its_error_bound_in_a_glb(tmp_path):
    away = simplifier.TriangleMesh.from_soup(MESH.vertices + 4e6, MESH.faces)
    product = produced(away, error_bound=0.1)
    product.save(tmp_path / "far.glb")
    kept = simplifier.load_occluder(tmp_path / "far.glb")
    corners = kept.vertices[kept.faces]
    moved = np.abs(corners - product.occluder.vertices[product.occluder.faces]).max()
    assert moved < 1e-6 * LONGEST


@pytest.mark.parametrize("field", ["directions", "direction_samples", "depths", "depth_samples"])
def test_zero_directions_and_depths_are_refused(field):
    with pytest.raises(OptionError, match="0 is out of range; choose 1 to"):
        SectionOptions(**{field: 0})


@pytest.mark.parametrize("seconds", [0.0, -1.0, math.nan, math.inf])
def test_no_time_is_refused(seconds):
    with pytest.raises(OptionError, match=r"time limit: .*choose more than 0"):
        produced(moves=None, time_limit=seconds)


@pytest.mark.sweep(2)
@pytest.mark.parametrize("name", ["cube", "needle of 192 triangles", "10,000 specks"])
def test_hardly_any_time_gives_the_quick_cut(name):
    mesh = SHAPES[name]()
    product = produced(mesh, moves=None, time_limit=1e-9)
    if name == "cube":
        assert recall(product) > 0.3


@pytest.mark.parametrize("precision", [0.0, 1.0])
def test_min_precision_at_its_ends(precision, undisturbed):
    product = produced(min_precision=precision)
    assert recall(product) > 0.6 * recall(undisturbed)
    assert product.accuracies[0].precision > (0.999 if precision else 0.98)


@pytest.mark.parametrize("shrink", [LONGEST, 1e18, 1e300, 1.7e308])
def test_a_shrink_that_leaves_nothing_says_what_would(shrink):
    """The larger two once ended in an OverflowError."""
    product = produced(shrink=shrink)
    assert product.levels[0].triangles == 0
    assert "so the occluder is empty; choose at most 0." in product.warnings[0]


def test_a_smallest_hole_as_long_as_the_mesh_and_one_longer():
    assert recall(produced(smallest_hole=LONGEST, resolution=32)) > 0.25
    with pytest.raises(OptionError, match="is longer than the mesh"):
        produced(smallest_hole=1.01 * LONGEST)
    produced(smallest_hole=5e-324, resolution=32)


@pytest.mark.sweep(3)
@pytest.mark.parametrize(
    "options",
    [
        {"lods": 16, "resolution": 32},
        {"error_bounds": (1e308, LONGEST, LONGEST / 10.0)},
        {"error_bounds": (LONGEST / 10.0, math.nextafter(LONGEST / 10.0, 1.0))},
        {"lods": 2, "pixel_error": 1000.0, "screen_height": 1, "fov": 179.0},
    ],
    ids=["sixteen", "endless", "all but equal", "a screen of one row"],
)
def test_levels_at_their_ends(options):
    product = produced(**options)
    bounds = [level.error_bound for level in product.levels]
    assert bounds == sorted(bounds)
    assert len(product.levels) + len(product.chain.left_out) >= 2
    chain = product.chain
    distances = [chain.switch_distance(index) for index in range(len(product.levels))]
    assert np.isfinite(distances).all()
