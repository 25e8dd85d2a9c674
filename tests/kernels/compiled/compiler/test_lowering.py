"""Kernels that are compiled from fewer instructions, against the functions they were written as."""

from __future__ import annotations

import gc
import sys

import numpy as np
import pytest

from simplifier.kernels.compiled.loading import load_code
from tests.kernels.compiled.compiler.sample import DECORATORS, compile_sample, written

SAMPLE = f"""
import numpy as np
{DECORATORS}

@inner_kernel
def add_up(pair, scale, power):
    return (pair[0] + pair[1]) * scale**power

@kernel("float64[:, :, :], int64[:], int32[:], float32[:]")
def mixed(solid, order, small, fine):
    # Negative indices, rows, constants beside int32, references that a loop takes and gives back.
    rows = np.zeros((3, 2))
    last = solid[0]
    for place in range(len(order)):
        layer = solid[order[place]]
        layer[-1, -1] += fine[-1] * small[place]
        rows[place] = layer[0]
        if layer[0, 0] > last[0, 0]:
            last = layer
        total = add_up((layer[0, 0], layer[1, -1]), small[place], 2)
        total += add_up((layer[0, 0], layer[1, -1]), 3, place)
        solid[-1, place % 2, -2] = total
    first = np.argsort(rows[:, 0])
    rows[:2] = rows[first[1:]]
    return rows, last.copy(), first

@kernel("float64[:, :], float64[:, :]")
def put(table, given):
    table[:] = given

@inner_kernel
def last_of(tables, place):
    return tables[place][-1]

@kernel("float64[:, :], float64[:, :], int64")
def one_of(first, second, place):
    own = np.zeros((2, 2))
    own[:] = first[:2]
    row = last_of((first, second, own), place)
    row += 1.0
    return row
"""
# Its rows and tuples are of what it was given.
LENT = f"""
{DECORATORS}

@inner_kernel
def add_row(tables, row, sums):
    one, two, three = tables[0][row], tables[1][row], tables[2][row]
    for place in range(len(sums)):
        sums[place] += one[place] + two[place] + three[place]

@kernel("float64[:, :], (float64[:, :], float64[:, :]), float64[:, :]")
def add_rows(first, others, sums):
    for row in range(len(sums)):
        add_row((first, *others), row, sums[row])
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """With the kernels of both samples as machine code."""
    folder = tmp_path_factory.mktemp("lowering")
    compile_sample(folder, {"kernels": SAMPLE, "lent": LENT})
    return folder


@pytest.fixture(scope="module")
def compiled(folder):
    return load_code(folder / "kernels.o", ["mixed", "put", "one_of"])


def test_they_give_what_was_written(compiled):
    order, small = np.array([2, 0, 1]), np.array([1, 2, 3], np.int32)
    fine = np.array([0.5, 0.25], np.float32)
    results = []
    for functions in (compiled, written(SAMPLE)):
        solid = np.random.default_rng(4).random((3, 4, 2))
        results.append((*functions["mixed"](solid, order, small, fine), solid))
    for ours, wanted in zip(*results, strict=True):
        assert np.array_equal(ours, wanted)


def test_arrays_of_another_shape_are_refused(compiled):
    table = np.zeros((3, 2))
    compiled["put"](table, np.ones((1, 2)))
    assert table.all()
    with pytest.raises(ValueError, match="cannot assign an array of another shape"):
        compiled["put"](table, np.ones((2, 2)))


def test_an_array_that_a_function_returns_is_kept(compiled):
    first, second = np.zeros((3, 2)), np.ones((3, 2))
    count = sys.getrefcount(second)
    rows = [compiled["one_of"](first, second, place) for place in range(3)]
    del first  # of which the first row is a part
    gc.collect()
    assert np.array_equal(rows, [[1.0, 1.0], [2.0, 2.0], [1.0, 1.0]])
    assert rows[1].base is not None
    assert np.array_equal(second[-1], rows[1])
    del rows
    assert sys.getrefcount(second) == count


def test_what_a_kernel_is_given_is_not_counted(folder):
    first, others, sums = np.ones((4, 2)), (np.ones((4, 2)), np.full((4, 2), 3.0)), np.zeros((4, 2))
    load_code(folder / "lent.o", ["add_rows"])["add_rows"](first, others, sums)
    assert (sums == 5.0).all()
    assert b"NRT_incref" in (folder / "kernels.o").read_bytes()
    assert b"NRT_incref" not in (folder / "lent.o").read_bytes()
