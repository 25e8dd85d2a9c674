"""Every shape at the extremes gives a right occluder, alone, with options, and in a scene."""

from __future__ import annotations

import numpy as np
import pytest

import simplifier
from simplifier import SimplifyOptions
from simplifier.culling.flythrough import fly
from simplifier.errors import BackendUnavailableError
from tests.culling.occluded import SMALL, looking, path_of
from tests.extremes.shapes import CLOSED, HOLES, OPEN, SHAPES, VOXELS, finer, needle, turned
from tests.hierarchy.scenes import scene_of

QUICK = {"resolution": 32, "moves": 800, "views": 16, "image": 64, "exact": True}
DRAFT = {"preset": "draft", "moves": 300}
LEAST = {
    "10,000 specks": 0.0, "chessboard": 0.0, "checkerboard": 0.6, "Menger sponge": 0.0,
    "voxel faces": 0.7,
}  # fmt: skip
"""Recall of what is mostly gaps, or all steps; all else hides nearly everything."""
WHOLE = [name for name in SHAPES if not name.startswith("hole")]


def produced(mesh, **options):
    product = simplifier.simplify(mesh, SimplifyOptions(**QUICK | options)).measure()
    check(product)
    return product


def check(product):
    """What no extreme may break: finite numbers, the budget, the error bound, a valid report."""
    options, report = product.result.options, product.report()
    for level in product.levels:
        assert np.isfinite(level.occluder.vertices).all()
        assert level.triangles <= options.budget
        assert level.deviation <= level.error_bound + 1e-9 * product.mesh.extent.max()
    assert 0.0 <= report["recall"] <= 1.0
    assert 0.0 <= report["precision"] <= 1.0
    if not product.levels[0].triangles:
        assert any("the occluder is empty" in warning for warning in product.warnings)


@pytest.mark.sweep(5)
@pytest.mark.parametrize("name", WHOLE)
def test_hides_nearly_all_and_hardly_anything_wrongly(name):
    product = produced(SHAPES[name]())
    recall, precision = product.accuracies[0].recall, product.accuracies[0].precision
    assert precision > 0.98  # of a short search
    assert recall >= LEAST.get(name, 0.9)


@pytest.mark.sweep(5)
@pytest.mark.parametrize("width", HOLES)
def test_a_hole_narrower_than_a_voxel_is_closed_and_one_of_two_leaks_and_says_so(width):
    """In between it depends on where the hole lies in the grid."""
    mesh = SHAPES[f"hole of {width} voxels"]()
    by_sight = produced(mesh, resolution=VOXELS, **DRAFT | {"moves": 0})  # the solid is all
    assert by_sight.result.made.solid.enclosed_fraction > 0.5
    assert by_sight.warnings == ()
    product = produced(mesh, resolution=VOXELS, fill="flood", **DRAFT)
    assert product.accuracies[0].precision > 0.99
    inside = product.result.made.solid.enclosed_fraction
    says = [line for line in product.warnings if "is not watertight" in line]
    if width <= 1.0:
        assert inside > 0.5
        assert not says
    if width >= 2.0:
        assert inside < 0.02
        assert "ground with up y (closes" in says[0]
        # Of the holes that are tried, the widest is 8 voxels.
        assert ("smallest hole" in says[0]) == (width < 8.0)


def test_the_advised_hole_closes_the_box():
    mesh = SHAPES["hole of 3.0 voxels"]()
    closed = produced(mesh, smallest_hole=2.0, resolution=VOXELS, fill="flood", **DRAFT)
    assert closed.result.made.solid.enclosed_fraction > 0.5
    assert closed.warnings == ()


def test_of_nested_shells_the_outermost_is_what_remains():
    product = produced(SHAPES["nested shells, few triangles"]())
    assert product.levels[0].triangles == 12
    assert np.abs(product.occluder.vertices).max(axis=1) == pytest.approx(0.5)
    assert product.accuracies[0].recall == 1.0


def test_a_needle_within_the_budget_is_its_own_occluder():
    """It once ended with no triangle, or with one twenty thousand times too wide."""
    mesh = needle()
    product = produced(mesh)
    assert product.levels[0].triangles == 12
    assert product.levels[0].deviation == 0.0
    assert np.array_equal(product.occluder.vertices, np.unique(mesh.vertices, axis=0))


def test_figures_of_what_no_view_shows_are_said_to_be_none():
    product = produced(needle())
    assert product.accuracies[0].coverage == 0.0
    assert product.verdict.word == "unusable"
    assert "precision and recall say nothing" in product.verdict.reason
    assert not any("precision" in line for line in product.warnings)
    assert produced(SHAPES["cube"](), **DRAFT).verdict.is_good


