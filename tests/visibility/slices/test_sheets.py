"""Sheets that close shafts, beside sampled lines of sight, and with faults put into the kernel."""

from __future__ import annotations

import inspect

import numpy as np
import pytest

from simplifier.kernels import sheets as kernels
from simplifier.visibility.slices.box_tree import tree_over
from simplifier.visibility.slices.sheets import Sheets

VIEWERS = np.array([0.0, -1.0, -1.0, 1.0, 1.0, 1.0])
TARGETS = np.array([20.0, -1.0, -1.0, 22.0, 1.0, 1.0])


def wavy(at=10.0, half=6.0, steps=8, wave=2.0, turn=0.7):
    """An open sheet across the x axis, neither flat nor along any axis; (points, faces)."""
    y, z = np.meshgrid(np.linspace(-half, half, steps + 1), np.linspace(-half, half, steps + 1))
    x = at + turn * y + wave * np.sin(0.9 * y + 0.4 * z)
    points = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    corner = (np.arange(steps)[:, None] * (steps + 1) + np.arange(steps)).ravel()
    below, beside = corner + steps + 1, corner + 1
    first = np.column_stack([corner, beside, below])
    second = np.column_stack([beside, below + 1, below])
    return points, np.concatenate([first, second]).astype(np.int32)


def further(points, x):
    return points + np.array([x, 0.0, 0.0])


def closing(points, faces, a=VIEWERS, b=TARGETS, close=kernels.close):
    sheets = Sheets.of(np.asarray(points, dtype=np.float64), np.asarray(faces))
    known, share = np.full(len(sheets), -1, np.int32), np.zeros(1)
    found = close(
        a, b, sheets.points, sheets.faces, sheets.normals, sheets.beside, sheets.boxes,
        sheets.children, known, share,
    )  # fmt: skip
    assert (known == -1).all()
    return found


def crossed(starts, ends, points, faces):
    """(k,) whether each line meets a triangle; T. Moeller and B. Trumbore (1997), plainly."""
    a, b, c = (np.asarray(points)[np.asarray(faces)[:, corner]] for corner in range(3))
    way = (ends - starts)[:, None]
    across = np.cross(way, c - a)
    det = (across * (b - a)).sum(axis=2)
    offset = starts[:, None] - a
    with np.errstate(divide="ignore", invalid="ignore"):
        u = (offset * across).sum(axis=2) / det
        turned = np.cross(offset, b - a)
        v = (way * turned).sum(axis=2) / det
        t = ((c - a) * turned).sum(axis=2) / det
    return ((u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0) & (t <= 1)).any(axis=1)


def lines(a, b, count, random):
    return random.uniform(a[:3], a[3:], (count, 3)), random.uniform(b[:3], b[3:], (count, 3))


@pytest.mark.slow
def test_a_slanted_and_wavy_sheet_closes_a_shaft():
    assert closing(*wavy()) == kernels.SHUT


def test_a_sheet_that_ends_in_the_shaft_does_not():
    assert closing(*wavy(half=0.8)) == kernels.MET


def test_nothing_between_them_is_clear():
    assert closing(*wavy(at=40.0)) == kernels.CLEAR


def test_a_hole_leaves_it_open_until_it_is_out_of_the_shaft():
    points, faces = wavy()
    middles = points[faces].mean(axis=1)
    hole = np.argmin(np.abs(middles[:, 1:] - 0.3).sum(axis=1))
    holed = np.delete(faces, hole, axis=0)
    assert closing(points, holed) != kernels.SHUT
    aside = np.argmax(middles[:, 1])
    assert closing(points, np.delete(faces, aside, axis=0)) == kernels.SHUT


def test_a_sheet_that_touches_the_viewers_or_the_target_proves_nothing():
    points, faces = wavy()
    assert closing(further(points, -9.5), faces) != kernels.SHUT
    assert closing(further(points, 10.5), faces) == kernels.MET


def test_each_of_two_sheets_closes_it_by_itself():
    points, faces = wavy(turn=0.0, wave=0.0)
    both = np.concatenate([further(points, -3.0), further(points, 3.0)])
    assert closing(both, np.concatenate([faces, faces + len(points)])) == kernels.SHUT


@pytest.mark.parametrize("change", ["twice", "turned", "other order", "torn corners", "no area"])
def test_how_triangles_are_written_does_not_count(change):
    points, faces = wavy()
    if change == "twice":
        faces = np.concatenate([faces, faces[::-1, ::-1]])
    elif change == "turned":
        faces = np.roll(faces, 1, axis=1)
    elif change == "other order":
        faces = np.random.default_rng(1).permutation(faces)
    elif change == "torn corners":
        points, faces = points[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3)
    else:
        faces = np.concatenate([faces, [[0, 0, 1], [2, 2, 2]]])
    assert closing(points, faces) == kernels.SHUT


def test_three_triangles_at_an_edge_have_a_border_there():
    """A fin on the sheet: one of the three at its foot is left without a neighbour."""
    points, faces = wavy()
    middle = len(points) // 2
    fin = np.concatenate([points, [[14.0, 0.0, 0.0]]])
    ends = [face for face in faces.tolist() if middle in face and middle + 1 in face]
    assert len(ends) == 2
    found = Sheets.of(fin, np.concatenate([faces, [[middle, middle + 1, len(points)]]]))
    one = Sheets.of(points, faces)
    # Of the fin's own edges two are borders, and of the three at its foot one is.
    assert (found.beside < 0).sum() == (one.beside < 0).sum() + 3


