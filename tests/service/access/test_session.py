"""The cookie's value: made here, whole, and not for ever."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from service.access.session import COOKIE, SESSION_SECONDS, Sessions, token_in

KEY_ID = "0123456789abcdef" * 2
SESSIONS = Sessions(bytes(range(32)))
NOW = 1_000_000.0


def test_a_token_names_its_key_until_it_runs_out() -> None:
    token = SESSIONS.token(KEY_ID, NOW)
    session = SESSIONS.read(token, NOW)
    assert session is not None
    assert (session.key_id, session.expires) == (KEY_ID, NOW + SESSION_SECONDS)
    assert SESSIONS.read(token, NOW + SESSION_SECONDS) is None


def test_two_sessions_of_a_moment_are_two() -> None:
    assert SESSIONS.token(KEY_ID, NOW) != SESSIONS.token(KEY_ID, NOW)


def test_a_token_of_another_secret_is_none() -> None:
    assert SESSIONS.read(Sessions(bytes(32)).token(KEY_ID, NOW), NOW) is None


@given(st.integers(0, 10_000), st.characters(min_codepoint=33, max_codepoint=126))
def test_a_token_with_any_character_changed_is_none(place: int, other: str) -> None:
    token = SESSIONS.token(KEY_ID, NOW)
    place %= len(token)
    changed = token[:place] + other + token[place + 1 :]
    assert (SESSIONS.read(changed, NOW) is not None) == (changed == token)


@given(st.text(max_size=120))
def test_any_text_is_read_without_harm(text: str) -> None:
    assert SESSIONS.read(text, NOW) is None
    token_in({"cookie": text})


def test_the_cookie_is_found_among_others() -> None:
    assert token_in({"cookie": f"a=1;{COOKIE}=x.y=z ; b"}) == "x.y=z"
    assert token_in({"cookie": f"not_{COOKIE}=1; {COOKIE}="}) is None
    assert token_in({}) is None
