from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.headers import wait_seconds


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


@given(st.lists(st.text()))
def test_no_wish_is_a_mistake(headers):
    assert 0.0 <= wait_seconds(headers, 60.0) <= 60.0
