"""Numbers as people read them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.dashboard.wording import length, lengths_alike, percent, seconds, viewpoint


def test_a_share_has_hundredths_unless_it_is_said_otherwise() -> None:
    assert percent(0.829) == "82.90 %"


@pytest.mark.parametrize(
    ("share", "digits", "text"),
    [
        (None, 1, "-"), (0.0, 1, "0.0 %"), (1.0, 1, "100.0 %"), (0.876, 1, "87.6 %"),
        (0.29, 0, "29 %"), (0.98999, 1, "98.9 %"),
        (0.99999, 1, "99.9 %"), (0.99999, 2, "99.99 %"), (0.0001, 1, "< 0.1 %"),
    ],
)  # fmt: skip
def test_percents(share: float | None, digits: int, text: str) -> None:
    assert percent(share, digits) == text


@given(st.floats(0.0, 1.0 - 1e-6, exclude_min=True), st.integers(0, 3))
def test_only_all_is_100_percent_and_only_none_is_0(share: float, digits: int) -> None:
    assert percent(share, digits) not in (percent(1.0, digits), percent(0.0, digits))


@given(st.just(0.0) | st.floats(0.0001, 1.0))
def test_a_share_is_never_shown_as_more_than_it_is(share: float) -> None:
    shown = float(percent(share, 2).removesuffix(" %")) / 100.0
    assert shown <= share + 1e-9
    assert share - shown < 0.000101


def test_whole_hundredths_stay_what_they_are() -> None:
    for number in range(10_001):
        assert percent(number / 10_000.0, 2) == f"{number // 100}.{number % 100:02d} %"


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, "-"), (0.0123, "12 ms"), (1.25, "1.25 s"), (99.0, "99.00 s"), (3600.0, "3,600.00 s")],
)
def test_seconds(value: float | None, text: str) -> None:
    assert seconds(value) == text


@pytest.mark.parametrize(
    ("values", "texts"),
    [
        ((-118.5, -98.47, -8.47, -0.01), ["-118.5", "-98.5", "-8.5", "0.0"]),
        ((0.85, 0.85), ["0.8500", "0.8500"]),
        ((12345.6, 1.5), ["12,346", "2"]),
        ((2e9, 1.5), ["2.000e+09", "1.500"]),
        ((), []),
    ],
)
def test_lengths_of_a_column_have_the_same_decimals(values: list[float], texts: list[str]) -> None:
    assert lengths_alike(values) == texts


def test_lengths_and_directions() -> None:
    assert length(1234.5) == "1,234"
    assert length(0.04567) == "0.04567"
    assert viewpoint((-0.001, 0.5, -0.8660254), "y") == "from the front, below"
