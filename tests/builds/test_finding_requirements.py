"""What is demanded, and how figures fall short of it."""

from __future__ import annotations

import pytest

from simplifier.builds.finding import AssetFigures, Requirements, shortfalls, unknown_figure
from simplifier.wording import overhang_words, percent

REPORT = {
    "triangles": 64, "precision": 0.99, "recall": 0.8, "deviation": 0.0, "error_bound": None,
    "overhang": {"share": 0.0124}, "verdict": {"word": "weak"},
}  # fmt: skip
FOUND = AssetFigures(64, 0.99, 0.8, 0.0, None, 0.0124, "weak")
OLD = AssetFigures(64, 0.99, 0.8, 0.0, None)


def short(found=FOUND, before=None, **demanded):
    return list(shortfalls(Requirements(**demanded), found, before))


@pytest.mark.parametrize(
    ("demanded", "words"),
    [
        ({}, []),
        ({"min_precision": 0.99, "min_recall": 0.8, "max_triangles": 64}, []),
        ({"min_precision": 0.995}, ["precision 99 % is below 99.5 %"]),
        ({"min_recall": 0.80001}, ["recall 80 % is below 80.001 %"]),
        ({"max_overhang": 0.0124, "verdict": "weak"}, []),
        ({"max_overhang": 0.01}, ["overhang 1.24 % is above 1 %"]),
        ({"verdict": "good"}, ["the verdict is weak, not good"]),
        ({"max_triangles": 63}, ["64 triangles are more than 63"]),
        ({"min_recall": 0.9, "max_triangles": 1}, ["recall 80 % is below 90 %",
                                                   "64 triangles are more than 1"]),
    ],
)  # fmt: skip
def test_what_falls_short_is_said(demanded, words):
    assert short(**demanded) == words


def test_an_old_record_falls_short_of_nothing_that_it_does_not_have():
    demanded = {"max_overhang": 0.0, "verdict": "good"}
    assert short(OLD, **demanded) == []
    assert unknown_figure(Requirements(**demanded), OLD) == "overhang"
    assert unknown_figure(Requirements(verdict="good"), OLD) == "verdict"
    assert unknown_figure(Requirements(min_recall=0.9), OLD) == ""
    assert unknown_figure(Requirements(**demanded), FOUND) == ""


@pytest.mark.parametrize(("before", "falls"), [(0.7, 0), (0.804, 0), (0.806, 1), (1.0, 1)])
def test_recall_may_fall_by_half_a_point(before, falls):
    was = AssetFigures(64, 0.99, before, 0.0, None)
    assert len(short(before=was)) == falls
    assert short(before=was, max_recall_loss=1.0) == []


@pytest.mark.parametrize(
    ("recall", "overhang", "told"),
    [
        (0.8, 0.0124, (0.8, 0.0124)),
        (0.83, 0.0065, (0.83, 0.0065)),
        (0.96199996, 0.006500418, (0.961999, 0.006501)),
    ],
)
def test_figures_of_an_asset_read_as_its_report_does(recall, overhang, told):
    """A table told 0.65 % of overhang, and the warning beside it 0.66."""
    figures = AssetFigures.of({**REPORT, "recall": recall, "overhang": {"share": overhang}})
    assert (figures.recall, figures.overhang) == told
    assert percent(figures.recall, 2) == percent(recall, 2)
    assert overhang_words(figures.overhang) == overhang_words(overhang)
