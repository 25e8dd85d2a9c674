"""Fates of parts and objects, one by one and counted."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.culling.depth_buffer import Verdict
from simplifier.culling.fate import Counts, Fate, fates, object_sums, object_verdicts


def test_every_case():
    cases = {
        (Verdict.VISIBLE, 9, 9): Fate.SEEN,
        (Verdict.VISIBLE, 9, 0): Fate.MISSED,
        (Verdict.VISIBLE, 0, 0): Fate.ABSENT,
        (Verdict.HIDDEN, 9, 1): Fate.WRONG,
        (Verdict.HIDDEN, 9, 0): Fate.CULLED,
        (Verdict.HIDDEN, 0, 0): Fate.ABSENT,
        (Verdict.OUTSIDE, 9, 1): Fate.LOST,
        (Verdict.OUTSIDE, 9, 0): Fate.MISSED,
        (Verdict.OUTSIDE, 0, 0): Fate.ABSENT,
    }
    verdicts, fragments, visible = map(np.array, zip(*cases, strict=True))
    assert fates(verdicts, fragments, visible).tolist() == list(cases.values())


def test_counts():
    found = np.array([Fate.SEEN] * 3 + [Fate.CULLED] * 4 + [Fate.MISSED, Fate.WRONG, Fate.ABSENT])
    counts = Counts.of(found.astype(np.uint8))
    assert counts == Counts(in_view=9, hidden=5, culled=4, wrong=1, lost=0)
    assert (counts.missed, counts.recall) == (1, 0.8)
    assert Counts.total([counts, counts, Counts()]) == Counts(18, 10, 8, 2, 0)
    assert Counts().recall is None
    assert Counts.of(np.array([Fate.LOST], dtype=np.uint8)).lost == 1


parts = st.lists(
    st.tuples(st.integers(0, 4), st.sampled_from(list(Verdict)), st.integers(0, 9)), max_size=20
)


@given(parts)
def test_objects_by_their_parts(rows):
    object_of = np.array([row[0] for row in rows], dtype=np.int32)
    verdicts = np.array([row[1] for row in rows], dtype=np.uint8)
    pixels = np.array([row[2] for row in rows], dtype=np.int64)
    found = object_verdicts(verdicts, object_of, 5)
    sums = object_sums(pixels, object_of, 5)
    for index in range(5):
        own = [row for row in rows if row[0] == index]
        said = {row[1] for row in own}
        culled = bool(said) and said <= {Verdict.HIDDEN, Verdict.OUTSIDE} and Verdict.HIDDEN in said
        assert (found[index] == Verdict.HIDDEN) == culled
        assert (found[index] == Verdict.VISIBLE) == (Verdict.VISIBLE in said)
        assert sums[index] == sum(row[2] for row in own)


@given(parts)
def test_counts_add_up(rows):
    verdicts = np.array([row[1] for row in rows], dtype=np.uint8)
    visible = np.array([row[2] // 2 for row in rows], dtype=np.int64)
    fragments = visible + np.array([row[0] for row in rows], dtype=np.int64)
    counts = Counts.of(fates(verdicts, fragments, visible))
    assert counts.in_view == np.count_nonzero(fragments)
    assert counts.hidden == np.count_nonzero((fragments > 0) & (visible == 0))
    assert counts.in_view - counts.hidden == np.count_nonzero(visible)
    assert counts.culled + counts.missed == counts.hidden
    assert counts.recall == (
        pytest.approx(counts.culled / counts.hidden) if counts.hidden else None
    )
