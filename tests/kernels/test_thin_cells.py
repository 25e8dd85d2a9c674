"""Sums by cell of a lattice, beside a plain dictionary."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.kernels.thin import sum_up_cells


def plain_sums(vertices, low, unit, size, shape, steps, border):
    """The same, vertex by vertex."""
    cells = {}
    for index, vertex in enumerate(vertices):
        place = (vertex - low) / unit
        cell = np.clip((place / size).astype(int), 0, shape - 1)
        cells.setdefault(int(cell @ steps), []).append((index, place))
    found = np.empty(len(vertices), dtype=int)
    counts, sums = [], []
    for number, name in enumerate(sorted(cells)):
        found[[index for index, _ in cells[name]]] = number
        standing = [place for index, place in cells[name] if border[index]]
        standing = standing or [place for _, place in cells[name]]
        counts.append(len(standing))
        total = np.zeros(3)
        for place in standing:
            total += place
        sums.append(total)
    return found, counts, sums


@given(
    st.integers(0, 2**32 - 1), st.integers(1, 200), st.integers(1, 5_000),
    st.sampled_from([1.0, 0.37]), st.booleans(), st.sampled_from([0.0, 0.1, 0.5, 1.0]),
)  # fmt: skip
def test_as_the_plain_one(seed, count, cells, unit, upright, share):
    random = np.random.default_rng(seed)
    vertices, low = random.random((count, 3)) * (1.0, 2.0, 0.3) + 5.0, np.full(3, 5.0)
    shape = random.integers(1, cells + 1, 3)
    steps = np.array([1, shape[0], shape[0] * shape[1]])
    if upright:
        steps = np.array([shape[1] * shape[2], shape[2], 1])
    border = random.random(count) < share
    given_ = (vertices, low, unit, 1.9 / (unit * cells), shape, steps, border)
    place, counts, sums = sum_up_cells(*given_)
    expected = plain_sums(*given_)
    assert place.dtype == np.int32
    assert place.tolist() == expected[0].tolist()
    assert counts.tolist() == expected[1]
    assert np.array_equal(sums, expected[2])
    if share == 0.0:
        assert all(map(np.array_equal, sum_up_cells(*given_[:-1]), (place, counts, sums)))


@pytest.mark.parametrize("cells", [1, 64])
def test_as_many_cells_as_there_may_be(cells):
    vertices = np.ascontiguousarray(np.indices((4, 4, 4)).reshape(3, -1).T + 0.5)
    shape = np.full(3, round(cells ** (1 / 3)))
    steps = np.array([1, shape[0], shape[0] ** 2])
    place, counts, _ = sum_up_cells(vertices, np.zeros(3), 1.0, 4.0 / shape[0], shape, steps)
    assert counts.tolist() == [64 // cells] * cells
    assert np.bincount(place).tolist() == counts.tolist()
