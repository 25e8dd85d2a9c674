"""Which levels bring something."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.lods.levels import LevelFigures, why_replaced, why_useless

FINE = LevelFigures(40, 0.999, 0.9)


@pytest.mark.parametrize(
    ("coarser", "reason"),
    [
        (LevelFigures(20, 0.99, 0.5), ""),  # cheaper, however much less it hides
        (LevelFigures(36, 0.999, 0.9), ""),
        (LevelFigures(40, 0.99, 0.95), ""),  # hides more
        (LevelFigures(37, 0.999, 0.9), "no better than the finer level"),
        (LevelFigures(40, 0.999, 0.904), "no better than the finer level"),
        (LevelFigures(0, 1.0, 0.0), "hides nothing"),
        (LevelFigures(4, 0.9, 0.001), "hides nothing"),
    ],
)
def test_beside_the_finer(coarser, reason):
    found = why_useless(coarser, FINE)
    assert reason in found
    assert bool(found) == bool(reason)


@pytest.mark.parametrize(
    ("coarser", "replaced"),
    [
        (LevelFigures(20, 0.999, 0.9), True),
        (LevelFigures(20, 0.9985, 0.896), True),
        (LevelFigures(20, 1.0, 0.99), True),
        (LevelFigures(37, 0.999, 0.9), False),  # not cheaper
        (LevelFigures(20, 0.997, 0.95), False),  # hides more wrongly
        (LevelFigures(20, 1.0, 0.89), False),  # hides less
    ],
)
def test_in_place_of_the_finer(coarser, replaced):
    assert bool(why_replaced(FINE, coarser)) == replaced


shares = st.floats(0.0, 1.0)
figures = st.builds(LevelFigures, st.integers(0, 100), shares, shares)


@given(figures, figures)
def test_one_of_two_equals_goes_but_never_both(coarser, finer):
    """What replaces a level is no useless one: else both would be gone."""
    if finer.hides and why_replaced(finer, coarser) and coarser.hides:
        assert why_useless(coarser, finer) == ""


@given(figures)
def test_a_level_beside_itself_is_useless(level):
    assert why_useless(level, level)
    assert why_replaced(level, level) == "" or level.triangles == 0
