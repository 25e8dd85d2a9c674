"""The slice of largest area in each bin, whatever the slicer."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.solid import VoxelGrid
from simplifier.options.stages import SectionOptions
from simplifier.slicing.planes import SamplingPlan, plan_sections
from simplifier.slicing.sampler import GridSampler
from simplifier.slicing.sections import best_sections

GRID = VoxelGrid(np.ones((6, 5, 4), dtype=np.bool_), np.zeros(3), 1.0)


class ScriptedSlicer:
    """Answers with given areas, and with masks that carry the index of their plane."""

    def __init__(self, areas):
        self._areas = np.asarray(areas, dtype=np.int64)
        self.asked = []

    def areas(self, plan, tell=None):
        assert len(self._areas) == len(plan)
        return self._areas

    def masks(self, plan, planes):
        self.asked.append(planes.tolist())
        return [np.full((1, int(index) + 1), True) for index in planes]


def plan_with(bins):
    """One direction; plane i has depth i and lies in bin ``bins[i]``."""
    frames = plan_sections(GRID, SectionOptions(directions=1, direction_samples=1)).frames
    n = len(bins)
    return SamplingPlan(
        frames,
        np.zeros(n, dtype=np.int32),
        np.array(bins, dtype=np.int32),
        np.arange(n, dtype=np.float64),
        max(bins, default=0) + 1,
    )


def chosen(bins, areas):
    sections = best_sections(plan_with(bins), ScriptedSlicer(areas))
    assert [s.mask.shape[1] - 1 for s in sections] == [s.plane.depth for s in sections]
    return [int(s.plane.depth) for s in sections]


def test_largest_of_each_bin_in_the_order_of_the_bins():
    assert chosen([2, 2, 0, 0, 1], [3, 9, 5, 4, 7]) == [2, 4, 1]


def test_first_of_equal_slices_is_kept():
    assert chosen([0, 0, 0, 1, 1], [4, 6, 6, 2, 2]) == [1, 3]


def test_bins_without_a_covered_pixel_give_nothing():
    assert chosen([0, 0, 1, 1], [0, 0, 0, 1]) == [3]
    assert chosen([0, 1, 2], [0, 0, 0]) == []


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 4)), min_size=1, max_size=40))
def test_choice_matches_a_plain_loop(planes):
    best = {}
    for index, (owner, area) in enumerate(planes):
        if area > 0 and (owner not in best or area > planes[best[owner]][1]):
            best[owner] = index
    bins, areas = zip(*planes, strict=True)
    assert chosen(list(bins), areas) == [best[owner] for owner in sorted(best)]


def test_masks_are_asked_for_once_and_only_for_the_chosen():
    slicer = ScriptedSlicer([1, 2, 3, 0])
    best_sections(plan_with([0, 0, 1, 2]), slicer)
    assert slicer.asked == [[1, 2]]


@pytest.mark.parametrize("step", [1.0, 0.4])
def test_sections_of_a_solid_are_maximal_and_carry_their_frame(step):
    inside = np.random.default_rng(1).random((12, 9, 10)) < 0.7
    grid = VoxelGrid(inside, np.zeros(3), 1.0)
    plan = plan_sections(grid, SectionOptions(directions=5, depths=4, depth_step=step))
    slicer = GridSampler(grid)
    areas = slicer.areas(plan)
    sections = best_sections(plan, slicer)
    largest = [areas[plan.bin_of == b].max(initial=0) for b in range(plan.bins)]
    assert [int(s.mask.sum()) for s in sections] == [area for area in largest if area > 0]
    for section in sections:
        frame = next(f for f in plan.frames if f.axes is section.plane.axes)
        assert section.mask.shape == (frame.rows, frame.columns)
        assert section.mask.dtype == np.bool_
        assert section.pixel == frame.pixel
        assert np.array_equal(section.corner, frame.corner)


def test_empty_solid_has_no_section():
    grid = VoxelGrid(np.zeros((5, 4, 3), dtype=np.bool_), np.zeros(3), 1.0)
    plan = plan_sections(grid, SectionOptions(directions=3))
    assert best_sections(plan, GridSampler(grid)) == []
