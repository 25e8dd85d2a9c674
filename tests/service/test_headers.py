"""Each header as its standard has it, whatever stands in it."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.errors import RangeNotSatisfiableError
from service.headers import (
    ByteRange,
    best_of,
    is_fresh,
    retry_after,
    wait_seconds,
    wanted_range,
    wants_result,
)

OFFERED = ["application/json", "model/gltf-binary", "model/obj", "text/html"]


@pytest.mark.parametrize(
    ("accept", "best"),
    [
        ("", "application/json"),
        ("*/*", "application/json"),
        ("model/*", "model/gltf-binary"),
        ("model/obj", "model/obj"),
        ("Model/OBJ ; Q=0.5", "model/obj"),
        ("model/obj;q=0.5, model/gltf-binary;q=0.6", "model/gltf-binary"),
        ("model/*;q=0.9, model/gltf-binary;q=0", "model/obj"),
        ("text/html,application/xhtml+xml,*/*;q=0.8", "text/html"),
        ("*/*, application/json;q=0", "model/gltf-binary"),
        ("image/png", None),
        ("*/*;q=0", None),
        ("model/obj;q=2", None),
        ("model/obj;q=", None),
        (",,;q=1,", None),
    ],
)
def test_the_best_liked_is_chosen(accept, best):
    assert best_of(accept, OFFERED) == best


@given(st.text())
def test_any_header_has_an_answer(accept):
    assert best_of(accept, OFFERED) in (*OFFERED, None)


@pytest.mark.parametrize(
    ("headers", "seconds"),
    [
        ([], 0),
        (["wait=10"], 10),
        (["respond-async, wait=10"], 10),
        (["Wait = 10 ; strict"], 10),
        (['wait="7"'], 7),
        (["return=minimal", "wait=3"], 3),
        (["wait=3, wait=9"], 3),
        (["wait=500"], 60),
        (["wait=-1"], 0),
        (["wait=1.5"], 0),
        (["wait"], 0),
        (["await=4"], 0),
    ],
)
def test_a_wish_is_understood_or_passed_over(headers, seconds):
    assert wait_seconds(headers, 60.0) == seconds


@pytest.mark.parametrize(
    ("headers", "alone"),
    [
        ([], False),
        (["return=representation"], True),
        (["wait=5", 'Return = "representation"; x=1, respond-async'], True),
        (["return=minimal, wait=5"], False),
        (["return=representations"], False),
    ],
)
def test_a_result_may_be_wanted_alone(headers, alone):
    assert wants_result(headers) is alone


@given(st.lists(st.text()))
def test_no_wish_is_a_mistake(headers):
    assert 0.0 <= wait_seconds(headers, 60.0) <= 60.0


ETAG = '"abc"'


@pytest.mark.parametrize(
    ("header", "part"),
    [
        ("bytes=0-0", ByteRange(0, 1)),
        ("bytes=2-5", ByteRange(2, 6)),
        ("bytes=2-", ByteRange(2, 10)),
        ("bytes=-3", ByteRange(7, 10)),
        ("bytes=-99", ByteRange(0, 10)),
        ("bytes=5-99", ByteRange(5, 10)),
        ("Bytes = 1 - 2", ByteRange(1, 3)),
        ("bytes=5-2", None),
        ("bytes=-", None),
        ("bytes=0-1,4-5", None),
        ("lines=0-1", None),
        ("", None),
    ],
)
def test_a_range_is_a_part_or_the_whole_file(header, part):
    assert wanted_range({"range": header}, ETAG, 10) == part


@pytest.mark.parametrize("header", ["bytes=10-", "bytes=11-20", "bytes=-0"])
def test_a_range_beyond_the_end_is_refused_with_the_size(header):
    with pytest.raises(RangeNotSatisfiableError) as told:
        wanted_range({"range": header}, ETAG, 10)
    assert told.value.headers["Content-Range"] == "bytes */10"


def test_no_range_of_an_empty_file_can_be_given():
    with pytest.raises(RangeNotSatisfiableError):
        wanted_range({"range": "bytes=0-"}, ETAG, 0)


@pytest.mark.parametrize(
    ("condition", "part"),
    [(ETAG, ByteRange(0, 2)), ('"other"', None), ('W/"abc"', None),
     ("Sat, 29 Oct 1994 19:43:31 GMT", None)],
)  # fmt: skip
def test_a_part_is_given_only_of_the_same_bytes(condition, part):
    assert wanted_range({"range": "bytes=0-1", "if-range": condition}, ETAG, 10) == part


@pytest.mark.parametrize(
    ("header", "fresh"),
    [(ETAG, True), ('W/"abc"', True), ('"x", "abc"', True), ("*", True), ('"x"', False),
     ("abc", False), ("", False)],
)  # fmt: skip
def test_bytes_that_are_there_are_not_sent_again(header, fresh):
    assert is_fresh({"if-none-match": header}, ETAG) is fresh


@given(st.one_of(st.text(), st.from_regex(r"bytes=\d{0,25}-\d{0,25}")), st.integers(0, 100))
def test_a_part_lies_within_the_file(header, size):
    try:
        part = wanted_range({"range": header}, ETAG, size)
    except RangeNotSatisfiableError:
        return
    assert part is None or 0 <= part.start < part.stop <= size


@pytest.mark.parametrize(
    ("header", "seconds"),
    [
        (None, None),
        ("120", 120.0),
        ("0", 0.0),
        ("Fri, 31 Dec 1999 23:59:59 GMT", 59.0),
        ("Fri, 31 Dec 1999 23:59:59 -0000", 59.0),
        ("soon", None),
        ("", None),
        ("1.5", None),
        ("²", None),
        ("Mon, 01 Jan 99999999999 00:00:00 GMT", None),
    ],
)
def test_retry_after_is_a_number_or_a_date(header: str | None, seconds: float | None) -> None:
    assert retry_after(header, now=946_684_740.0) == seconds


@given(st.text())
def test_no_header_breaks_it(header: str) -> None:
    seconds = retry_after(header, now=0.0)
    assert seconds is None or math.isfinite(seconds)
