"""The look-up grid of visible sets: no cell of a point is missed, and the grid stays small."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.geometry.view_cells import ViewCells
from simplifier.io.pvs_grid import TileGrid, tile_grid
from tests.strategies.visible_sets import points_around, view_cells


def listed_at(grid: TileGrid, point: np.ndarray, kind: type[np.floating]) -> set[int]:
    """What a reader that computes in ``kind`` finds in the tile of a point."""
    place = np.floor((point[:2].astype(kind) - grid.low.astype(kind)) / kind(grid.edge))
    column, row = np.clip(place, 0, np.array(grid.shape) - 1).astype(int)
    tile = column + grid.shape[0] * row
    return set(grid.cells[grid.starts[tile] : grid.starts[tile + 1]].tolist())


@given(view_cells(), st.integers(0, 99))
def test_every_cell_that_holds_a_point_is_in_its_tile(cells, seed):
    grid = tile_grid(cells)
    for point in points_around(cells, np.random.default_rng(seed)):
        holding = set(cells.containing(point).tolist())
        for kind in (np.float64, np.float32):
            assert holding <= listed_at(grid, point, kind)


@given(view_cells())
def test_a_grid_is_small_and_in_order(cells):
    grid = tile_grid(cells)
    columns, rows = grid.shape
    assert columns * rows <= max(2 * len(cells), 1)
    assert len(grid.cells) <= 4 * len(cells)
    assert len(grid.starts) == columns * rows + 1
    for begin, end in zip(grid.starts[:-1], grid.starts[1:], strict=True):
        assert (np.diff(grid.cells[begin:end]) > 0).all()
    assert set(grid.cells.tolist()) == set(range(len(cells)))


def on_ground(low: np.ndarray, high: np.ndarray) -> ViewCells:
    """Boxes by their plans (n, 2), two units high."""
    heights = np.array([[0.0, 2.0]]).repeat(len(low), axis=0)
    return ViewCells.boxes(np.c_[low, heights[:, 0]], np.c_[high, heights[:, 1]])


def square_cells(count: int, edge: float = 1.0, corner: float = 0.0) -> ViewCells:
    """``count`` by ``count`` of them, side by side."""
    places = np.stack(np.meshgrid(np.arange(count), np.arange(count)), axis=-1).reshape(-1, 2)
    return on_ground(corner + edge * places, corner + edge * (places + 1))


@pytest.mark.parametrize(("edge", "corner"), [(1.0, 0.0), (0.1, 500.0), (2.5, -1e4), (1 / 3, 7.0)])
def test_a_regular_grid_gets_about_a_tile_for_four_cells(edge, corner):
    grid = tile_grid(square_cells(40, edge, corner))
    assert grid.shape == (21, 21)
    assert np.diff(grid.starts).max() == 9


@pytest.mark.parametrize("corner", [0.1, 7.3, 1000.1])
def test_a_reader_in_float32_misses_no_cell_that_ends_just_before_a_tile(corner):
    low = np.column_stack([corner + 1.01 * np.arange(300), np.zeros(300)])
    high = low + np.array([0.3, 1.0])
    grid = tile_grid(on_ground(low, high))
    ends = np.ceil((high[:, 0] - grid.low[0]) / grid.edge) * grid.edge + grid.low[0]
    high[1:-1:3, 0] = np.nextafter(ends.astype(np.float32), np.float32(-np.inf))[1:-1:3]
    cells = on_ground(low, high)
    again = tile_grid(cells)
    assert (again.edge, *again.low) == (grid.edge, *grid.low)
    for cell in range(300):
        assert cell in listed_at(again, cells.high[cell], np.float32)


def test_a_huge_cell_among_small_ones_does_not_fill_the_file():
    small = square_cells(30)
    huge = ViewCells.boxes(np.array([[-1e4, -1e4, 0]]), np.array([[1e4, 1e4, 2]]))
    grid = tile_grid(ViewCells.joined(small, huge))
    assert len(grid.cells) <= 4 * 901


@pytest.mark.parametrize("scale", [1e-40, 1e-20, 1.0, 1e20, 9e35])
def test_any_size_of_cells_gives_a_grid(scale):
    cells = ViewCells.boxes(
        scale * np.array([[-1.0, -1, 0], [0, 0, 0], [0.5, 0.5, 0]]),
        scale * np.array([[1.0, 0, 1], [1, 1, 1], [0.75, 1, 1]]),
    )
    grid = tile_grid(cells)
    assert np.isfinite([*grid.low, grid.edge]).all()
    assert grid.edge > 0.0
    for point in points_around(cells, np.random.default_rng(0)):
        assert set(cells.containing(point).tolist()) <= listed_at(grid, point, np.float64)


def test_cells_far_apart_give_few_tiles():
    places = np.array([[0.0, 0], [1, 0], [2, 1], [1e30, 1e30]])
    cells = on_ground(places, places * 1.000001 + 1.0)
    grid = tile_grid(cells)
    assert grid.shape[0] * grid.shape[1] <= 8


def test_no_cells():
    grid = tile_grid(ViewCells.boxes(np.empty((0, 3)), np.empty((0, 3))))
    assert grid.shape == (1, 1)
    assert len(grid.cells) == 0
