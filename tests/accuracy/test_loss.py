"""Where recall is lost: meshes of which the answer is known, other sizes, places and turns."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.accuracy.accuracy import view_masks
from simplifier.accuracy.depth_views import ACROSS
from simplifier.accuracy.loss import CELLS, measure_loss
from simplifier.errors import MeshError, OptionError
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.views import random_directions
from tests.solids import NOTHING, as_occluder, blob, box, joined, moved

LINES = random_directions(24, 3)
PAIR = joined(box((1.0, 1.0, 1.0), (-2.0, 0.0, 0.0)), box((1.0, 1.0, 1.0), (1.0, 0.0, 0.0)))


def test_what_covers_all_loses_nothing_and_nothing_loses_all() -> None:
    mesh = blob()
    kept, lost = (measure_loss(mesh, one, LINES) for one in (as_occluder(mesh), NOTHING))
    assert (kept.share, lost.share) == (0.0, 1.0)
    assert (kept.seen == lost.seen).all()
    assert np.isnan(kept.shares[CELLS // 2, CELLS // 2, CELLS // 2])  # inside
    assert np.nanmin(lost.shares) == 1.0


def test_all_pixels_of_the_silhouettes_are_counted() -> None:
    mesh, occluder = PAIR, as_occluder(box((1.0, 1.0, 1.0), (1.0, 0.0, 0.0)))
    found = measure_loss(mesh, occluder, LINES)
    original, hidden = view_masks(mesh, occluder, LINES, ACROSS)
    assert found.seen.sum() == original.sum()
    assert found.lost.sum() == (original & ~hidden).sum()


def test_the_loss_lies_where_the_occluder_is_not() -> None:
    """One of two boxes is left out: it is lost wherever the other does not stand before or behind
    it, and of the other nothing is lost."""
    found = measure_loss(PAIR, as_occluder(box((1.0, 1.0, 1.0), (1.0, 0.0, 0.0))), LINES)
    left, right = found.shares[: CELLS // 2], found.shares[CELLS // 2 :]
    assert np.nanmax(right) == 0.0
    assert np.nanmean(left) > 0.9


@pytest.mark.parametrize("side", [0, 1])
def test_a_wall_of_two_triangles_shows_its_halves_apart(side: int) -> None:
    wall = box((2.0, 2.0, 0.0), without=[0, 1, 2, 3, 4])
    half = as_occluder(box((1.0, 2.0, 0.0), (1.0 * side, 0.0, 0.0), without=[0, 1, 2, 3, 4]))
    found = measure_loss(wall, half, np.array([[0.0, 0.0, 1.0]]))
    with np.errstate(invalid="ignore"):
        of_cells = found.lost.sum(axis=(1, 2)) / found.seen.sum(axis=(1, 2))
    middle = CELLS // 2
    kept = of_cells[middle:] if side else of_cells[:middle]
    lost = of_cells[:middle] if side else of_cells[middle:]
    assert np.nanmax(kept) == 0.0
    assert np.nanmin(lost) == 1.0


def test_the_far_side_of_what_is_seen_counts_for_nothing() -> None:
    """From before, only the front is seen, though the back is lost as well."""
    found = measure_loss(box(), NOTHING, np.array([[0.0, 0.0, 1.0]]))
    seen = np.flatnonzero(found.seen.sum(axis=(0, 1)))
    assert seen.max() < CELLS // 2


def test_of_another_size_and_place_it_is_the_same() -> None:
    mesh, far = blob(), (5_176_000.0, -3.5, 1_841_000.0)
    hidden = box((1.0, 1.0, 1.0), (-0.5, -0.5, -0.5))
    one = measure_loss(mesh, as_occluder(hidden), LINES)
    other = measure_loss(moved(mesh, 4.0, far), as_occluder(moved(hidden, 4.0, far)), LINES)
    assert other.share == pytest.approx(one.share, abs=1e-4)
    assert np.abs(one.seen - other.seen).sum() < 1e-3 * one.seen.sum()


def test_what_cannot_be_measured_is_refused() -> None:
    broken = Occluder(np.full((3, 3), np.inf), np.array([[0, 1, 2]], dtype=np.int32))
    with pytest.raises(MeshError, match="finite"):
        measure_loss(box(), broken, LINES)
    with pytest.raises(OptionError, match="length 1"):
        measure_loss(box(), NOTHING, 2.0 * LINES)
