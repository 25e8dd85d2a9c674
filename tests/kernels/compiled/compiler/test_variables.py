"""Variables that are values: results, and references given up as often as they are taken."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba.core.compiler import run_frontend
from numba.core.runtime import _nrt_python, rtsys

from simplifier.kernels.compiled.compiler.variables import single_values
from tests.kernels.compiled.compiler.sample import DECORATORS, both

SOURCE = f"""
import numpy as np
{DECORATORS}

@inner_kernel
def made(count, first):
    found = np.empty(count)
    for place in range(count):
        found[place] = first + place
    return found

@inner_kernel
def longer(one, two):
    if len(one) > len(two):
        return one
    return two

@kernel("float64[:, :], int64[:]")
def walk(given, order):
    # Arrays in branches, in turns of loops, after breaks, replaced, and given on.
    kept = made(3, 0.5)
    total = 0.0
    for turn in range(len(order)):
        kind = order[turn] % 7
        row = given[order[turn] % len(given)]
        if kind == 0:
            fresh = made(turn + 1, 2.0)
            total += fresh[-1]
            if turn > 2:
                continue
            total += fresh.sum()
        elif kind == 1:
            kept = row
        elif kind == 2:
            kept = longer(kept, made(2 * turn, 1.0))
            total += len(kept)
        elif kind == 3:
            pair = (row, made(4, float(turn)))
            for one in range(2):
                part = pair[one % 2]
                total += part[one]
        elif kind == 4 and turn > 4:
            last = made(turn, 9.0)
            total += last[turn // 2]
            break
        elif kind == 5:
            while len(kept) < 9:
                kept = np.append(kept, total)
                if total > 100.0:
                    break
        total += kept[0] + row[0]
    else:
        total += made(5, 3.0)[2]
    return total, kept.copy(), longer(kept, given[0])

@kernel("int64[:]")
def sometimes(order):
    total = 0
    for turn in range(len(order)):
        if order[turn] > 0:
            seen = order[turn]
            held = made(3, float(seen))
        if order[turn] == 0 and turn > 0 and order[turn - 1] > 0:
            total += seen + len(held)
    return total
"""


@pytest.fixture(scope="module")
def functions(tmp_path_factory):
    return both(tmp_path_factory.mktemp("variables"), SOURCE, "walk", "sometimes")


@given(st.lists(st.integers(0, 200), max_size=30))
def test_arrays_are_what_was_written(functions, order):
    given = np.arange(12.0).reshape(4, 3)
    results = [each["walk"](given.copy(), np.array(order, np.int64)) for each in functions]
    for ours, plain in zip(*results, strict=True):
        assert np.array_equal(ours, plain)


@given(st.lists(st.integers(0, 2), max_size=12))
def test_what_is_not_always_assigned_is_what_it_was(functions, order):
    ours, plain = (each["sometimes"](np.array(order, np.int64)) for each in functions)
    assert ours == plain


@given(st.lists(st.integers(0, 200), max_size=30))
def test_every_array_is_freed_once(functions, order):
    given, order = np.arange(12.0).reshape(4, 3), np.array(order, np.int64)
    _nrt_python.memsys_enable_stats()
    before = rtsys.get_allocation_stats()
    for _ in range(3):
        functions[0]["walk"](given, order)
        functions[0]["sometimes"](order % 3)
    after = rtsys.get_allocation_stats()
    assert after.alloc - before.alloc == after.free - before.free
    assert after.mi_alloc - before.mi_alloc == after.mi_free - before.mi_free
    assert after.mi_alloc > before.mi_alloc


def test_those_assigned_once_before_all_that_reads_them_are_found():
    def function(given, flag):
        always = given + 1
        changed = 0
        for turn in range(always):
            inside = turn * always
            if flag:
                branch = inside + 1
                changed += branch
        if flag:
            sometimes = always - given
        if flag:
            changed += sometimes
        return changed + always

    found = single_values(run_frontend(function).blocks, lambda name: False)
    assert {"given", "flag", "always", "turn", "inside", "branch"} <= found
    assert not found & {"changed", "sometimes"}
