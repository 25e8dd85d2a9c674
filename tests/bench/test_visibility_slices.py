"""What slices save, in a small city."""

from __future__ import annotations

import numpy as np
import pytest

from bench.visibility_city import streets
from bench.visibility_slices import (
    OCTREE_BITS,
    SQUARES,
    scene_slices_row,
    scene_triangles,
    slices_rows,
    triangle_boxes,
    triangles_drawn,
)
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.checking.hidden_parts import hidden_boxes
from simplifier.visibility.find import find_pvs


def test_triangles_are_drawn_where_any_of_their_slices_is():
    boxes = triangle_boxes(4)
    assert len(boxes) == 5 * 4 * 4 * 2
    values = np.array([[0, 0, 0], [0, 0, 5], [-4, 0, 0], [4, 0, 0], [2, 3, 7]], dtype=np.int8)
    whole, top, right, left, corner = triangles_drawn(values, boxes).tolist()
    assert whole == len(boxes)
    # The lower half of four walls, and one wall with half of two and of the roof.
    assert top == len(boxes) - 4 * 16
    assert right == left == len(boxes) - 32 - 3 * 16
    # Six slices along x, five of y and six in height hold 3, 2 and 3 squares of a wall.
    assert corner == len(boxes) - 2 * (3 * 3 + 2 * 3)
    (halves,) = triangles_drawn(np.array([[0, 0, 5]], dtype=np.int8), triangle_boxes()) / (
        10 * SQUARES**2
    )
    assert halves == pytest.approx(0.6, abs=0.02)  # triangles across a border are drawn


def test_a_scene_is_counted_by_its_own_triangles():
    """Plainly, a triangle of a pair after the other; buildings are boxes of 12 triangles."""
    upright, places = streets(2, 2)
    options = PvsOptions(up="z", epsilon=5.0, slices=True)
    pvs = find_pvs(upright, places, options).pvs
    whole = drawn = 0
    for cell in range(len(places)):
        objects = np.flatnonzero(pvs.visible(cell))
        for index, values in zip(objects.tolist(), pvs.slices.of(cell), strict=True):
            (block,) = hidden_boxes(upright.boxes[[index]], values[None])
            mesh = upright.scene.joined([index])
            for face in mesh.faces:
                corners = mesh.vertices[face][:, upright.order] - upright.origin
                within = (corners >= block[0] - 1e-9).all() and (corners <= block[1] + 1e-9).all()
                whole, drawn = whole + 1, drawn + (not within)
    assert 0 < drawn <= whole
    assert scene_triangles(upright, pvs) == (whole, drawn)
    row = scene_slices_row(upright, places, options, 1)
    assert row["triangles_whole"] == whole / 2
    assert row["triangle_bytes"] == drawn / 16
    assert row["octree_bytes"] == len(pvs.slices.values) * OCTREE_BITS / 16
    assert row["leaks"] == 0


@pytest.mark.slow
def test_a_small_city_draws_a_part():
    (row,) = slices_rows(3, 4, (5.0,), 2)
    assert row["leaks"] == 0
    assert 0.2 < row["drawn"] < 0.7
    assert row["triangles_sliced"] < row["triangles_whole"]
    assert row["without_slices"] < row["bytes_a_cell"]
    assert row["octree_bytes"] < row["triangle_bytes"]
