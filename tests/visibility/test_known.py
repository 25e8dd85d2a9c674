"""Slices and altitudes on their way from a method to the file, and from a file to its successor."""

from __future__ import annotations

import threading
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from bench.visibility_city import scene_of_boxes
from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.pvs import NEVER, Slices
from simplifier.geometry.view_cells import ViewCells
from simplifier.options.visibility import PvsOptions
from simplifier.visibility import find
from simplifier.visibility.method import Seen, Sight

OPTIONS = PvsOptions(up="z", method="cull-map")
COUNT = 5


@pytest.fixture
def town():
    """Five boxes in a row, upright."""
    low = np.column_stack([4.0 * np.arange(COUNT), np.zeros(COUNT), np.zeros(COUNT)])
    boxes = np.stack([low, low + 1.0], axis=1)
    return UprightScene.of(scene_of_boxes(boxes, [f"box {i}" for i in range(COUNT)]), "z")


def cells(first, last):
    """Cells beside the boxes, each with its number."""
    x = np.arange(first, last, dtype=np.float64)
    low = np.column_stack([x, np.full(len(x), 5.0), np.zeros(len(x))])
    return ViewCells.boxes(low, low + 1.0)


def seen_of(number):
    """What the method made up here sees from a cell: a set, slices and altitudes of its own."""
    visible = np.arange(COUNT) % 2 == number % 2
    slices = np.column_stack([np.arange(COUNT) - 2, np.full(COUNT, number), np.arange(COUNT)])
    altitudes = np.arange(COUNT) * 100 + number
    altitudes[0], altitudes[1] = 0, NEVER
    return visible, slices.astype(np.int8), altitudes.astype(np.uint16)


def method(*, slices=True, altitudes=True, low=0.0, step=0.5):
    """Sees what :func:`seen_of` tells, by the cells' places."""

    @contextmanager
    def by_lot(task):
        def see(chosen):
            numbers = task.cells.low[chosen, 0].astype(int).tolist()
            visible, cut, from_heights = map(np.array, zip(*map(seen_of, numbers), strict=True))
            return Seen(visible, cut if slices else None, from_heights if altitudes else None)

        yield Sight(
            "slice-wise", task.cells, see, 2, True, "", list, altitude_low=low, altitude_step=step
        )

    return by_lot


def found(monkeypatch, town, where, before=None, **given):
    monkeypatch.setitem(find.METHODS, "cull-map", method(**given))
    return find.find_pvs(town, where, OPTIONS, before).pvs


def check(pvs, number, cell):
    visible, slices, altitudes = seen_of(number)
    assert (pvs.visible(cell) == visible).all()
    assert (pvs.slices.of(cell) == slices[visible]).all()
    assert (pvs.altitudes.values[cell] == altitudes).all()


def test_they_are_collected_and_kept_where_a_file_is_continued(monkeypatch, town):
    first = found(monkeypatch, town, cells(2, 5))
    assert (first.altitudes.low, first.altitudes.step) == (0.0, 0.5)
    for cell in range(3):
        check(first, 2 + cell, cell)
    both = found(monkeypatch, town, cells(0, 6), first)
    for cell in range(6):
        check(both, cell, cell)
    monkeypatch.setattr("tests.visibility.test_known.seen_of", None)  # nothing is looked at again
    again = found(monkeypatch, town, cells(1, 4), both)
    monkeypatch.undo()
    for cell in range(3):
        check(again, 1 + cell, cell)


def test_there_are_none_where_the_method_has_none(monkeypatch, town):
    plain = found(monkeypatch, town, cells(0, 3), slices=False, altitudes=False)
    assert (plain.slices, plain.altitudes) == (None, None)


def test_what_was_found_without_is_drawn_as_a_whole_and_seen_from_every_height(monkeypatch, town):
    plain = found(monkeypatch, town, cells(0, 2), slices=False, altitudes=False)
    both = found(monkeypatch, town, cells(0, 4), plain)
    assert (both.slices.of(0) == 0).all()
    assert len(both.slices.of(0)) == both.visible(0).sum()
    assert (both.altitudes.values[:2] == 0).all()
    check(both, 3, 3)


def test_altitudes_are_counted_anew_where_the_lowest_one_changes(monkeypatch, town):
    first = found(monkeypatch, town, cells(0, 2))
    both = found(monkeypatch, town, cells(0, 4), first, low=-1.0, step=1.0)
    assert (both.altitudes.low, both.altitudes.step) == (-1.0, 1.0)
    assert both.altitudes.values[0].tolist() == [0, NEVER, 101, 151, 201]  # -1 + 101 is 0 + 200 / 2
    assert both.altitudes.values[1].tolist() == [0, NEVER, 101, 151, 201]  # 201 / 2, rounded down
    check(both, 3, 3)


def test_numbers_that_are_no_float32_are_taken_from_below(monkeypatch, town):
    pvs = found(monkeypatch, town, cells(0, 2), low=0.1, step=0.3)
    assert 0.1 - 1e-8 < pvs.altitudes.low < 0.1
    assert pvs.altitudes.low == np.float32(pvs.altitudes.low)
    assert 0.3 - 1e-7 < pvs.altitudes.step <= 0.3
    assert pvs.altitudes.step == np.float32(pvs.altitudes.step)


def test_another_number_of_slices_is_drawn_as_a_whole(monkeypatch, town):
    first = found(monkeypatch, town, cells(0, 2))
    other = replace(first, slices=Slices(first.slices.starts, first.slices.values, 16))
    both = found(monkeypatch, town, cells(0, 3), other)
    assert (both.slices.of(1) == 0).all()
    check(both, 2, 2)


def test_a_cell_that_is_not_computed_has_none(monkeypatch, town):
    cancel = threading.Event()
    monkeypatch.setitem(find.METHODS, "cull-map", method())
    pvs = find.find_pvs(
        town,
        cells(0, 3),
        OPTIONS,
        None,
        find.Watch(cancel=cancel, tell=lambda done, _: done and cancel.set()),
    ).pvs
    assert pvs.computed.tolist() == [1]  # the one in the middle comes first
    check(pvs, 1, 1)
    assert len(pvs.slices.of(2)) == 0
    assert (pvs.altitudes.values[2] == 0).all()
    assert (pvs.drawn(2) == [1, 8]).all()