@pytest.mark.parametrize("length", [100.0, 1e4, 1e6])
def test_a_rod_thinner_than_a_pixel_is_not_made_thicker(length):
    """One of 100 : 1 once had a precision of 0.87, pieced together from dots in pictures."""
    rod = turned(finer(needle(length)))
    product = produced(rod, budget=48, resolution=VOXELS)
    assert 12 <= product.levels[0].triangles <= 48
    across = np.linalg.svd(rod.vertices - rod.vertices.mean(axis=0))[2][1:]
    reach = np.abs((product.occluder.vertices - rod.vertices.mean(axis=0)) @ across.T).max()
    assert reach < 1.5


def test_specks_that_a_hole_closes_hide_nothing_rather_than_too_much():
    """One sees through the cloud that the hole fills; it once left 63 triangles for no recall."""
    product = produced(SHAPES["10,000 specks"](), smallest_hole=0.063)
    assert product.levels[0].triangles == 0
    assert "raise the resolution" in product.warnings[-1]


@pytest.mark.sweep(4)
@pytest.mark.parametrize(
    "options",
    [
        {"viewers": "above"},
        {"ground": True, "lods": 2},
        {"smallest_hole": 0.04, "ground": True},
        {"conservative": True},
        {"shrink": 0.02, "viewers": "above"},
        {"resolution": 3, "budget": 1},
        {"resolution": 1, "trim": "area", "alpha": 1.0},
    ],
    ids=" ".join,
)
@pytest.mark.parametrize("name", WHOLE)
def test_options_on_every_shape(name, options):
    mesh = SHAPES[name]()
    lengths = {
        key: value * float(mesh.extent.max())
        for key, value in options.items()
        if key in ("smallest_hole", "shrink")
    }
    product = produced(mesh, **{"resolution": 16, "views": 8} | DRAFT | options | lengths)
    if product.result.stages.solid.wholly_inside:
        assert product.levels[0].error_bound == 0.0
        if name in CLOSED:
            assert product.accuracies[0].precision == 1.0
        if name in OPEN and "shrink" in options:
            assert product.levels[0].triangles == 0
        elif name in OPEN:  # nothing is inside, so what hides is of the mesh itself
            own = set(map(tuple, mesh.vertices.tolist()))
            assert set(map(tuple, product.levels[0].occluder.vertices.tolist())) <= own
            assert product.levels[0].triangles > 0
            assert product.accuracies[0].precision == 1.0


@pytest.mark.sweep(2)
@pytest.mark.parametrize("name", ["cube", "nested shells", "checkerboard", "voxel faces"])
def test_both_slicers(name):
    try:
        drawn = produced(SHAPES[name](), slicer="gl", **DRAFT)
    except BackendUnavailableError as error:
        pytest.skip(str(error))
    sampled = produced(SHAPES[name](), **DRAFT)
    assert drawn.accuracies[0].recall == pytest.approx(sampled.accuracies[0].recall, abs=0.1)
    assert drawn.accuracies[0].precision > 0.99


def row_of_shapes():
    """Each shape an object ten metres long, in a row along x with gaps of ten metres."""
    meshes = [SHAPES[name]() for name in WHOLE]
    transforms = np.zeros((len(meshes), 4, 4))
    for index, mesh in enumerate(meshes):
        scale = 10.0 / float(mesh.extent.max())
        transforms[index] = np.diag([scale, scale, scale, 1.0])
        transforms[index, :3, 3] = [20.0 * index, 0.0, 0.0] - scale * mesh.bounds[0]
    return scene_of(meshes, range(len(meshes)), transforms, tuple(WHOLE))


@pytest.mark.slow
def test_a_scene_of_all_shapes_loses_nothing_that_is_seen(tmp_path):
    scene = row_of_shapes()
    tree = simplifier.simplify_scene(scene, tmp_path, budget=16, resolution=12, moves=60)
    path = path_of(
        looking((-15.0, 4.0, 4.0), (1.0, 0.0, 0.02)),
        looking((20.0 * len(WHOLE), 6.0, 8.0), (-1.0, 0.0, -0.02)),
        looking((200.0, -20.0, 5.0), (0.5, 1.0, 0.0)),
    )
    flown = fly(scene, tree, path, SMALL)
    assert flown.total.objects.culled > 0
    assert flown.total.objects.lost == 0
