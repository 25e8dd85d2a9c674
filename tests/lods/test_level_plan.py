"""The plan of levels: resolutions and budgets, and what cannot go together."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.errors import OptionError
from simplifier.geometry.camera import Lens
from simplifier.lods.level_plan import LEAST_BUDGET, LEAST_VOXELS, plan_levels
from simplifier.options.simplify import MOST_VOXELS, LodOptions, SimplifyOptions
from simplifier.options.stages import ERROR_VOXELS, make_options


def grids(plan):
    return [(level.solid.resolution, level.selection.budget) for level in plan.levels]


def test_halves_of_the_finest():
    finest = make_options(2.0, resolution=100, budget=70, ground=True, seed=9)
    plan = plan_levels(2.0, finest, LodOptions(lods=5, pixel_error=2.0, screen_height=720, fov=45))
    assert grids(plan) == [(100, 70), (50, 35), (25, 17), (12, 8), (6, 4)]
    assert plan.levels[0] == finest
    assert all(level.solid.ground and level.seed == 9 for level in plan.levels)
    assert (plan.lens, plan.pixel_error, plan.left_out) == (Lens(720, 45), 2.0, ())


def test_halving_stops_where_the_error_would_be_longer_than_the_mesh():
    plan = plan_levels(1.0, make_options(1.0, resolution=16), LodOptions(lods=6))
    assert [resolution for resolution, _ in grids(plan)] == [16, 8, 4]
    assert [one.resolution for one in plan.left_out] == [2, 1, 1]
    assert all("longer than the mesh" in one.reason for one in plan.left_out)


def test_a_small_budget_stays():
    plan = plan_levels(1.0, make_options(1.0, budget=2), LodOptions(lods=3))
    assert [budget for _, budget in grids(plan)] == [2, 2, 2]


def test_an_error_bound_for_the_finest():
    levels = LodOptions(lods=2)
    plan = plan_levels(1.0, make_options(1.0, lods=2, error_bound=0.1), levels)
    assert [resolution for resolution, _ in grids(plan)] == [35, 17]


def test_bounds_in_any_order():
    levels = LodOptions(error_bounds=(0.4, 0.05, 0.1))
    assert levels.error_bounds == (0.05, 0.1, 0.4)
    finest = make_options(1.0, error_bounds=(0.4, 0.05, 0.1), budget=70)
    assert grids(plan_levels(1.0, finest, levels)) == [(70, 70), (35, 35), (9, 9)]
    assert levels == LodOptions(error_bounds=(0.1, 0.4, 0.05))


def test_bounds_that_take_the_same_grid():
    levels = LodOptions(error_bounds=(0.1, 5.0, 9.0))
    plan = plan_levels(1.0, make_options(1.0, error_bound=0.1), levels)
    assert [resolution for resolution, _ in grids(plan)] == [35, 1]
    (same,) = plan.left_out
    assert (same.resolution, "takes the same grid" in same.reason) == (1, True)


@given(
    st.lists(st.floats(0.004, 10.0), min_size=1, max_size=16, unique=True),
    st.integers(1, 300),
)
def test_any_bounds(bounds, budget):
    levels = LodOptions(error_bounds=tuple(bounds))
    finest = make_options(1.0, error_bounds=tuple(bounds), budget=budget)
    plan = plan_levels(1.0, finest, levels)
    assert len(plan.levels) + len(plan.left_out) == len(bounds)
    resolutions, budgets = zip(*grids(plan), strict=True)
    assert all(a > b for a, b in itertools.pairwise(resolutions))
    assert all(a >= b for a, b in itertools.pairwise(budgets))
    assert min(budgets) >= min(LEAST_BUDGET, budget)
    for resolution in resolutions:
        assert any(ERROR_VOXELS / resolution <= bound * (1.0 + 1e-8) for bound in bounds)


@given(st.integers(1, MOST_VOXELS), st.integers(1, 1000), st.integers(1, 16))
def test_any_number(resolution, budget, count):
    plan = plan_levels(
        1.0, make_options(1.0, resolution=resolution, budget=budget), LodOptions(lods=count)
    )
    assert len(plan.levels) + len(plan.left_out) == count
    assert all(r >= LEAST_VOXELS for r, _ in grids(plan)[1:])
    assert all(1 <= b <= budget for _, b in grids(plan))


@pytest.mark.parametrize("others", [{"resolution": 9}, {"error_bound": 0.1}])
def test_bounds_exclude_another_measure_of_the_finest(others):
    with pytest.raises(OptionError, match="error bounds: cannot be given together with a"):
        SimplifyOptions(error_bounds=(0.1,), **others)


@pytest.mark.parametrize("inside", [{"conservative": True}, {"shrink": 0.01}])
def test_nothing_to_choose_by_where_the_bound_is_0(inside):
    with pytest.raises(OptionError, match=r"lods: .* wholly inside"):
        plan_levels(1.0, make_options(1.0, **inside), LodOptions(lods=2))


def test_a_bound_too_fine_names_the_option():
    with pytest.raises(OptionError, match="would need more than 1024 voxels"):
        make_options(1.0, error_bounds=(1e-9, 0.1))


def test_chosen():
    assert SimplifyOptions().levels is None
    assert SimplifyOptions(lods=3).levels == LodOptions(3)
    chosen = SimplifyOptions(
        error_bounds=(3.0, 1.0, 2.0), pixel_error=2.0, screen_height=720, fov=40.0
    )
    assert chosen.levels == LodOptions(None, (1.0, 2.0, 3.0), 2.0, 720, 40.0)


@pytest.mark.parametrize(
    ("chosen", "words"),
    [
        ({"lods": 3, "error_bounds": (1.0, 2.0)}, "lods: give either"),
        ({"error_bounds": (1.0, 1.0)}, "error bounds: 1.0 is given twice"),
        ({"pixel_error": 2.0}, "pixel error: only levels of detail have one"),
        ({"screen_height": 720}, "screen height: only levels of detail have one"),
        ({"fov": 50.0}, "fov: only levels of detail have one"),
    ],
)
def test_chosen_wrongly(chosen, words):
    with pytest.raises(OptionError, match=words):
        SimplifyOptions(**chosen)
