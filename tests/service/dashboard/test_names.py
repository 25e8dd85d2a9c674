"""Names, and where they may be broken."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.dashboard.names import parts_of


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("castle", ["castle"]),
        ("props/castle_gate-2.glb", ["props/", "castle_", "gate-", "2.", "glb"]),
        ("/a//b ", ["/", "a//", "b "]),
        ("", []),
    ],
)
def test_a_name_breaks_after_what_parts_it(name: str, parts: list[str]) -> None:
    assert parts_of(name) == parts


@given(st.text(max_size=50))
def test_nothing_of_a_name_is_lost(name: str) -> None:
    assert "".join(parts_of(name)) == name
