"""The CPU slicer: its kernels against plain numpy, pixel for pixel."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.solid import VoxelGrid
from simplifier.geometry.views import image_axes, random_directions
from simplifier.options.stages import SectionOptions
from simplifier.slicing.planes import plan_sections
from simplifier.slicing.sampler import GridSampler
from tests.slicing.frames import every_depth_plan


def grid_of(inside):
    return VoxelGrid(np.array(inside, dtype=np.bool_), np.zeros(3), 1.0)


def read_at_centres(inside, frame, depth):
    """The mask by plain indexing, and each pixel's distance from the next lattice plane."""
    rows, columns = np.indices((frame.rows, frame.columns))
    a = frame.corner[0] + frame.pixel * (columns + 0.5)
    b = frame.corner[1] + frame.pixel * (rows + 0.5)
    u, v, d = frame.axes
    points = a[..., None] * u + b[..., None] * v + depth * d
    cells = np.floor(points).astype(np.int64)
    known = ((cells >= 0) & (cells < inside.shape)).all(axis=-1)
    cells[~known] = 0
    mask = inside[tuple(np.moveaxis(cells, -1, 0))] & known
    return mask, np.abs(points - np.round(points)).min(axis=-1)


def check_plan(grid, plan):
    sampler = GridSampler(grid)
    areas = sampler.areas(plan)
    masks = sampler.masks(plan, np.arange(len(plan)))
    assert areas.dtype == np.int64
    assert areas.tolist() == [int(mask.sum()) for mask in masks]
    for index, mask in enumerate(masks):
        frame = plan.frames[plan.frame_of[index]]
        expected, clearance = read_at_centres(grid.inside, frame, plan.depths[index])
        assert mask.dtype == np.bool_
        assert mask.shape == expected.shape
        assert not ((mask != expected) & (clearance > 1e-6)).any()


@settings(max_examples=40, deadline=None)
@given(
    st.tuples(*[st.integers(1, 17)] * 3),
    st.floats(0.1, 1.0),
    st.floats(0.3, 2.0),
    st.integers(0, 2**32 - 1),
)
def test_random_solids(shape, density, step, seed):
    grid = grid_of(np.random.default_rng(seed).random(shape) < density)
    check_plan(grid, plan_sections(grid, SectionOptions(directions=4, depths=3, depth_step=step)))


@pytest.mark.parametrize("pixel", [0.37, 1.0, 2.5])
def test_frames_of_any_pixel_size_that_miss_or_pass_the_grid(pixel):
    grid = grid_of(np.random.default_rng(4).random((7, 9, 5)) < 0.6)
    axes = image_axes(np.concatenate([random_directions(6, 0), np.eye(3), -np.eye(3)]))
    for corner in ((-12.3, -11.7), (2.1, 1.3), (40.0, 0.0)):
        check_plan(grid, every_depth_plan(axes, corner, 23, 31, pixel, (-20.0, -1.3, 2.2, 5.7)))


def test_directions_almost_parallel_to_an_axis():
    """Steps of 1e-17 to 1e-3 along one axis: the range of columns must not overflow or miss."""
    grid = grid_of(np.random.default_rng(2).random((16, 16, 16)) < 0.5)
    tilts = np.array([[t, s, 1.0] for t in (0, 1e-17, 1e-9, -1e-3) for s in (0, -1e-12, 1e-5)])
    directions = tilts / np.linalg.norm(tilts, axis=1, keepdims=True)
    for turned in (directions, directions[:, [2, 0, 1]], directions[:, [1, 2, 0]]):
        check_plan(
            grid,
            every_depth_plan(image_axes(turned), (-20.25, -20.25), 41, 41, 1.0, (-7.5, 0.5, 7.25)),
        )


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_axis_sections_are_the_layers_of_the_grid(axis):
    inside = np.random.default_rng(8).random((6, 7, 8)) < 0.5
    grid = grid_of(inside)
    plan = plan_sections(grid, SectionOptions(directions=1))
    planes = np.nonzero(plan.frame_of == axis)[0]
    assert GridSampler(grid).areas(plan)[planes].tolist() == [
        int(layer.sum()) for layer in np.moveaxis(inside, axis, 0)
    ]


def test_masks_come_in_the_order_of_the_planes_asked_for():
    grid = grid_of(np.random.default_rng(3).random((9, 9, 9)) < 0.5)
    plan = plan_sections(grid, SectionOptions(directions=2))
    sampler = GridSampler(grid)
    every = sampler.masks(plan, np.arange(len(plan)))
    order = np.random.default_rng(0).permutation(len(plan))[:20]
    for index, mask in zip(order, sampler.masks(plan, order), strict=True):
        assert np.array_equal(mask, every[index])
    assert sampler.masks(plan, np.empty(0, dtype=np.int64)) == []


def test_areas_do_not_depend_on_the_number_of_threads(monkeypatch):
    grid = grid_of(np.random.default_rng(6).random((30, 25, 20)) < 0.4)
    plan = plan_sections(grid, SectionOptions())
    results = []
    for threads in ("1", "2", "7"):
        monkeypatch.setenv("OCCLUDER_THREADS", threads)
        results.append(GridSampler(grid).areas(plan).tobytes())
    assert results[0] == results[1] == results[2]


def test_slices_integrate_to_the_volume():
    """Areas times the distance of the planes sum to the volume, whatever the direction."""
    ball = ((np.indices((40, 40, 40)) + 0.5 - 20) ** 2).sum(axis=0) < 18**2
    grid = grid_of(ball)
    plan = plan_sections(grid, SectionOptions(directions=8, depth_step=0.5))
    areas = GridSampler(grid).areas(plan)
    for index in range(len(plan.frames)):
        mine = plan.frame_of == index
        step = np.diff(plan.depths[mine])[0]
        assert areas[mine].sum() * step == pytest.approx(grid.count, rel=0.01)
