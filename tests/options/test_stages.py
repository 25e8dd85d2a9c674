"""Options: ranges checked once, names as users type them, the resolution that a bound needs."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError, replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.errors import OptionError
from simplifier.options.simplify import MOST_LEVELS, MOST_VOXELS, LodOptions
from simplifier.options.stages import (
    ERROR_VOXELS,
    PRESETS,
    Options,
    RefineOptions,
    SectionOptions,
    SelectionOptions,
    SolidOptions,
    fineness,
    make_options,
)

NAN, INF = math.nan, math.inf

RANGES = [
    (SolidOptions, "resolution", 1, 1024),
    (SectionOptions, "directions", 1, 4096),
    (SectionOptions, "direction_samples", 1, 64),
    (SectionOptions, "depths", 1, 1024),
    (SectionOptions, "depth_step", 0.1, 64.0),
    (SectionOptions, "depth_samples", 1, 1024),
    (SelectionOptions, "budget", 1, 100_000),
    (SelectionOptions, "alpha", 0.0, 1.0),
    (SelectionOptions, "views", 1, 4096),
    (SelectionOptions, "exchanges", 0, 10_000),
    (RefineOptions, "moves", 0, 100_000_000),
    (RefineOptions, "searches", 1, 64),
    (RefineOptions, "overcover", 0.0, 100.0),
    (RefineOptions, "precision", 0.0, 1.0),
    (RefineOptions, "views", 1, 4096),
    (RefineOptions, "outlines", 1, 4096),
    (RefineOptions, "rounds", 1, 20),
    (Options, "seed", 0, 2**63 - 1),
]


def lod_options(**changes):
    return LodOptions(**{"lods": 2, **changes})


RANGES += [
    (lod_options, "lods", 1, MOST_LEVELS),
    (lod_options, "pixel_error", 0.01, 1000.0),
    (lod_options, "screen_height", 1, 100_000),
    (lod_options, "fov", 1.0, 179.0),
]


@pytest.mark.parametrize(("kind", "name", "low", "high"), RANGES)
def test_ranges(kind, name, low, high):
    for value in (low, high):
        assert getattr(kind(**{name: value}), name) == value
    step = 1 if isinstance(low, int) else 1e-9
    # A number of 400 digits is too large for a float: it once ended in an OverflowError.
    for value in (low - step, high + step, NAN, INF, -INF, -(10**400), 10**400):
        with pytest.raises(OptionError, match=r"out of range|not a whole number"):
            kind(**{name: value})
    for value in ("7", None, True, [1]):
        with pytest.raises(OptionError):
            kind(**{name: value})


@pytest.mark.parametrize(
    ("kind", "name", "low"), [row[:3] for row in RANGES if isinstance(row[3], int)]
)
def test_whole_numbers_stay_whole(kind, name, low):
    with pytest.raises(OptionError, match="not a whole number; choose"):
        kind(**{name: float(low)})


@pytest.mark.parametrize(
    ("kind", "name", "choices"),
    [
        (SolidOptions, "up", ("x", "y", "z")),
        (SolidOptions, "viewers", ("all", "above", "inside")),
        (SolidOptions, "fill", ("sight", "flood")),
        (Options, "device", ("auto", "cpu", "gpu")),
        (SelectionOptions, "trim", ("gain", "area")),
    ],
)
def test_choices(kind, name, choices):
    for choice in choices:
        assert getattr(kind(**{name: choice}), name) == choice
    for value in ("", "X", "cuda", None, 1):
        with pytest.raises(OptionError, match=f"choose one of {', '.join(choices)}"):
            kind(**{name: value})


def test_messages_name_the_option_the_value_and_the_range():
    with pytest.raises(OptionError, match=r"^budget: 0 is out of range; choose 1 to 100,000$"):
        make_options(1.0, budget=0)
    with pytest.raises(OptionError, match=r"^preset: 'fast' is not known; choose one of draft, "):
        make_options(1.0, preset="fast")


def test_defaults_are_safe_and_frozen():
    options = Options()
    assert options.solid == SolidOptions(64, "y", ground=False)
    assert options.selection.budget == 64
    assert options.seed == 0
    with pytest.raises(FrozenInstanceError):
        options.seed = 1
    with pytest.raises(OptionError):
        replace(options.selection, budget=-1)


def test_names_reach_their_stages():
    options = make_options(
        2.0, budget=7, resolution=33, up="z", ground=True, trim="area", slicer="gl", alpha=0.25,
        moves=11, seed=5,
    )  # fmt: skip
    assert options.solid == SolidOptions(33, "z", ground=True)
    assert options.sections.slicer == "gl"
    selection = options.selection
    assert (selection.budget, selection.alpha, selection.trim) == (7, 0.25, "area")
    assert options.refine.moves == 11
    assert options.seed == 5


def test_presets_spend_more_and_more():
    made = [make_options(1.0, preset=preset) for preset in ("draft", "balanced", "best")]
    assert list(PRESETS) == ["draft", "balanced", "best"]
    work = [(o.sections.directions, o.selection.exchanges, o.refine.moves) for o in made]
    assert work == sorted(work)
    assert work[0] < work[1] < work[2]
    looks = [(o.refine.views, o.refine.rounds) for o in made]
    assert looks[0] < looks[1] <= looks[2]
    assert make_options(1.0) == made[1]


@pytest.mark.parametrize("name", ["smallest_hole", "shrink"])
def test_lengths_of_the_scene(name):
    words = name.replace("_", " ")
    for value in (0, 0.0, 1e-300, 0.5, 2):
        assert getattr(make_options(10.0, **{name: value}).solid, name) == value
    for value in (-1e-9, NAN, INF, "1", None, True):
        with pytest.raises(OptionError, match=rf"^{words}: .* is not a length; give 0 or a pos"):
            make_options(10.0, **{name: value})


def test_a_hole_longer_than_the_mesh():
    assert make_options(2.0, smallest_hole=2.0).solid.smallest_hole == 2.0
    with pytest.raises(OptionError, match=r"^smallest hole: 2.1 is longer than the mesh; .* to 2$"):
        make_options(2.0, smallest_hole=2.1)


def test_what_implies_what():
    plain = make_options(1.0)
    assert plain.solid == SolidOptions()
    assert not plain.solid.wholly_inside
    above = make_options(1.0, viewers="above", up="z")
    assert (above.solid.viewers, above.solid.ground, above.solid.up) == ("above", True, "z")
    shrunk = make_options(1.0, shrink=0.1).solid
    assert shrunk.conservative
    assert shrunk.wholly_inside
    assert SolidOptions(shrink=0.1).wholly_inside
    assert make_options(1.0, conservative=True).solid == SolidOptions(conservative=True)


lengths = st.floats(1e-6, 1e6)


@settings(max_examples=100, deadline=None)
@given(lengths, st.floats(2e-2, 1e3))
def test_the_error_bound_of_a_level_takes_the_least_resolution_that_keeps_it(longest, share):
    bound = longest * share
    resolution = make_options(longest, error_bound=bound, lods=1).solid.resolution
    assert ERROR_VOXELS * longest / resolution <= bound * (1.0 + 1e-8)
    if resolution > 1:
        assert ERROR_VOXELS * longest / (resolution - 1) > bound


@settings(max_examples=60, deadline=None)
@given(lengths, st.integers(1, MOST_VOXELS))
def test_a_bound_that_came_from_a_resolution_gives_it_back(longest, resolution):
    bound = ERROR_VOXELS * (longest / resolution)
    assert make_options(longest, error_bound=bound, lods=1).solid.resolution == resolution


@settings(max_examples=100, deadline=None)
@given(lengths, st.floats(2e-3, 1e3), st.integers(1, MOST_VOXELS) | st.none())
def test_a_bound_leaves_the_grid_alone_where_the_room_keeps_it(longest, share, resolution):
    """The default, or what was chosen, unless its finest room is too coarse for the bound."""
    needed = math.sqrt(3.0) / share
    usual = resolution or 64
    asked = {"error_bound": longest * share, "resolution": resolution}
    if resolution and resolution * fineness(resolution) < needed * (1.0 - 1e-8):
        with pytest.raises(OptionError, match=r"^resolution: .* cannot keep the error bound"):
            make_options(longest, **asked)
        return
    made = make_options(longest, **asked)
    assert made.error_bound == longest * share
    found = made.solid.resolution
    assert found * fineness(found) >= needed * (1.0 - 1e-8)
    assert found == usual or usual * fineness(usual) < needed


def test_a_share_is_one_of_the_longest_edge():
    shared = make_options(40.0, error_share=0.02)
    assert shared == make_options(40.0, error_bound=0.8)
    assert make_options(40.0, error_share=0.02, lods=2) == make_options(
        40.0, error_bound=0.8, lods=2
    )
    with pytest.raises(OptionError, match=r"error share: .*together with an error bound"):
        make_options(1.0, error_share=0.1, error_bound=0.1)


def test_where_nothing_is_moved_the_grid_keeps_the_bound():
    for still in ({"moves": 0}, {"conservative": True}):
        made = make_options(1.0, error_bound=0.02, **still)
        assert made.solid.resolution == math.ceil(ERROR_VOXELS / 0.02)


def test_a_bound_too_fine_says_what_would_do():
    with pytest.raises(
        OptionError, match=r"more than 1024 voxels .*; choose ([\d.e-]+) or more"
    ) as e:
        make_options(10.0, error_bound=1e-3)
    least = float(e.value.remedy.split()[1])
    assert make_options(10.0, error_bound=least * 1.0001).solid.resolution == MOST_VOXELS
    with pytest.raises(OptionError):
        make_options(1e300, error_bound=1e-300)


@pytest.mark.parametrize("bound", [0.0, -1.0, NAN, INF, -INF, "1", None.__class__])
def test_bounds_that_are_no_length(bound):
    with pytest.raises(OptionError, match=r"^error bound: .*out of range; choose a number above 0"):
        make_options(1.0, error_bound=bound)


def test_one_of_bound_and_resolution_for_levels():
    for bound in ({"error_bound": 0.5}, {"error_share": 0.5}):
        with pytest.raises(OptionError, match="cannot be given together with a resolution"):
            make_options(1.0, resolution=64, lods=2, **bound)


def test_error_bounds_of_levels():
    assert LodOptions(error_bounds=(3, 1.0, 2)).error_bounds == (1.0, 2, 3)
    many = tuple(range(1, MOST_LEVELS + 2))
    assert LodOptions(error_bounds=many[:-1]).error_bounds == many[:-1]
    for wrong, words in (
        (many, "17 lengths are given; give 1 to 16"),
        ((), "0 lengths are given"),
        ((1.0, 1), "given twice; give each length once"),
    ):
        with pytest.raises(OptionError, match=f"^error bounds: .*{words}"):
            LodOptions(error_bounds=wrong)
    for value in (-1.0, 0.0, NAN, INF, "1", None, True):
        with pytest.raises(OptionError, match=r"^error bounds: .* choose a number above 0"):
            LodOptions(error_bounds=(1.0, value))


def test_one_of_number_and_bounds_of_levels():
    for both in ({}, {"lods": 2, "error_bounds": (1.0,)}):
        with pytest.raises(OptionError, match="give either a number of levels or their"):
            LodOptions(**both)


@pytest.mark.parametrize("seconds", [0.0, -1.0, NAN, INF, -INF, 10**400, "1", True, 1e7])
def test_times_that_are_no_limit(seconds):
    with pytest.raises(
        OptionError, match=r"^time limit: .*; choose more than 0 and at most 1,000,000"
    ):
        make_options(1.0, time_limit=seconds)


@pytest.mark.parametrize("seconds", [1e-6, 2, 1e6])
def test_time_limits(seconds):
    assert make_options(1.0, time_limit=seconds).time_limit == seconds


def test_one_of_moves_and_time_limit():
    with pytest.raises(OptionError, match="time limit: cannot be given together with moves"):
        make_options(1.0, moves=0, time_limit=1.0)


def test_voxels_are_no_finer_than_pictures_tell():
    assert [fineness(n) for n in (8, 16, 32, 64, 100, 128, 256, 1024)] == [
        4, 4, 4, 4, 2, 2, 1, 1,
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("chosen", "finely"),
    [
        ({}, True),
        ({"overhang": 1.0}, False),
        ({"overhang": 1.0, "error_bound": 1.0}, True),
        ({"moves": 0}, False),
        ({"conservative": True}, False),
    ],
)
def test_triangles_are_marked_in_the_voxels_of_the_room_where_there_is_one(chosen, finely):
    assert make_options(10.0, **chosen).marks_finely is finely
