"""Elements, rows and lengths of arrays, against numpy's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.kernels.compiled.compiler.sample import DECORATORS, both

SOURCE = f"""
import numpy as np
{DECORATORS}

@kernel("int64[:, :, :], int64, int64, int64")
def elements(table, one, two, three):
    table[one, two, three] += 1000
    row = table[one]
    column = row[two]
    column[three] += 10000
    table[-1, 0, two] += 3
    for place in range(len(table)):
        table[place, -1, place - 1] += place
        table[place][two][-1 - place] += 7 * place
    for place in range(-2, 2):
        table[place, place, place] += 11
    for place in range(two, 3):
        table[0, place, 2 * place % 4] += 13
    return row.size + 10 * column.size + 100 * len(column) + row.strides[0], row.shape, table.shape

@kernel("int64[:, :, :], int64, int64, int64")
def slices(table, one, two, three):
    part = table[one:]
    turned = table[:, two].T
    total = 0
    for place in range(len(part)):
        total += part[place, two, three] + part[place][two][three]
    return total, turned.shape, turned[0, 0], turned[three].sum(), part[-1].sum()

@kernel("float32[:, :], uint8[:], int32[:]")
def other_indices(table, small, signed):
    return table[small[0], signed[0]] + table[small[1]][signed[1]]
"""


@pytest.fixture(scope="module")
def functions(tmp_path_factory):
    return both(tmp_path_factory.mktemp("arrays"), SOURCE, "elements", "slices", "other_indices")


@pytest.mark.parametrize("name", ["elements", "slices"])
@given(st.integers(-3, 2), st.integers(-4, 3), st.integers(-5, 4))
def test_they_are_those_of_numpy(functions, name, one, two, three):
    found = []
    for each in functions:
        table = np.arange(3 * 4 * 5).reshape(3, 4, 5)
        found.append((each[name](table, one, two, three), table.tolist()))
    assert found[0] == found[1]


def test_indices_of_other_types_name_the_same(functions):
    table = np.arange(12, dtype=np.float32).reshape(3, 4)
    small, signed = np.array([2, 1], np.uint8), np.array([-1, 3], np.int32)
    ours, plain = (each["other_indices"](table, small, signed) for each in functions)
    assert ours == plain == 11 + 7
