"""Options as JSON schema has them and as they are read: the two say the same."""

from __future__ import annotations

import math

import jsonschema
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.errors import InvalidOptionsError
from service.jobs.job import JobKind
from service.schemas.job_options import option_tables
from simplifier import (
    EvaluateOptions,
    SceneOptions,
    SimplifyOptions,
    TradeoffOptions,
    VisibilityOptions,
)

TABLES = option_tables(math.inf, math.inf)
OF_LIBRARY = {
    JobKind.OCCLUDER: SimplifyOptions.fields(),
    JobKind.EVALUATION: EvaluateOptions.fields(),
    JobKind.SCENE: SceneOptions.fields(),
    JobKind.TRADEOFF: TradeoffOptions.fields(),
    JobKind.VISIBILITY: VisibilityOptions.fields(),
}
CASES = [(kind, field) for kind in TABLES for field in TABLES[kind].fields]


@pytest.mark.parametrize("kind", TABLES)
def test_every_option_of_the_library_is_there_but_what_the_server_decides(kind):
    missing = {one.name for one in OF_LIBRARY[kind]} - {one.name for one in TABLES[kind].fields}
    assert missing <= {"slicer", "device", "preview", "backend", "skip_buried"}


@pytest.mark.parametrize("kind", TABLES)
def test_all_options_are_told_where_none_is_given(kind):
    options = TABLES[kind].read({})
    assert set(options) == {one.name for one in TABLES[kind].fields}
    jsonschema.validate(options, TABLES[kind].schema())


values = st.one_of(
    st.none(), st.booleans(), st.integers(), st.integers(-2, 70_000), st.floats(), st.text(),
    st.lists(st.floats(0.0, 10.0), max_size=18),
    st.lists(st.integers(0, 1100), max_size=18),
    st.sampled_from(["x", "draft", "above", "gain", 0.01, 1e6, 2**63 - 1, 179]),
)  # fmt: skip


@pytest.mark.parametrize(("kind", "field"), CASES, ids=lambda one: getattr(one, "name", str(one)))
@given(value=values)
def test_the_schema_allows_just_what_can_be_read(kind, field, value):
    if isinstance(value, float) and not math.isfinite(value):
        return  # JSON has none
    table = TABLES[kind]
    schema = table.schema()["properties"][field.name]
    try:
        table.read({field.name: value})
    except InvalidOptionsError:
        accepted = False
    else:
        accepted = True
    assert jsonschema.Draft202012Validator(schema).is_valid(value) is accepted


NAMES = {one.name for one in TABLES[JobKind.OCCLUDER].fields}
unknown = st.text(max_size=5).filter(lambda name: name not in NAMES)


@given(st.dictionaries(unknown, values, min_size=1, max_size=4))
def test_what_there_is_not_is_refused_field_by_field(given):
    with pytest.raises(InvalidOptionsError) as told:
        TABLES[JobKind.OCCLUDER].read(given)
    assert {one.field for one in told.value.errors} == set(given)


def test_a_time_limit_is_no_longer_than_a_job_may_take():
    table = option_tables(30.0, math.inf)[JobKind.OCCLUDER]
    assert table.read({"time_limit": 30})["time_limit"] == 30.0
    with pytest.raises(InvalidOptionsError, match="at most 30"):
        table.read({"time_limit": 30.5})


def test_flags_of_a_query_are_true_or_false_in_any_case():
    table = TABLES[JobKind.OCCLUDER]
    for text, value in (("true", True), ("True", True), ("FALSE", False), ("false", False)):
        assert table.read(table.from_query([("ground", text)]))["ground"] is value
    for text in ("1", "yes", "on", ""):
        with pytest.raises(InvalidOptionsError) as told:
            table.read(table.from_query([("ground", text)]))
        [fault] = told.value.errors
        assert fault.detail == f"{text!r} is neither true nor false"
        assert fault.remedy == "give true or false"


def test_true_is_no_whole_number():
    with pytest.raises(InvalidOptionsError) as told:
        TABLES[JobKind.OCCLUDER].read({"budget": True})
    assert told.value.errors[0].detail == "True is not a whole number"
