"""Sets of objects by cell: what goes in comes out, and what is not known is visible."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.errors import OptionError
from simplifier.geometry.pvs import (
    NEVER,
    Altitudes,
    Rows,
    Slices,
    drawn,
    float32_below,
    pack_rows,
)
from simplifier.geometry.view_cells import ViewCells
from tests.io.damaged_pvs import town

SETS = st.lists(st.booleans(), min_size=0, max_size=400).map(lambda some: np.array(some, bool))


@given(st.lists(SETS, max_size=6))
def test_rows_give_back_what_was_packed_each_once(sets):
    rows, places = pack_rows(sets)
    assert len(rows) == len({each.tobytes().rstrip(b"\0") for each in sets})
    for each, place in zip(sets, places, strict=True):
        assert np.array_equal(rows.row(int(place), len(each)), each)
        assert np.array_equal(rows.places(int(place)), np.flatnonzero(each))


def test_runs_of_any_length():
    visible = np.zeros(3_000_000, bool)
    visible[5] = visible[300:20_000] = visible[2_999_999] = True
    rows, places = pack_rows([visible])
    assert len(rows.data) < 16
    assert np.array_equal(rows.row(int(places[0]), len(visible)), visible)


def test_hidden_objects_at_the_end_may_be_told():
    rows = Rows(b"\1\1\1\2", np.array([0, 3, 4]))
    assert rows.row(0, 4).tolist() == [False, True, False, False]
    assert not rows.row(1, 4).any()
    assert [rows.places(row).tolist() for row in (0, 1)] == [[1], []]


@pytest.mark.parametrize("raw", [b"\x80", b"\x01\xff", b"\x80\x80\x80\x80\x80\x01"])
def test_what_is_no_run_is_refused(raw):
    with pytest.raises(ValueError, match="number"):
        Rows(raw, np.array([0, len(raw)])).row(0, 10)


def pvs(up="z", origin=(0.0, 0.0, 0.0)):
    """Two boxes that overlap, a prism, and a cell that is not computed."""
    return town(
        up=up, origin=np.array(origin), names=("a", "b", "c", "d"), method="cull-map",
        scene=bytes(8), settings=bytes(8), slices=None, altitudes=None,
    )  # fmt: skip


def seen(found):
    return "".join(np.array(list("abcd"))[found])


def test_a_cell_a_point_and_where_two_overlap():
    found = pvs()
    assert [seen(found.visible(cell)) for cell in range(4)] == ["cd", "bc", "abcd", "a"]
    assert seen(found.visible((0.5, 1.0, 1.0))) == "cd"
    assert seen(found.visible((1.5, 1.0, 1.0))) == "c"
    assert seen(found.visible((5.0, 1.0, 1.0))) == "a"
    assert seen(found.visible((5.0, 2.5, 1.0))) == "abcd"  # beside the triangle
    assert seen(found.visible((8.5, 8.5, 0.5))) == "abcd"  # not computed
    assert found.partial


def test_everything_is_visible_outside_of_all_cells_and_above_them():
    found = pvs()
    for point in ((-1.0, 1.0, 1.0), (0.5, 1.0, 2.1), (100.0, 0.0, 0.0)):
        assert found.visible(point).all()


def test_other_axes_and_map_coordinates():
    found = pvs("y", (5e6, 2e6, 100.0))
    # x, y and z of a cell are z, x and y of the world.
    assert seen(found.visible((2e6 + 1.0, 101.0, 5e6 + 0.5))) == "cd"


@pytest.mark.parametrize("where", [-1, 4, (1.0, 2.0), (np.nan, 0.0, 0.0), "here"])
def test_what_is_no_cell_and_no_point_is_refused(where):
    with pytest.raises(OptionError):
        pvs().visible(where)


def test_cells_keep_float32_values_and_empty_ones_are_refused():
    cells = ViewCells.boxes(np.array([[0.1, 0.2, 0.3]]), np.array([[1.1, 1.2, 1.3]]))
    assert (cells.low.astype(np.float32) == cells.low).all()
    for low, high in (
        ([0.0, 0, 0], [1, 0, 1]),
        ([0.0, 0, 0], [1, np.inf, 1]),
        ([2.0, 0, 0], [1, 1, 1]),
    ):
        with pytest.raises(OptionError, match="cell 0"):
            ViewCells.boxes(np.array([low]), np.array([high]))
    with pytest.raises(OptionError, match="cell 0"):
        ViewCells.prisms(np.array([[[0.0, 0], [1, 1], [2, 2]]]), np.zeros(1), np.ones(1))


def test_a_prism_turns_counter_clockwise():
    cells = ViewCells.prisms(np.array([[[0.0, 0], [0, 1], [1, 0]]]), np.zeros(1), np.ones(1))
    assert np.array_equal(cells.outline(0), [[1.0, 0], [0, 1], [0, 0]])


@pytest.mark.parametrize(
    ("value", "ranges"),
    [
        ((0, 0, 0), [(1, 8), (1, 8), (1, 8)]),
        ((3, 0, 0), [(1, 3), (1, 0), (1, 0)]),
        ((-3, 0, 0), [(4, 8), (1, 0), (1, 0)]),
        ((0, -7, 5), [(1, 0), (8, 8), (5, 8)]),
        ((1, 0, 8), [(1, 1), (1, 0), (8, 8)]),
        ((0, 8, 1), [(1, 0), (1, 8), (1, 8)]),
    ],
)
def test_the_slices_that_are_drawn(value, ranges):
    found = drawn(np.array([value], np.int8), 8)
    assert [tuple(each) for each in found[0].tolist()] == ranges


@given(st.integers(1, 9), st.data())
def test_what_is_drawn_is_what_not_all_axes_hide(count, given_data):
    """Held against the sentence itself, part by part of the box."""
    plan, height = st.integers(1 - count, count), st.integers(0, count)
    value = np.array(given_data.draw(st.tuples(plan, plan, height)), np.int8)
    hides = [
        [k != 0 and (part > k if k > 0 else part <= -k) for part in range(1, count + 1)]
        for k in value[:2].tolist()
    ]
    hides.append([part < value[2] for part in range(1, count + 1)])
    used = np.flatnonzero(value)
    ranges = drawn(value[None], count)[0]
    for part in np.ndindex(count, count, count):
        hidden = len(used) > 0 and all(hides[axis][part[axis]] for axis in used)
        inside = [low <= each + 1 <= high for each, (low, high) in zip(part, ranges, strict=True)]
        assert hidden == (not any(inside))


def test_slices_of_a_cell_are_those_of_its_visible_objects():
    values = np.array([[1, 0, 0], [0, 0, 2], [-1, 0, 3], [0, 0, 0], [4, 4, 4]], np.int8)
    found = town(slices=Slices(np.array([0, 2, 4, 4, 5]), values))
    assert found.slices.of(1).tolist() == [[-1, 0, 3], [0, 0, 0]]
    ranges = found.drawn(1)  # b and c
    assert ranges.shape == (4, 3, 2)
    assert (ranges[[0, 3]] == [1, 0]).all()
    assert ranges[1].tolist() == [[2, 8], [1, 0], [3, 8]]
    assert (ranges[2] == [1, 8]).all()
    assert (found.drawn(2) == [1, 8]).all()  # not computed
    whole = pvs().drawn(1)
    assert (whole[[1, 2]] == [1, 1]).all()
    assert (whole[[0, 3]] == [1, 0]).all()
    with pytest.raises(OptionError, match="no cell 4"):
        found.drawn(4)


def test_a_point_sees_what_is_seen_from_its_height():
    values = np.zeros((4, 4), np.uint16)
    values[0] = [NEVER, 0, 3, 4]  # the first cell sees c and d
    values[2] = NEVER  # not computed
    found = pvs()
    found = replace(found, altitudes=Altitudes(0.5, 0.25, values))
    for height, names in ((0.0, ""), (1.24, ""), (1.25, "c"), (1.49, "c"), (1.5, "cd"), (2, "cd")):
        assert seen(found.visible((0.5, 1.0, height))) == names
    assert seen(found.visible(0)) == "cd"
    assert seen(found.visible((8.5, 8.5, 0.5))) == "abcd"
    assert found.altitudes.seen(0, -9.0).tolist() == [False, True, False, False]
    assert found.altitudes.seen(0, 1e9).tolist() == [False, True, True, True]


@given(
    st.lists(st.integers(0, NEVER), max_size=30),
    st.sampled_from([(0.0, 1.0), (0.1, 0.3), (-1e6, 1e-3), (700.0, 500.0)]),
    st.sampled_from([(0.0, 1.0), (-0.3, 0.1), (1e6, 1e3), (0.5, 0.25)]),
)
def test_altitudes_by_other_numbers_are_no_higher(values, one, other):
    low, step = map(float32_below, one)
    new_low, new_step = map(float32_below, other)
    before = Altitudes(low, step, np.array([values], np.uint16))
    after = before.counted(new_low, new_step)
    for k, new in zip(values, after.values[0].tolist(), strict=True):
        assert (new == NEVER) == (k == NEVER)
        if k in (0, NEVER):
            assert new == k
        elif new:
            assert new_low + new * new_step <= low + k * step
            if new < NEVER - 1:
                assert new_low + (new + 1) * new_step > low + k * step - 1e-9 * abs(low)
    assert before.counted(low, step) is before


@given(st.floats(-1e30, 1e30))
def test_the_float32_below(value):
    below = float32_below(value)
    assert below <= value < float(np.nextafter(np.float32(below), np.float32(np.inf)))
