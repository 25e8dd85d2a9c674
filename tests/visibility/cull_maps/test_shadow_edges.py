"""Edges of columns: all steps of the raster, those of one height in a row together."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.visibility.cull_maps.shadow_edges import shadow_edges


def unit_steps(solid):
    """(x0, y0, x1, y1, height, side) of each step between two pixels, one by one."""
    padded = np.pad(solid, 1, constant_values=-np.inf)
    found = set()
    for x in range(solid.shape[0] + 1):
        for y in range(solid.shape[1]):
            one, other = padded[x, y + 1], padded[x + 1, y + 1]
            if one != other:
                found.add((x, y, x, y + 1, float(max(one, other)), 1 if other > one else -1))
    for x in range(solid.shape[0]):
        for y in range(solid.shape[1] + 1):
            one, other = padded[x + 1, y], padded[x + 1, y + 1]
            if one != other:
                found.add((x, y, x + 1, y, float(max(one, other)), 1 if other > one else -1))
    return found


def taken_apart(edges):
    found = []
    for (x0, y0, x1, y1), height, side in zip(
        edges.ends.tolist(), edges.heights.tolist(), edges.sides.tolist(), strict=True
    ):
        for step in range(max(x1 - x0, y1 - y0)):
            if x0 == x1:
                found.append((x0, y0 + step, x0, y0 + step + 1, height, side))
            else:
                found.append((x0 + step, y0, x0 + step + 1, y0, height, side))
    return found


@pytest.mark.parametrize("seed", range(5))
def test_all_steps_once(seed):
    random = np.random.default_rng(seed)
    solid = random.choice([-np.inf, 2.0, 5.0], (9, 6)).astype(np.float32)
    found = taken_apart(shadow_edges(solid))
    assert len(found) == len(set(found))
    assert set(found) == unit_steps(solid)


def test_a_box_has_four():
    solid = np.full((8, 8), -np.inf, dtype=np.float32)
    solid[2:5, 3:7] = 4.0
    edges = shadow_edges(solid)
    assert sorted(edges.ends.tolist()) == [[2, 3, 2, 7], [2, 3, 5, 3], [2, 7, 5, 7], [5, 3, 5, 7]]
    assert set(edges.heights.tolist()) == {4.0}


def test_edges_that_are_hidden_up_to_their_height_are_left_out():
    solid = np.full((8, 8), -np.inf, dtype=np.float32)
    solid[2:5, 3:7] = 4.0
    umbra = np.full((8, 8), np.nan)
    umbra[1, 3:5] = 4.0  # beside half of one edge
    umbra[5, 3:7] = 3.9
    edges = shadow_edges(solid, umbra)
    assert [2, 5, 2, 7] in edges.ends.tolist()
    assert [5, 3, 5, 7] in edges.ends.tolist()
    assert len(edges) == 4
    assert edges.judged.tolist() == [end == [5, 3, 5, 7] for end in edges.ends.tolist()]


def test_nothing_has_none():
    assert len(shadow_edges(np.full((4, 4), -np.inf, dtype=np.float32))) == 0
