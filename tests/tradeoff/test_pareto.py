"""The front against its definition, tried for every pair of points."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from simplifier.tradeoff.cases import dominators

# Few distinct numbers, so that points share costs and values.
NUMBERS = st.one_of(st.integers(0, 4).map(float), st.floats(0.0, 4.0))
POINTS = st.lists(st.tuples(NUMBERS, NUMBERS), max_size=24)


def dominates(one, other):
    """No dearer, worth no less, and better in one of the two."""
    return one[0] <= other[0] and one[1] >= other[1] and one != other


@given(POINTS)
def test_dominators_are_those_of_the_definition(points):
    found = dominators([cost for cost, _ in points], [value for _, value in points])
    assert len(found) == len(points)
    front = [i for i, p in enumerate(points) if not any(dominates(q, p) for q in points)]
    assert [i for i, dominator in enumerate(found) if dominator is None] == front
    for index, dominator in enumerate(found):
        if dominator is not None:
            rivals = [i for i in front if dominates(points[i], points[index])]
            assert dominator == min(rivals, key=lambda i: (-points[i][1], points[i][0], i))


@given(POINTS, st.randoms(use_true_random=False))
def test_the_order_of_the_points_does_not_matter(points, random):
    order = random.sample(range(len(points)), len(points))
    found = dominators([c for c, _ in points], [v for _, v in points])
    mixed = dominators([points[i][0] for i in order], [points[i][1] for i in order])
    assert [mixed[order.index(i)] is None for i in range(len(points))] == [d is None for d in found]


def test_a_front_by_hand():
    #          cheap, better, worse and dearer, equal to the second, best
    costs, values = [1.0, 2.0, 3.0, 2.0, 4.0], [0.2, 0.5, 0.4, 0.5, 0.9]
    assert dominators(costs, values) == [None, None, 1, None, None]


def test_no_points():
    assert dominators([], []) == []
