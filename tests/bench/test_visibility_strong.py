"""The tables on strong occluders: the paper's scenes, and figures near its own."""

from __future__ import annotations

import numpy as np
import pytest

from bench.visibility_strong import (
    BASE,
    PAPER_BOXES,
    city_rows,
    level_rows,
    paper_cells,
    paper_city,
    rank_rows,
    sphere_rows,
)


def test_the_city_is_as_large_as_the_papers():
    boxes = paper_city()
    assert len(boxes) == 3324
    size = boxes[:, 1] - boxes[:, 0]
    assert np.count_nonzero(np.isclose(size[:, 0] * size[:, 1], BASE**2)) == 2496 - 414
    assert size[:, 2].min() >= 200.0
    assert size[:, 2].max() <= 900.0
    cells = paper_cells(80.0)
    assert len(cells) == 25
    assert cells.low.min() == -200.0
    assert cells.high[:, :2].max() == 200.0
    assert not ((boxes[:, 0, :2] < 200.0) & (boxes[:, 1, :2] > -200.0)).all(axis=1).any()


def test_as_much_is_hidden_as_the_paper_says():
    for row in city_rows((10, 50), rows=2):
        assert row["boxes"] == pytest.approx(PAPER_BOXES[row["cell"]], rel=0.05)
        assert row["tests"] == pytest.approx(row["paper_tests"], rel=0.15)
        assert row["strict_boxes"] <= row["boxes"] <= row["by_pieces_too"]
        assert row["our_tests"] < 0.3 * row["tests"]


@pytest.mark.slow
def test_two_levels_take_fewer_tests_for_the_same_sets():
    rows = list(level_rows(5))
    assert all(row["same_sets"] for row in rows)
    assert rows[0]["ratio"] <= 0.42


def test_near_occluders_are_the_strong_ones():
    leading, any_line = rank_rows((20,), rows=1)
    for row in (leading, any_line):
        assert row["1"] > row["2"] > row["3"] > row["4"]
    assert leading["1"] > any_line["1"]  # fewer candidates before it
    assert leading["1"] == pytest.approx(leading["paper_1"], rel=0.1)


def test_spheres_hide_as_the_paper_says():
    (row,) = sphere_rows((10,), seeds=1)
    assert row["spheres"] == pytest.approx(row["paper_spheres"], rel=0.1)
    assert row["our_tests"] < row["tests"]
