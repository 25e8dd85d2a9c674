"""What changed from one run to another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import pytest

from service.dashboard.asset.comparison import largest_changes, read_comparison
from service.dashboard.views import View
from service.errors import NotFoundError
from service.jobs.job import Failure
from tests.service.dashboard.results import JobResult
from tests.service.dashboard.stock import TENANT, stocked


def _views(recalls: Sequence[float], slant: float = 0.0) -> list[View]:
    return [View(at, (slant, 0.0, 1.0), 1.0, recall) for at, recall in enumerate(recalls)]


def test_the_largest_fall_comes_first_and_what_did_not_change_not_at_all() -> None:
    changed = largest_changes(_views([0.5, 0.9, 0.9, 0.2]), _views([0.9, 0.8, 0.9, 0.1999]))
    assert [one.a.index for one in changed] == [1, 3, 0]


def test_views_along_other_lines_are_not_compared() -> None:
    assert largest_changes(_views([0.5]), _views([0.9], slant=0.1)) == []
    assert largest_changes(_views([0.5]), _views([0.9, 0.8])) == []


def test_numbers_say_what_became_better_and_what_worse(tmp_path: Path, castle: JobResult) -> None:
    with stocked(tmp_path / "data") as stock:
        a = stock.run(castle, recall=0.8, precision=0.999, triangles=64)
        b = stock.run(castle, recall=0.75, precision=0.9995, triangles=64, worst_recall=None)
        compared = read_comparison(stock, TENANT, a.id, b.id)
    told = {one.name: (one.change, one.better) for one in compared.numbers}
    assert told["Recall"] == ("-5.00 points", False)
    assert told["Precision"] == ("+0.05 points", True)
    assert told["Triangles"] == ("", None)
    assert told["Worst view's recall"] == ("", None)
    assert (compared.options, compared.files) == ((), ())


def test_options_read_as_on_the_page_of_a_job(tmp_path: Path, castle: JobResult) -> None:
    changed = {**castle.options, "ground": False, "overhang": 0.0, "lods": None}
    with stocked(tmp_path / "data") as stock:
        a, b = stock.run(castle), stock.run(replace(castle, options=changed))
        told = {name: pair for name, *pair in read_comparison(stock, TENANT, a.id, b.id).options}
    assert told == {"ground": ["yes", "no"], "overhang": ["0.02", "0"], "lods": ["2", "-"]}


def test_files_that_differ_are_told_by_name_and_hash(tmp_path: Path, castle: JobResult) -> None:
    with stocked(tmp_path / "data") as stock:
        plain, one, other = (
            stock.run(castle, overrides=sent) for sent in (None, b"[ignore]\n", b"# none\n")
        )
        without = read_comparison(stock, TENANT, plain.id, one.id).files
        between = read_comparison(stock, TENANT, one.id, other.id).files
    hashes = [sha256(sent).hexdigest()[:8] for sent in (b"[ignore]\n", b"# none\n")]
    first, second = (f"castle.overrides.toml ({start})" for start in hashes)
    assert without == (("overrides", "-", first),)
    assert between == (("overrides", first, second),)


def test_a_job_without_a_result_cannot_be_compared(tmp_path: Path, castle: JobResult) -> None:
    with stocked(tmp_path / "data") as stock:
        a = stock.run(castle)
        b = stock.failure(castle, Failure("out-of-memory", "too large"))
        with pytest.raises(NotFoundError, match="no result"):
            read_comparison(stock, TENANT, a.id, b.id)
