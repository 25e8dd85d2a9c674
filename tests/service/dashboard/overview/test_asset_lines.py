"""What the page of all assets says, without a browser."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.dashboard.overview.asset_lines import (
    AssetLine,
    Holds,
    Overview,
    falls_since,
    midnight,
    summary,
)
from service.dashboard.overview.exports import csv_of, harmless, rows_of
from service.jobs.asset import RunNumbers, Standing, Thresholds

RUN = RunNumbers("job1", 1.7e9, 64, 5000, 1.5, 0.999, 0.8, 0.6, 17, 0.0042, "good")


def line(
    name: str = "castle", run: RunNumbers | None = RUN, thresholds: Thresholds | None = None
) -> AssetLine:
    own = thresholds or Thresholds()
    standing = Standing(f"id of {name}", name, own, run, (0.7, 0.8), own)
    return AssetLine.of(standing)


def overview(*lines: AssetLine) -> Overview:
    return Overview(lines, (), datetime(2024, 5, 1, tzinfo=UTC), None)


@pytest.mark.parametrize(
    ("thresholds", "holds"),
    [
        (Thresholds(), Holds.OPEN),
        (Thresholds(0.999, 0.8), Holds.MET),
        (Thresholds(0.9991, None), Holds.MISSED),
        (Thresholds(None, 0.81), Holds.MISSED),
        (Thresholds(None, None, 0.0042), Holds.MET),
        (Thresholds(0.999, 0.8, 0.0041), Holds.MISSED),
    ],
)
def test_thresholds_hold_by_the_latest_run(thresholds: Thresholds, holds: Holds) -> None:
    assert line(thresholds=thresholds).holds is holds


def test_an_asset_without_a_run_holds_nothing() -> None:
    assert line(run=None, thresholds=Thresholds(0.9, 0.9)).holds is Holds.NEVER_RUN


def test_what_fell_is_told_with_the_largest_fall_first() -> None:
    a = line("a", replace(RUN, job_id="new", recall=0.75))
    b = line("b", replace(RUN, job_id="new", precision=0.9, recall=0.9))
    found = falls_since((a, b), {a.id: RUN, b.id: RUN})
    assert [change.line.name for change in found] == ["b", "a"]
    assert (found[0].precision, found[0].recall) == ((0.999, 0.9), None)
    assert (found[1].precision, found[1].recall) == (None, (0.8, 0.75))


def test_what_rose_stayed_or_began_later_is_not_worse() -> None:
    risen = line("a", replace(RUN, job_id="new", recall=0.9))
    same = line("b")
    hardly = line("c", replace(RUN, job_id="new", recall=0.7996))
    fresh = line("d", replace(RUN, recall=0.1))
    before = {one.id: RUN for one in (risen, same, hardly)}
    assert falls_since((risen, same, hardly, fresh), before) == ()


def test_the_summary_counts_in_words() -> None:
    missed = line(thresholds=Thresholds(1.0, 1.0))
    assert summary(overview(line())) == (
        "1 asset. Failed uploads: none. Below a threshold: none. Got worse since 1 May 2024: none."
    )
    assert summary(overview(line(), missed)) == (
        "2 assets. Failed uploads: none. Below a threshold: 1. Got worse since 1 May 2024: none."
    )


def test_half_a_date_is_none() -> None:
    assert midnight("2024-05-01") == datetime(2024, 5, 1, tzinfo=UTC)
    with pytest.raises(ValueError):
        midnight("2024-05")


@given(st.text(min_size=1, max_size=60))
def test_no_name_in_the_csv_begins_a_formula_or_another_row(name: str) -> None:
    rows = list(csv.DictReader(io.StringIO(csv_of([line(name)]), newline="")))
    assert len(rows) == 1
    read = rows[0]["asset"]
    assert read[:1] not in tuple("=+-@\t\r\n")
    assert read == harmless(name)
    assert rows[0]["recall"] == "0.8"


@pytest.mark.parametrize("name", ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1"])
def test_a_formula_is_quoted(name: str) -> None:
    assert harmless(name) == f"'{name}"
    assert harmless("props/castle") == "props/castle"


def test_those_that_miss_their_thresholds_come_first() -> None:
    missed = line("z", thresholds=Thresholds(1.0, 1.0))
    told = rows_of(overview(line("a"), missed))
    names = [row[told["names"].index("name")] for row in told["rows"]]
    assert names == ["z", "a"]
    assert all(len(row) == len(told["names"]) for row in told["rows"])


def test_figures_are_sent_no_better_than_they_are() -> None:
    run = replace(RUN, recall=0.98999, precision=0.00004, overhang=0.00421)
    told = rows_of(overview(line("a", run), line("b", None)))
    never, row = (dict(zip(told["names"], one, strict=True)) for one in told["rows"])
    assert (row["recall"], row["overhang"]) == (0.9899, 0.0043)
    assert 0.0 < row["precision"] < 0.0001
    assert (never["recall"], never["job"], never["holds"]) == (None, None, "no run yet")
