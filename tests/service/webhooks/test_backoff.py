"""When a webhook is tried again."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.webhooks.backoff import LONGEST, retry_after, seconds_until_retry


@given(st.integers(1, 50))
def test_each_wait_is_longer_than_the_last_up_to_an_hour(tried: int) -> None:
    assert 8.0 <= seconds_until_retry(tried, None) <= LONGEST
    assert (
        seconds_until_retry(tried + 1, None) > seconds_until_retry(tried, None)
        or seconds_until_retry(tried + 1, None) >= 0.8 * LONGEST
    )


def test_eight_tries_bear_with_an_hour_of_absence() -> None:
    assert sum(seconds_until_retry(tried, None) for tried in range(1, 8)) > 3600.0


def test_those_that_failed_together_do_not_come_back_together() -> None:
    assert len({seconds_until_retry(1, None) for _ in range(20)}) > 10


@pytest.mark.parametrize(
    ("asked", "waited"), [(120.0, 120.0), (0.0, 1.0), (-5.0, 1.0), (86_400.0, LONGEST)]
)
def test_a_receiver_may_ask_for_a_second_to_an_hour(asked: float, waited: float) -> None:
    assert seconds_until_retry(3, asked) == waited


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
    asked = retry_after(header, now=0.0)
    assert 0.0 < seconds_until_retry(1, asked) <= LONGEST
