"""What sticks out: closed forms, other sizes and places, and what the occluders of today do."""

from __future__ import annotations

import numpy as np
import pytest

import simplifier
from simplifier.accuracy.overhang import ACROSS, measure_overhang
from simplifier.errors import MeshError, OptionError
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.views import random_directions
from tests.solids import NOTHING, as_occluder, box, joined, moved, sphere

LINES = random_directions(12, 3)


def test_what_lies_within_has_none():
    for occluder in (as_occluder(sphere(1.0)), as_occluder(sphere(0.7)), NOTHING):
        found = measure_overhang(sphere(1.0), occluder, LINES)
        assert (found.by_view == 0.0).all()
        assert (found.mean, found.worst, found.stick_out) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("larger", [1.05, 1.3, 2.5])
def test_a_larger_sphere_has_a_ring_around(larger):
    """Past the original's sphere the pictures are larger, so the whole ring is counted."""
    found = measure_overhang(sphere(1.0, rings=64), as_occluder(sphere(larger, rings=64)), LINES)
    pixel = 2.0 / ACROSS
    ring = larger**2 - (1.0 + pixel) ** 2
    assert found.by_view == pytest.approx(np.full(12, ring), rel=0.05)
    assert found.stick_out == pytest.approx(larger - 1.0, abs=2.0 * pixel + 0.01)
    assert found.worst == found.by_view[found.worst_view] == found.by_view.max()
    assert found.mean == pytest.approx(found.by_view.mean())


def test_a_spike_is_as_long_as_it_is():
    """Along z it is seen from its side by all who look level, at its full length by some."""
    spike = box((0.1, 0.1, 0.6), (0.45, 0.45, 1.0))
    lines = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    found = measure_overhang(box(), as_occluder(joined(box(), spike)), lines)
    pixel = np.sqrt(3.0) / ACROSS
    assert found.by_view[:2] == pytest.approx(np.full(2, 0.1 * (0.6 - pixel)), rel=0.05)
    assert found.by_view[2] == 0.0
    assert found.stick_out == pytest.approx(0.6, abs=2.0 * pixel)


@pytest.mark.parametrize(("scale", "offset"), [(2.0**-30, 0.0), (2.0**40, 0.0), (1.0, 1024.0)])
def test_any_size_and_place(scale, offset):
    whole, part = sphere(1.0), sphere(1.1)
    here = measure_overhang(whole, as_occluder(part), LINES)
    there = measure_overhang(
        moved(whole, scale, offset), as_occluder(moved(part, scale, offset)), LINES
    )
    assert there.by_view == pytest.approx(here.by_view, abs=1e-3)
    assert there.stick_out == pytest.approx(scale * here.stick_out, rel=1e-2)


def test_where_the_original_shows_nothing_all_of_it_is_overhang():
    square = box((1.0, 1.0, 0.0), without=[0, 1, 2, 3, 4])
    edge_on = np.array([[1.0, 0.0, 0.0]])
    found = measure_overhang(square, as_occluder(box()), edge_on)
    assert found.by_view.tolist() == [1.0]
    assert found.stick_out == 0.0
    assert measure_overhang(square, NOTHING, edge_on).by_view.tolist() == [0.0]


def test_blocks_of_views_change_nothing(monkeypatch):
    mesh, occluder = sphere(1.0), as_occluder(moved(box(), 1.7, -0.6))
    whole = measure_overhang(mesh, occluder, LINES)
    monkeypatch.setattr("simplifier.accuracy.silhouette_views._BLOCK_BYTES", 1)
    parts = measure_overhang(mesh, occluder, LINES)
    assert np.array_equal(whole.by_view, parts.by_view)
    assert whole.stick_out == parts.stick_out > 0.0


def test_what_cannot_be_drawn_is_refused():
    wrong = Occluder(np.full((3, 3), np.nan), np.array([[0, 1, 2]], dtype=np.int32))
    with pytest.raises(MeshError, match="occluder"):
        measure_overhang(sphere(), wrong, LINES)
    with pytest.raises(OptionError, match="length 1"):
        measure_overhang(sphere(), NOTHING, 2.0 * LINES)


def test_a_report_tells_it(tmp_path):
    mesh = sphere(1.0)
    made = simplifier.simplify(mesh, budget=24, resolution=16, preset="draft", views=16)
    report = made.measure().report()
    over, worst = report["overhang"], report["overhang"]["worst_view"]
    found = measure_overhang(mesh, made.occluder, random_directions(16, 0))
    assert over["share"] == pytest.approx(found.mean)
    assert 0.0 < over["share"] <= worst["share"] == found.worst
    assert worst["direction"] == pytest.approx(found.directions[found.worst_view].tolist())
    assert 0.0 < over["stick_out"] <= report["error_bound"]
    inside = simplifier.simplify(
        mesh, budget=24, resolution=16, preset="draft", conservative=True, views=16
    )
    report = inside.measure().report()["overhang"]
    assert (report["share"], report["stick_out"]) == (0.0, 0.0)
