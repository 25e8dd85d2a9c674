from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.errors import RangeNotSatisfiableError
from service.headers import Part, is_fresh, part_wanted

ETAG = '"abc"'


@pytest.mark.parametrize(
    ("header", "part"),
    [
        ("bytes=0-0", Part(0, 1)),
        ("bytes=2-5", Part(2, 6)),
        ("bytes=2-", Part(2, 10)),
        ("bytes=-3", Part(7, 10)),
        ("bytes=-99", Part(0, 10)),
        ("bytes=5-99", Part(5, 10)),
        ("Bytes = 1 - 2", Part(1, 3)),
        ("bytes=5-2", None),
        ("bytes=-", None),
        ("bytes=0-1,4-5", None),
        ("lines=0-1", None),
        ("", None),
    ],
)
def test_a_range_is_a_part_or_the_whole_file(header, part):
    assert part_wanted({"range": header}, ETAG, 10) == part


@pytest.mark.parametrize("header", ["bytes=10-", "bytes=11-20", "bytes=-0"])
def test_a_range_beyond_the_end_is_refused_with_the_size(header):
    with pytest.raises(RangeNotSatisfiableError) as told:
        part_wanted({"range": header}, ETAG, 10)
    assert told.value.headers["Content-Range"] == "bytes */10"


def test_no_range_of_an_empty_file_can_be_given():
    with pytest.raises(RangeNotSatisfiableError):
        part_wanted({"range": "bytes=0-"}, ETAG, 0)


@pytest.mark.parametrize(
    ("condition", "part"),
    [(ETAG, Part(0, 2)), ('"other"', None), ('W/"abc"', None),
     ("Sat, 29 Oct 1994 19:43:31 GMT", None)],
)  # fmt: skip
def test_a_part_is_given_only_of_the_same_bytes(condition, part):
    assert part_wanted({"range": "bytes=0-1", "if-range": condition}, ETAG, 10) == part


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
        part = part_wanted({"range": header}, ETAG, size)
    except RangeNotSatisfiableError:
        return
    assert part is None or 0 <= part.start < part.stop <= size