def test_too_many_triangles_are_not_looked_through():
    points, faces = wavy(steps=64)
    assert len(faces) > kernels.MOST
    wide = np.array([20.0, -6.0, -6.0, 22.0, 6.0, 6.0])
    tall = np.array([0.0, -6.0, -6.0, 1.0, 6.0, 6.0])
    assert closing(points, faces, tall, wide) == kernels.MET
    assert closing(further(points, 40.0), faces, tall, wide) == kernels.CLEAR


def scene(random):
    """Wavy sheets, some of them holed, and boxes of all sizes around them."""
    made = [wavy(at, random.uniform(2, 8), 6, random.uniform(0, 2)) for at in (7.0, 12.0)]
    points = np.concatenate([one for one, _ in made])
    faces = np.concatenate([made[0][1], made[1][1] + len(made[0][0])])
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    kept = random.random(len(faces)) > random.choice([0.0, 0.01, 0.1])
    low, other = random.uniform([-2, -3, -3], [4, 3, 3]), random.uniform([15, -3, -3], [20, 3, 3])
    sizes = random.uniform(0.0, 2.0, (2, 3)) * (random.random((2, 3)) > 0.2)
    boxes = []
    for corner, size in zip((low, other), sizes, strict=True):
        middle = turn @ corner
        boxes.append(np.concatenate([middle - 0.5 * size, middle + 0.5 * size]))
    return points @ turn.T, faces[kept], boxes


def leaking(close, rounds=150):
    """Of random scenes, how many the kernel closes, and how many of these lines get through."""
    random = np.random.default_rng(4)
    shut = leaks = 0
    for _ in range(rounds):
        points, faces, (a, b) = scene(random)
        if (a[:3] <= b[3:]).all() and (b[:3] <= a[3:]).all():
            continue
        if closing(points, faces, a, b, close) == kernels.SHUT:
            shut += 1
            leaks += not crossed(*lines(a, b, 200, random), points, faces).all()
    return shut, leaks


def test_no_line_gets_through_what_is_shut():
    shut, leaks = leaking(kernels.close)
    assert shut > 30
    assert leaks == 0


FAULTS = {
    "borders do not count": ("beside[face, side] < 0 and not", "beside[face, side] < -1 and not"),
    "sheets may touch the boxes": ("        if not broken[root]:\n", "        if False:\n"),
    "sheets are not told apart": (
        "if other >= 0 and known[other] >= 0:", "if other < -1 and known[other] >= 0:",
    ),
}  # fmt: skip


PEBBLE = (
    np.array([[9.5, -0.5, -0.5], [10.5, -0.5, -0.5], [10.0, 0.7, -0.5], [10.0, 0.0, 0.7]]),
    np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]], dtype=np.int32),
)
"""A closed piece that floats in the shaft."""

SEEN_PAST = {
    "borders do not count": wavy(half=0.8, steps=2),
    "sheets may touch the boxes": (further(wavy(steps=4)[0], 10.5), wavy(steps=4)[1]),
    "sheets are not told apart": PEBBLE,
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_in_the_kernel_is_seen(fault):
    """Run without numba, which takes less time than compiling it."""
    right, wrong = FAULTS[fault]
    text = inspect.getsource(kernels)
    assert text.count(right) == 1
    space = {}
    plain = text.replace(right, wrong).replace("@inner_kernel\n", "")
    exec(compile(plain, "sheets_with_a_fault", "exec"), space)
    assert closing(*SEEN_PAST[fault], close=space["close"]) == kernels.SHUT
    assert closing(*SEEN_PAST[fault]) == kernels.MET


@pytest.mark.parametrize("seed", range(5))
def test_lines_are_clear_where_they_meet_nothing(seed):
    random = np.random.default_rng(seed)
    points, faces, (a, b) = scene(random)
    sheets = Sheets.of(points, faces)
    starts, ends = lines(a - 2.0, b + 2.0, 60, random)
    for start, end, met in zip(starts, ends, crossed(starts, ends, points, faces), strict=True):
        assert met != kernels.is_line_clear(
            start, end, sheets.points, sheets.faces, sheets.normals, sheets.boxes, sheets.children
        )


def test_no_triangles_are_no_sheets():
    sheets = Sheets.of(np.empty((0, 3)), np.empty((0, 3), np.int32))
    assert len(sheets) == 0
    assert len(sheets.boxes) == 0


@pytest.mark.parametrize("count", [1, 2, 3, 5, 8, 37])
def test_a_tree_holds_its_leaves(count):
    random = np.random.default_rng(count)
    low = random.uniform(0.0, 9.0, (count, 3))
    boxes, children, order = tree_over(low, low + 1.0)
    assert sorted(order.tolist()) == list(range(count))
    np.testing.assert_array_equal(boxes[:count, :3], low[order])
    assert (children[:count, 0] == children[:count, 1]).all()
    under = set()
    waiting = [len(boxes) - 1]
    while waiting:
        node = waiting.pop()
        first, last = children[node]
        if first == last:
            under.add(node)
        for child in range(first, last):
            assert (boxes[child, :3] >= boxes[node, :3]).all()
            assert (boxes[child, 3:] <= boxes[node, 3:]).all()
            waiting.append(child)
    assert under == set(range(count))
