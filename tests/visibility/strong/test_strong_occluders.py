"""Strong occluders: what one convex body hides from a whole cell, by any tactics."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.visibility_city import generated_city, street_cells
from simplifier.geometry.view_cells import ViewCells
from simplifier.kernels.hull_rays import ALL_PIECES, NO_PIECES, meets
from simplifier.visibility.strong import strong_occluders
from simplifier.visibility.strong.convex_bodies import ConvexBodies
from simplifier.visibility.strong.strong_occluders import (
    StrongOccluders,
    Tactics,
    TwoLevels,
    cell_of,
    margin_of,
    pairs_of,
    parents_of,
)

TACTICS = [
    Tactics(hull, cache, dilute, group, NO_PIECES)
    for hull, cache, dilute, group in product([False, True], [0, 4], [False, True], [1, 64])
]
WHOLE = Tactics(pieces=NO_PIECES)


def plain_meets(box, a, b):
    """Whether a segment has a point in the open box (2, 3); whole numbers make it exact."""
    enter, leave = 0.0, 1.0
    for low, high, start, end in zip(*box, a, b, strict=True):
        if start == end:
            if not low < start < high:
                return False
            continue
        s, t = sorted(((low - start) / (end - start), (high - start) / (end - start)))
        enter, leave = max(enter, s), min(leave, t)
    return enter < leave


def corners(box):
    return np.array(list(product(*np.transpose(box))), dtype=np.float64)


def open_apart(first, second):
    return (first[1] <= second[0]).any() or (first[0] >= second[1]).any()


def plain_hidden(boxes, cell, points):
    """By all segments from the corners of a cell to those of each box."""
    found = np.zeros(len(boxes), dtype=np.bool_)
    usable = [box for box in boxes if open_apart(box, [points.min(axis=0), points.max(axis=0)])]
    for index, target in enumerate(boxes):
        if not ((target[1] < cell[0]).any() or (target[0] > cell[1]).any()):
            continue
        segments = list(product(points, corners(target)))
        found[index] = any(all(plain_meets(box, a, b) for a, b in segments) for box in usable)
    return found


@st.composite
def scenes(draw):
    """Whole boxes (n, 2, 3) in front of, beside and over a cell (2, 3)."""
    generator = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    count = draw(st.integers(2, 9))
    low = generator.integers(-2, 13, (count, 3))
    size = generator.integers(1, 12, (count, 3))
    walls = generator.random(count) < 0.4
    low[walls] = generator.integers([1, -12, -12], [6, -4, -4], (np.count_nonzero(walls), 3))
    size[walls] = generator.integers([1, 10, 10], [3, 20, 20], (np.count_nonzero(walls), 3))
    boxes = np.stack([low, low + size], axis=1).astype(np.float64)
    cell = np.array([generator.integers(-6, 3, 3), np.zeros(3)], dtype=np.float64)
    cell[1] = cell[0] + generator.integers(1, 5, 3)
    return boxes, cell


def cells_of(cell):
    return ViewCells.boxes(cell[None, 0], cell[None, 1])


@settings(max_examples=60, deadline=None)
@given(scenes())
def test_any_tactics_hide_what_all_segments_say(scene):
    boxes, cell = scene
    occluders, expected = StrongOccluders.of_boxes(boxes), plain_hidden(boxes, cell, corners(cell))
    for tactics in TACTICS:
        assert np.array_equal(occluders.hide(cells_of(cell), tactics).hidden[0], expected), tactics


@settings(max_examples=40, deadline=None)
@given(scenes(), st.integers(0, 3))
def test_prisms_hide_what_all_segments_say(scene, cut):
    boxes, cell = scene
    plan = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])[np.arange(4) != cut]
    triangle = cell[0, :2] + plan * (cell[1] - cell[0])[:2]
    points = np.array([[*corner, z] for corner in triangle for z in cell[:, 2]])
    prism = ViewCells.prisms(triangle[None], cell[:1, 2], cell[1:, 2])
    expected = plain_hidden(boxes, cell, points)
    for hull in (False, True):
        tactics = Tactics(hull, 4, True, 64, NO_PIECES)
        found = StrongOccluders.of_boxes(boxes).hide(prism, tactics).hidden[0]
        assert not (expected & ~found).any()  # the box around a prism may touch what it does not
        more = StrongOccluders.of_boxes(boxes).hide(prism, Tactics(False, 0, False, 1, NO_PIECES))
        assert np.array_equal(found, more.hidden[0])


@settings(max_examples=60, deadline=None)
@given(scenes(), st.integers(0, 2**32 - 1))
def test_no_line_reaches_what_is_hidden(scene, seed):
    boxes, cell = scene
    generator = np.random.default_rng(seed)
    found = StrongOccluders.of_boxes(boxes).hide(cells_of(cell), WHOLE)
    for target in np.flatnonzero(found.hidden[0]):
        body = boxes[found.by[0, target]]
        starts = generator.uniform(*cell, (40, 3))
        ends = generator.uniform(*boxes[target], (40, 3))
        assert all(plain_meets(body, a, b) for a, b in zip(starts, ends, strict=True))


def wall(width, top=10.0):
    """A cell of 2 x 2 x 2 at the origin, a wall at 10, and a house of 2 x 2 x 2 behind it at 20."""
    boxes = np.array(
        [[[10, -0.5 * width, -1], [11, 0.5 * width, top]], [[20, -1, 0], [22, 1, 2]]],
        dtype=np.float64,
    )
    return boxes, np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 2.0]])


def hides(boxes, cell, tactics=WHOLE):
    return bool(StrongOccluders.of_boxes(boxes).hide(cells_of(cell), tactics).hidden[0, 1])


def test_a_wall_hides_once_it_is_wider_than_the_bridge():
    assert not hides(*wall(2.0))  # lines along the edges of both touch it in a face alone
    assert hides(*wall(2.000001))
    assert not hides(*wall(1.99))
    assert not hides(*wall(3.0, top=2.0))
    assert hides(*wall(3.0, top=2.000001))


def test_what_stands_in_the_cell_is_visible_and_hides_nothing():
    boxes, cell = wall(6.0)
    boxes[0, :, 0] -= 9.5
    assert not hides(boxes, cell)
    boxes[0, :, 0] += 0.5  # it touches the border
    assert hides(boxes, cell)
    inside = np.concatenate([boxes, [[[0.0, 0.0, 0.0], [0.5, 0.5, 0.5]]]])
    assert not StrongOccluders.of_boxes(inside).hide(cells_of(cell)).hidden[0, 2]


def test_a_plate_through_the_target_hides_its_back_alone():
    """All bridges to a small target end at its back: only a body clear of it may be judged so."""
    boxes = np.array([[[20.5, -5, -5], [21.0, 5, 5]], [[20, -1, 0], [22, 1, 2]]], dtype=np.float64)
    cell = np.array([[-1.0, -3.0, -1.0], [1.0, 3.0, 3.0]])
    assert not hides(boxes, cell)
    occluders = StrongOccluders.of_boxes(boxes)
    points, rays = corners(boxes[1]), corners(cell)
    bodies = occluders.bodies
    bridged = [
        meets(bodies.kinds[0], bodies.planes, 0, 6, rays[i], points[j], 1e-8)
        for i, j in ((i, i) for i in range(8) if points[i, 0] == 22.0)
    ]
    assert all(bridged)


def chipped(boxes, cell, corner):
    """The wall without the chip that the bridge between two corners of a number goes through."""
    a, b = corners(cell)[corner], corners(boxes[1])[corner]
    at = a + (10.5 - a[0]) / (b[0] - a[0]) * (b - a)
    outwards = np.array([0.0, *np.sign(at[1:] - [0.0, 1.0])]) / np.sqrt(2.0)
    planes = ConvexBodies.of_boxes(boxes[:1], 0.0).planes
    planes = np.concatenate([planes, [[*outwards, outwards @ at - 0.05]]])
    body = ConvexBodies.of_volume(planes, boxes[0], 1e-8)
    starts = np.zeros(3, dtype=np.int64)
    return StrongOccluders(body, boxes, np.array([0, 1, 1]), starts, np.empty((0, 3, 3)))


def test_a_hull_vertex_left_out_is_found(monkeypatch):
    boxes, cell = wall(20.0)
    boxes[1] = [[20.0, -0.5, 0.5], [21.0, 0.5, 1.5]]
    boxes[0, 0, 2] = -10.0
    assert hides(boxes, cell)
    whole, bridging = strong_occluders.pairs_of, [4, 5, 6, 7]
    for corner in bridging:
        one = chipped(boxes, cell, corner)
        assert not one.hide(cells_of(cell), WHOLE).hidden.any()
        monkeypatch.setattr(
            strong_occluders,
            "pairs_of",
            lambda *some, out=corner: tuple(
                part[whole(*some)[0][:, 1] != out] for part in whole(*some)
            ),
        )
        assert one.hide(cells_of(cell), WHOLE).hidden[0, 1]
        monkeypatch.setattr(strong_occluders, "pairs_of", whole)


def test_a_margin_of_the_wrong_sign_is_found(monkeypatch):
    monkeypatch.setattr(strong_occluders, "MARGIN", -1e-9)
    with pytest.raises(AssertionError):
        test_a_wall_hides_once_it_is_wider_than_the_bridge()


def test_corners_that_are_furthest_in_common_directions():
    _, cell = wall(2.0)
    pairs, _ = pairs_of(cells_of(cell), 0)
    points = cell_of(cells_of(cell), 0, 0.0)[0]
    assert len(pairs) == 8
    for mine, other in pairs:
        assert np.array_equal(points[mine] > [0.0, 0.0, 1.0], corners(cell)[other] > [0, 0, 1])
    prism = ViewCells.prisms(np.array([[[0.0, 0], [4, 1], [1, 3]]]), np.zeros(1), np.ones(1))
    (pairs, cones), points = pairs_of(prism, 0), cell_of(prism, 0, 0.0)[0]
    around = np.linspace(0.0, 2.0 * np.pi, 700)
    for x, y, z in product(np.cos(around[::7]), np.sin(around[::7]), (-1.0, 1.0)):
        best = int(np.argmax(points @ [x, y, z]))
        there = 4 * (x > 0) + 2 * (y > 0) + (z > 0)
        if abs(x) > 1e-3 and abs(y) > 1e-3 and np.ptp(np.sort(points @ [x, y, z])[-2:]) > 1e-3:
            assert [best, there] in pairs.tolist()
    assert cones.shape == (len(pairs), 3, 3)


def plain_flat(corners_of, a, b):
    """Whether a segment goes through a triangle, by three signed volumes."""

    def volume(p, q, r, s):
        return np.linalg.det(np.array([q - p, r - p, s - p]))

    first, second = volume(*corners_of, a), volume(*corners_of, b)
    turns = [volume(a, b, corners_of[i], corners_of[(i + 1) % 3]) for i in range(3)]
    return first * second < 0.0 and (min(turns) > 0.0 or max(turns) < 0.0)


def test_triangles_and_spheres_are_met_as_plainly_told():
    generator = np.random.default_rng(1)
    hits = 0
    for _ in range(400):
        a, b, *three = generator.uniform(-1.0, 1.0, (5, 3))
        flat = ConvexBodies.of_triangles(np.array([three]), 1e-9)
        expected = plain_flat(three, a, b)
        assert meets(flat.kinds[0], flat.planes, 0, 4, a, b, 1e-9) == expected
        ball = ConvexBodies.of_spheres(three[0][None], 0.4, 1e-9)
        along = a + np.linspace(0.0, 1.0, 2001)[:, None] * (b - a)
        near = np.linalg.norm(along - three[0], axis=1).min()
        if abs(near - 0.4) > 1e-3:
            assert meets(ball.kinds[0], ball.planes, 0, 1, a, b, 1e-9) == (near < 0.4)
        hits += expected
    assert hits > 20
    assert len(ConvexBodies.of_triangles(np.zeros((2, 3, 3)), 1e-9)) == 0


@pytest.mark.parametrize("hull", [False, True])
def test_a_triangle_hides_as_a_wall_does(hull):
    boxes, cell = wall(2.0)
    big = np.array([[[10.0, -20, -5], [10, 20, -5], [10, 0, 30]]])
    bodies = ConvexBodies.of_triangles(big, 1e-8)
    starts = np.array([0, 1, 1])
    one = StrongOccluders(bodies, boxes, starts, np.zeros(3, np.int64), np.empty((0, 3, 3)))
    tactics = Tactics(hull=hull, pieces=NO_PIECES)
    assert one.hide(cells_of(cell), tactics).hidden[0].tolist() == [False, True]
    small = ConvexBodies.of_triangles(0.08 * big + [9.2, 0.0, 0.0], 1e-8)
    one = StrongOccluders(small, boxes, starts, np.zeros(3, np.int64), np.empty((0, 3, 3)))
    assert not one.hide(cells_of(cell), tactics).hidden.any()


def test_pieces_are_hidden_each_by_a_body_of_its_own():
    """Two walls side by side, none of which hides the long house behind by itself."""
    walls = np.array([[[10.0, -20, -1], [11, 1.5, 20]], [[12.0, -1.5, -1], [13, 20, 20]]])
    house = np.array([[[20.0, -8, 0], [22, 8, 2]]])
    boxes = np.concatenate([walls, house])
    left, right = [20.0, -8, 0], [20.0, 8, 0]
    pieces = np.array([[left, [20, -0.2, 0], [20, -8, 2]], [right, [20, 0.2, 0], [20, 8, 2]]])
    starts = np.array([0, 0, 0, 2])
    bodies = ConvexBodies.of_boxes(walls, margin_of(boxes))
    one = StrongOccluders(bodies, boxes, np.array([0, 1, 2, 2]), starts, pieces)
    cell = cells_of(np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 2.0]]))
    assert not one.hide(cell, WHOLE).hidden.any()
    found = one.hide(cell, Tactics())
    assert found.hidden[0].tolist() == [False, False, True]
    assert found.by[0, 2] == -1
    pieces[1, :, 1] += 15.0
    pieces[1, 1, 1] = -8.0
    one = StrongOccluders(bodies, boxes, np.array([0, 1, 2, 2]), starts, pieces)
    found = one.hide(cell, Tactics(pieces=ALL_PIECES))
    assert found.pieces[0].tolist() == [True, False]
    assert not found.hidden.any()


def rows_of_houses(pitch=20.0, reach=14):
    x, y = np.meshgrid(*2 * [np.arange(-reach, reach + 1)], indexing="ij")
    low = np.stack([pitch * x.ravel(), pitch * y.ravel(), np.full(x.size, -1.0)], axis=1)
    low = low[(np.abs(low[:, :2]) > 21.0).any(axis=1)]
    return np.stack([low, low + np.array([10.0, 10.0, 30.0])], axis=1)


def test_two_levels_hide_the_same_by_fewer_tests():
    boxes = rows_of_houses()
    low = np.stack(np.meshgrid(*2 * [np.arange(-6.0, 6.0, 1.0)], indexing="ij"), -1).reshape(-1, 2)
    low = np.column_stack([low, np.zeros(len(low))])
    cells = ViewCells.boxes(low, low + 1.0)
    occluders = StrongOccluders.of_boxes(boxes)
    single = occluders.hide(cells, WHOLE)
    levels = TwoLevels(occluders, cells, WHOLE)
    hidden = np.concatenate(
        [levels.hidden(np.arange(40)), levels.hidden(np.arange(40, len(cells)))]
    )
    assert np.array_equal(hidden, single.hidden)
    assert single.hidden.mean() > 0.3
    assert levels.work[0] < 0.75 * single.work[:, 0].sum()
    parents, owner = parents_of(cells, 6.0)
    for cell, one in enumerate(owner):
        assert (parents.low[one] <= cells.low[cell]).all()
        assert (parents.high[one] >= cells.high[cell]).all()


def test_fewer_tests_are_for_the_hull_what_is_hidden_and_groups():
    boxes = rows_of_houses()
    cell = cells_of(np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 2.0]]))
    occluders = StrongOccluders.of_boxes(boxes)

    def work(*tactics):
        return occluders.hide(cell, Tactics(*tactics, NO_PIECES)).work[0]

    plain = work(False, 0, False, 1)
    assert work(True, 0, False, 1)[0] < 0.3 * plain[0]
    assert work(True, 0, True, 1)[0] <= work(True, 0, False, 1)[0]
    city = generated_city(12)
    occluders = StrongOccluders.of_boxes(city.bounds() - np.array([0.0, 0.0, 1e-3]))
    cell = street_cells(city, 1, 2.5)
    one, groups = work(True, 4, True, 1), work(True, 4, True, 64)
    assert groups[0] < one[0]
    assert groups[1] < 0.7 * one[1]
