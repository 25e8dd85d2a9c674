"""What is good, weak and unusable for an engine, and that the reason says which figure it is."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.accuracy.verdict import (
    GOOD_OVERHANG,
    GOOD_PRECISION,
    GOOD_RECALL,
    LEAST_COVERAGE,
    LEAST_PRECISION,
    LEAST_RECALL,
    MOST_OVERHANG,
    VERDICT_WORDS,
    Aim,
    Aims,
    VerdictFigures,
    falls_short,
    verdict_on,
)

USUAL = VerdictFigures(triangles=53, precision=0.9999, recall=0.866, overhang=0.0044, coverage=0.07)
SHARES = st.floats(0.0, 1.0)
FIGURES = st.builds(VerdictFigures, st.integers(0, 100), SHARES, SHARES, SHARES, SHARES)


def test_what_is_made_by_default_is_good():
    found = verdict_on(USUAL)
    assert found.is_good
    assert found.reason == (
        "it hides 86.60 % of what the mesh hides, with a precision of 99.99 %, and covers 0.44 %"
        " beside it"
    )
    assert (found.faults, found.remarks) == ((), ())


@pytest.mark.parametrize(
    ("change", "word", "says"),
    [
        ({"recall": GOOD_RECALL}, "good", "40.00 %"),
        ({"recall": 0.39}, "weak", "it hides 39.00 % of what the mesh hides (a good "),
        ({"recall": LEAST_RECALL}, "weak", "10.00 %"),
        ({"recall": 0.0155}, "unusable", "it hides 1.55 %"),
        ({"recall": 0.0}, "unusable", "it hides 0.00 %"),
        ({"triangles": 0, "recall": 0.0}, "unusable", "it has no triangles"),
        ({"precision": GOOD_PRECISION}, "good", "99.00 %"),
        ({"precision": 0.989}, "weak", "precision is 98.90 % (a good occluder has at least 99 %"),
        ({"precision": LEAST_PRECISION}, "weak", "95.00 %"),
        ({"precision": 0.918}, "unusable", "precision is 91.80 % (below 95 %"),
        ({"overhang": GOOD_OVERHANG}, "good", "3.00 %"),
        ({"overhang": 0.031}, "weak", "3.10 % beside the mesh (a good occluder covers at most 3 %"),
        ({"overhang": MOST_OVERHANG}, "weak", "5.00 %"),
        ({"overhang": 0.06}, "unusable", "covers 6.00 % beside the mesh (above 5 %"),
        ({"coverage": LEAST_COVERAGE}, "good", "86.60 %"),
        ({"coverage": 3.3e-6}, "weak", "fills 0.00033 % of what is looked at, so recall means li"),
        ({"coverage": 0.0, "recall": 1.0}, "unusable", "no view shows a pixel of it"),
    ],
)  # fmt: skip
def test_each_figure_has_its_limits(change, word, says):
    found = verdict_on(replace(USUAL, **change))
    assert found.word == word
    assert says in found.reason


def test_an_aim_of_the_users_counts_and_one_of_the_defaults_is_told():
    chosen = verdict_on(USUAL, Aims(Aim(0.99999, True), Aim(0.001, True)))
    assert chosen.word == "weak"
    assert chosen.reason == (
        "precision is 99.99 %, below the target of 99.999 %; the occluder covers 0.44 % beside the"
        " mesh, above the limit of 0.1 %"
    )
    default = verdict_on(USUAL, Aims(Aim(0.99999, False), Aim(0.001, False)))
    assert default.is_good
    assert "; ".join(default.remarks) == chosen.reason


def test_views_differ_so_an_aim_is_kept_by_a_tenth_more():
    asked = Aims(overhang=Aim(0.0041, True))
    assert verdict_on(USUAL, asked).is_good
    assert verdict_on(replace(USUAL, overhang=0.0046), asked).word == "weak"


def test_coarser_levels_are_seen_from_further_away():
    """At eight times the distance a pixel beside the outline is eight times as much."""
    coarse = replace(USUAL, overhang=0.03 * 8.0)
    assert verdict_on(coarse).word == "unusable"
    assert verdict_on(coarse, Aims(distance=8.0)).is_good


@given(FIGURES, FIGURES)
def test_more_of_what_is_good_is_never_worse(one, other):
    better = VerdictFigures(
        max(one.triangles, other.triangles), max(one.precision, other.precision),
        max(one.recall, other.recall), min(one.overhang, other.overhang),
        max(one.coverage, other.coverage),
    )  # fmt: skip
    assert not falls_short(verdict_on(better).word, verdict_on(one).word)


@given(FIGURES, st.booleans())
def test_the_word_is_that_of_the_first_fault_and_every_fault_is_in_the_reason(figures, chosen):
    found = verdict_on(figures, Aims(Aim(0.999, chosen), Aim(0.005, chosen)))
    assert found.is_good == (not found.faults)
    ranks = [VERDICT_WORDS.index(one.word) for one in found.faults]
    assert ranks == sorted(ranks, reverse=True)
    assert all(one.what in found.reason for one in found.faults)
    if found.faults:
        assert found.word == found.faults[0].word
    assert not set(found.remarks) & {one.what for one in found.faults}


def test_overhang_that_was_asked_for_is_no_fault():
    much = replace(USUAL, overhang=0.054)
    assert verdict_on(much).word == "unusable"
    assert verdict_on(much, Aims(overhang=Aim(0.05, chosen=True))).word == "good"
    assert verdict_on(much, Aims(overhang=Aim(0.05, chosen=False))).word == "unusable"
    assert verdict_on(much, Aims(overhang=Aim(0.04, chosen=True))).word == "unusable"
