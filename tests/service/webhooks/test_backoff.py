"""When a webhook is tried again."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.webhooks.posting import LONGEST_WAIT, seconds_until_retry


@given(st.integers(1, 50))
def test_each_wait_is_longer_than_the_last_up_to_an_hour(tried: int) -> None:
    assert 8.0 <= seconds_until_retry(tried, None) <= LONGEST_WAIT
    assert (
        seconds_until_retry(tried + 1, None) > seconds_until_retry(tried, None)
        or seconds_until_retry(tried + 1, None) >= 0.8 * LONGEST_WAIT
    )


def test_eight_tries_bear_with_an_hour_of_absence() -> None:
    assert sum(seconds_until_retry(tried, None) for tried in range(1, 8)) > 3600.0


def test_those_that_failed_together_do_not_come_back_together() -> None:
    assert len({seconds_until_retry(1, None) for _ in range(20)}) > 10


@pytest.mark.parametrize(
    ("asked", "waited"), [(120.0, 120.0), (0.0, 1.0), (-5.0, 1.0), (86_400.0, LONGEST_WAIT)]
)
def test_a_receiver_may_ask_for_a_second_to_an_hour(asked: float, waited: float) -> None:
    assert seconds_until_retry(3, asked) == waited
