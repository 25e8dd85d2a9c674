"""Sets of objects by cell: what goes in comes out, and what is not known is visible."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.errors import OptionError
from simplifier.geometry.pvs import Rows, pack_rows
from simplifier.geometry.view_cells import ViewCells
from tests.io.damaged_pvs import town

SETS = st.lists(st.booleans(), min_size=0, max_size=400).map(lambda some: np.array(some, bool))


@given(st.lists(SETS, max_size=6))
def test_rows_give_back_what_was_packed_each_once(sets):
    rows, places = pack_rows(sets)
    assert len(rows) == len({each.tobytes().rstrip(b"\0") for each in sets})
    for each, place in zip(sets, places, strict=True):
        assert np.array_equal(rows.row(int(place), len(each)), each)


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


@pytest.mark.parametrize("raw", [b"\x80", b"\x01\xff", b"\x80\x80\x80\x80\x80\x01"])
def test_what_is_no_run_is_refused(raw):
    with pytest.raises(ValueError, match="number"):
        Rows(raw, np.array([0, len(raw)])).row(0, 10)


def pvs(up="z", origin=(0.0, 0.0, 0.0)):
    """Two boxes that overlap, a prism, and a cell that is not computed."""
    return town(
        up=up, origin=np.array(origin), names=("a", "b", "c", "d"), method="cull-map",
        scene=bytes(8), settings=bytes(8),
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
