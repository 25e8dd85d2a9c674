"""Where the solid is cut: directions, frames, depths and bins."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.solid import VoxelGrid
from simplifier.options.stages import SectionOptions
from simplifier.slicing.planes import plan_sections


def plan_of(shape, **options):
    grid = VoxelGrid(np.ones(shape, dtype=np.bool_), np.zeros(3), 1.0)
    return plan_sections(grid, SectionOptions(**options))


def corners_of(shape):
    return np.stack(np.meshgrid(*[(0.0, s) for s in shape], indexing="ij"), axis=-1).reshape(-1, 3)


shapes = st.tuples(*[st.integers(1, 40)] * 3)
choices = st.fixed_dictionaries(
    {
        "directions": st.integers(1, 12),
        "direction_samples": st.integers(1, 4),
        "depths": st.integers(1, 9),
        "depth_step": st.floats(0.2, 5.0),
    }
)


@settings(max_examples=60, deadline=None)
@given(shapes, choices)
def test_plan_is_well_formed(shape, options):
    plan = plan_of(shape, **options)
    n = len(plan)
    assert plan.frame_of.shape == plan.bin_of.shape == plan.depths.shape == (n,)
    assert plan.frame_of.dtype == plan.bin_of.dtype == np.int32
    assert (np.diff(plan.frame_of) >= 0).all()
    assert np.array_equal(np.unique(plan.frame_of), np.arange(len(plan.frames)))
    assert len(plan.frames) == 3 + options["directions"] * options["direction_samples"]
    assert 0 <= plan.bin_of.min() <= plan.bin_of.max() < plan.bins
    assert plan.bins % options["depths"] == 0
    assert plan.bins <= (3 + options["directions"]) * options["depths"]


@settings(max_examples=60, deadline=None)
@given(shapes, choices)
def test_every_frame_holds_the_grid_with_less_than_a_pixel_to_spare(shape, options):
    plan = plan_of(shape, **options)
    corners = corners_of(shape)
    for frame in plan.frames:
        np.testing.assert_allclose(frame.axes @ frame.axes.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(frame.axes) == pytest.approx(1.0)
        seen = corners @ frame.axes[:2].T
        size = np.array([frame.columns, frame.rows]) * frame.pixel
        assert (seen.min(axis=0) >= frame.corner - 1e-6).all()
        assert (seen.max(axis=0) <= frame.corner + size + 1e-6).all()
        spare = size - np.ptp(seen, axis=0)
        assert (spare < frame.pixel + 1e-6).all()
        np.testing.assert_allclose(
            frame.corner + size / 2, (seen.min(axis=0) + seen.max(axis=0)) / 2, atol=1e-9
        )


@settings(max_examples=60, deadline=None)
@given(shapes, choices)
def test_depths_cover_the_solid_evenly_and_no_further_apart_than_asked(shape, options):
    plan = plan_of(shape, **options, depth_samples=1024)
    for index, frame in enumerate(plan.frames):
        depths = plan.depths[plan.frame_of == index]
        reach = corners_of(shape) @ frame.axes[2]
        low, high = reach.min(), reach.max()
        step = 1.0 if index < 3 else options["depth_step"]
        gaps = np.diff(np.concatenate([[2 * low - depths[0]], depths, [2 * high - depths[-1]]]))
        np.testing.assert_allclose(gaps, gaps[0], atol=1e-9)
        assert gaps[0] <= step + 1e-6
        # No more planes than needed: one fewer would be too far apart.
        assert len(depths) == 1 or (high - low) / (len(depths) - 1) > step - 1e-6
        assert low < depths[0]
        assert depths[-1] < high


@settings(max_examples=60, deadline=None)
@given(shapes, choices)
def test_bins_are_equal_depth_ranges_of_near_directions(shape, options):
    plan = plan_of(shape, **options)
    bins = options["depths"]
    for index, frame in enumerate(plan.frames):
        mine = plan.frame_of == index
        reach = corners_of(shape) @ frame.axes[2]
        share = (plan.depths[mine] - reach.min()) / np.ptp(reach) * bins
        slot = plan.bin_of[mine] % bins
        assert ((share - slot >= -1e-6) & (share - slot <= 1 + 1e-6)).all()
        assert len(np.unique(plan.bin_of[mine] // bins)) == 1
    owner = np.array([plan.bin_of[plan.frame_of == i][0] // bins for i in range(len(plan.frames))])
    assert owner[:3].tolist() == [0, 1, 2]
    assert np.array_equal(np.unique(owner), np.arange(owner.max() + 1))


@settings(max_examples=60, deadline=None)
@given(shapes, choices, st.integers(1, 5))
def test_no_more_planes_than_the_samples_of_the_depth_bins(shape, options, samples):
    plan = plan_of(shape, **options, depth_samples=samples)
    for index, frame in enumerate(plan.frames):
        depths = plan.depths[plan.frame_of == index]
        reach = corners_of(shape) @ frame.axes[2]
        assert 1 <= len(depths) <= samples * options["depths"]
        assert reach.min() < depths.min() <= depths.max() < reach.max()
        assert index >= 3 or np.array_equal(depths % 1.0, np.full(len(depths), 0.5))


@pytest.mark.parametrize("shape", [(1, 1, 1), (5, 1, 8), (16, 31, 2)])
def test_axis_planes_and_pixels_run_through_voxel_centres(shape):
    plan = plan_of(shape)
    for axis in range(3):
        frame = plan.frames[axis]
        assert np.abs(frame.axes[2]).tolist() == np.eye(3)[axis].tolist()
        depths = plan.depths[plan.frame_of == axis]
        np.testing.assert_allclose(depths, np.arange(shape[axis]) + 0.5)
        index = int(np.nonzero(plan.frame_of == axis)[0][0])
        rows, columns = np.indices((frame.rows, frame.columns)).reshape(2, -1)
        centres = frame.corner + frame.pixel * np.stack([columns + 0.5, rows + 0.5], axis=1)
        points = plan.plane(index).to_space(centres)
        np.testing.assert_allclose(points % 1.0, 0.5)
        assert sorted([frame.rows, frame.columns]) == sorted(np.delete(shape, axis).tolist())


def test_directions_of_a_bin_are_near_each_other_and_point_the_same_way():
    """Named for the horizon: there d and -d are one bin, and their depths ran in opposite order."""
    plan = plan_of((20, 20, 20), directions=16, direction_samples=4, depths=1)
    directions = np.array([frame.axes[2] for frame in plan.frames[3:]])
    owner = np.array([plan.bin_of[plan.frame_of == i + 3][0] for i in range(len(directions))])
    for bin_ in np.unique(owner):
        mine = directions[owner == bin_]
        # Sixteen bins share half a sphere: each is about 40 degrees wide.
        assert np.degrees(np.arccos(np.clip(mine @ mine.T, -1.0, 1.0))).max() < 60.0


def test_more_of_everything_gives_more_planes():
    base = {"directions": 4, "direction_samples": 2, "depths": 4, "depth_step": 2.0}
    count = len(plan_of((30, 20, 10), **base))
    assert len(plan_of((30, 20, 10), **(base | {"directions": 8}))) > count
    assert len(plan_of((30, 20, 10), **(base | {"direction_samples": 4}))) > count
    assert len(plan_of((30, 20, 10), **(base | {"depth_step": 1.0}))) > count


def test_same_input_gives_the_same_plan():
    first, second = plan_of((9, 8, 7)), plan_of((9, 8, 7))
    for name in ("frame_of", "bin_of", "depths"):
        assert getattr(first, name).tobytes() == getattr(second, name).tobytes()
