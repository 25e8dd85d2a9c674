"""What is told of slices and altitudes, along the world's axes."""

from __future__ import annotations

from simplifier.cli.pvs_parts import parts_of, parts_rows
from tests.io.damaged_pvs import town


def test_slices_and_heights_are_told_along_the_world_axes():
    pvs = town()  # y is up: x, y and z of a cell are z, x and y of the world
    assert parts_of(pvs, [0]) == [
        "", "", ": slices z 1 to 3 of 8",
        ": slices x 3 to 8 and y 5 to 8 of 8; seen from 100.5 up",
    ]  # fmt: skip
    assert parts_of(pvs, [2]) == parts_of(pvs, []) == [""] * 4
    assert parts_of(pvs, [2, 0]) == parts_of(pvs, [0])


def test_there_is_nothing_to_tell_of_a_file_without():
    plain = town(slices=None, altitudes=None)
    assert parts_rows(plain) == []
    assert parts_of(plain, [0]) == [""] * 4
    only = parts_of(town(altitudes=None), [3])
    assert only == ["", "", "", ""]  # 8 of 8 along x: all of it


def test_the_rows_of_a_file():
    assert parts_rows(town()) == [
        ("slices", "8 along each axis; 60.0 % of what is visible is drawn in part"),
        ("altitudes", "steps of 0.25, from 100 up"),
    ]
