"""Options as they are typed."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.dashboard.submit.typed import (
    asset_names,
    read_typed,
    remembered_options,
    typed_options,
    typed_value,
)
from service.jobs.job import JobKind
from service.schemas.job_options import option_tables

TABLES = option_tables(math.inf, math.inf)
TABLE = TABLES[JobKind.OCCLUDER]


def test_an_untouched_form_asks_for_nothing() -> None:
    typed = {one.name: typed_value(one, one.default) for one in TABLE.fields}
    form = read_typed(TABLE, typed)
    assert (form.given, form.faults) == ((), {})
    assert form.resolved == TABLE.read({})


@pytest.mark.parametrize("kind", TABLES)
def test_what_a_job_had_can_be_typed_again(kind: JobKind) -> None:
    options = TABLES[kind].read({})
    assert read_typed(TABLES[kind], typed_options(TABLES[kind], options)).resolved == options


def test_each_fault_stands_by_its_option() -> None:
    form = read_typed(TABLE, {"budget": "0", "alpha": "a", "error_bounds": "1,", "preset": "best"})
    assert set(form.faults) == {"budget", "alpha", "error_bounds"}
    assert form.faults["budget"] == "0 is out of range. Choose 1 to 100,000."
    assert form.resolved == {}


def test_what_cannot_go_together_is_a_fault() -> None:
    assert read_typed(TABLE, {"moves": "32", "time_limit": "0.5"}).faults


@given(st.dictionaries(st.sampled_from([one.name for one in TABLE.fields]), st.text(max_size=8)))
def test_whatever_is_typed_is_right_or_has_a_fault(typed: dict[str, str]) -> None:
    form = read_typed(TABLE, typed)
    assert bool(form.faults) != bool(form.resolved)


@pytest.mark.parametrize("told", [None, 5, "x", [1], {"odd": "1"}, {"budget": 3}, {"": {}}])
def test_a_browser_may_have_kept_anything(told: object) -> None:
    assert remembered_options(TABLE, told) == {}


def test_several_files_are_assets_of_their_own() -> None:
    assert asset_names(" props/castle ", ["a.obj"]) == ["props/castle"]
    assert asset_names("props/", ["a.obj", "b.c.glb"]) == ["props/a", "props/b.c"]
    assert asset_names("", ["a.obj", "b.obj"]) == ["", ""]
