"""Loops over ranges, against Python's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.kernels.compiled.compiler.sample import DECORATORS, both

COLLECTING = """
@kernel("int64, int64, int64, int64[:]")
def {name}(start, stop, step, found):
    count = 0
    for number in {numbers}:
        found[count] = number
        count += 1
    return count
"""
COLLECTED = {
    "to_stop": "range(stop)",
    "from_start": "range(start, stop)",
    "by_step": "range(start, stop, step)",
}
SOURCE = f"""
import numpy as np
{DECORATORS}

@kernel("int64, int64, int64, int64[:]")
def backwards(start, stop, step, found):
    count = 0
    for number in range(stop, start, -2):
        if number == 3:
            continue
        if number == -7:
            break
        found[count] = number
        count += 1
    else:
        found[count] = 1000
        count += 1
    return count

@kernel("int64, int64, int64, int64[:]")
def again(start, stop, step, found):
    numbers = range(start, stop)
    count = 0
    for turn in range(2):
        for number in numbers:
            found[count] = number + len(found[:turn])
            count += 1
    return count

@kernel("int32[:], uint8[:]")
def of_other_integers(many, flags):
    total = 0
    for one in range(many[0]):
        total += one * many[one]
    for one in range(flags[0]):
        total += 100 * one
    for one in range(np.uint64(3)):
        total += 10000 * np.int64(one)
    return total
""" + "".join(COLLECTING.format(name=name, numbers=text) for name, text in COLLECTED.items())
NAMES = (*COLLECTED, "backwards", "again")


@pytest.fixture(scope="module")
def functions(tmp_path_factory):
    return both(tmp_path_factory.mktemp("ranges"), SOURCE, *NAMES, "of_other_integers")


@pytest.mark.parametrize("name", NAMES)
@given(
    st.integers(-20, 20), st.integers(-20, 20), st.integers(-9, 9).filter(lambda step: step != 0)
)
def test_they_run_through_the_same_numbers(functions, name, start, stop, step):
    found = []
    for each in functions:
        numbers = np.full(100, 77)
        count = each[name](start, stop, step, numbers)
        found.append((count, *numbers))
    assert found[0] == found[1]


def test_integers_of_other_types_end_them(functions):
    many, flags = np.array([4, 7, -2, 5], np.int32), np.array([6], np.uint8)
    ours, plain = (each["of_other_integers"](many, flags) for each in functions)
    assert ours == plain == 1 * 7 - 2 * 2 + 3 * 5 + 1500 + 30000


def test_a_step_of_zero_is_an_error(functions):
    with pytest.raises(ValueError, match="must not be zero"):
        functions[0]["by_step"](0, 3, 0, np.zeros(9, np.int64))
