"""Whom the service takes a request to come from."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import replace

import pytest

from service.access.authentication import Authenticator, demand
from service.access.key import (
    LOCAL,
    ApiKey,
    Caller,
    Scope,
    hint_of,
    new_secret,
    with_checksum,
)
from service.access.session import COOKIE, SESSION_SECONDS, Session, Sessions
from service.errors import (
    ForbiddenError,
    TooManyAttemptsError,
    UnauthenticatedError,
)

HERE = "192.0.2.7"


class Keys:
    """A key store in memory, which counts how often it is asked."""

    def __init__(self) -> None:
        self._keys: dict[str, ApiKey] = {}
        self.asked = 0
        self.ended: dict[str, float] = {}
        self.signed_in: list[tuple[str | None, str]] = []
        self.now = 0.0

    def create(
        self, tenant: str, name: str, scope: Scope, *, expires: float | None = None
    ) -> tuple[ApiKey, str]:
        secret = new_secret()
        number = f"{len(self._keys):032x}"
        key = ApiKey(number, tenant, name, scope, hint_of(secret), 0.0, expires=expires)
        self._keys[secret] = key
        return key, secret

    def revoke(self, key_id: str) -> None:
        for secret, key in self._keys.items():
            if key.id == key_id:
                self._keys[secret] = replace(key, revoked=0.0)

    def find(self, secret: str) -> ApiKey | None:
        self.asked += 1
        key = self._keys.get(secret)
        return key if key is not None and key.counts_at(self.now) else None

    def key(self, key_id: str) -> ApiKey | None:
        self.asked += 1
        found = (key for key in self._keys.values() if key.id == key_id)
        return next((key for key in found if key.counts_at(self.now)), None)

    def begin_session(self, key: Caller, address: str) -> None:
        self.signed_in.append((key.key_id, address))

    def end_session(self, session: Session, address: str) -> None:
        self.ended[session.name] = float(session.expires)

    def has_ended(self, session: Session) -> bool:
        return session.name in self.ended

    def ended_sessions(self, now: float) -> Mapping[str, float]:
        return {name: expires for name, expires in self.ended.items() if expires > now}


class Clock:
    def __init__(self) -> None:
        self.now = 50.0

    def __call__(self) -> float:
        return self.now


class Door:
    """An authenticator with its store and clock."""

    def __init__(self, *, keys_needed: bool = True) -> None:
        self.keys, self.clock = Keys(), Clock()
        self._keys_needed = keys_needed
        self.restart()

    def restart(self) -> None:
        self.authenticator = Authenticator(
            self.keys,
            Sessions(bytes(32)),
            keys_needed=self._keys_needed,
            clock=self.clock,
            time_of_day=self.clock,
        )

    def caller(self, headers: Mapping[str, str], address: str = HERE) -> Caller:
        return self.authenticator.caller(headers, address)

    def refuse(self, secret: str, address: str = HERE) -> None:
        with pytest.raises(UnauthenticatedError):
            self.caller({"x-api-key": secret}, address)


def unknown(beginning: str) -> str:
    """What has the form of a key and is none of anybody's."""
    return with_checksum(f"occ_{beginning:0<43}")


def bearer(secret: str) -> dict[str, str]:
    return {"authorization": f"Bearer {secret}"}


def test_without_keys_needed_whoever_asks_is_local() -> None:
    assert Door(keys_needed=False).caller({}) == LOCAL


def test_a_key_that_is_sent_is_judged_even_where_none_is_needed() -> None:
    door = Door(keys_needed=False)
    key, secret = door.keys.create("studio", "ci", Scope.READ)
    assert door.caller(bearer(secret)) == Caller("studio", Scope.READ, key.id)
    door.refuse(unknown("ofNobody"))


@pytest.mark.parametrize(
    "headers",
    [{}, {"authorization": ""}, {"authorization": "Bearer "}, {"x-api-key": "  "}],
)
def test_a_request_without_a_key_is_told_how_to_get_one(headers: dict[str, str]) -> None:
    with pytest.raises(UnauthenticatedError) as refusal:
        Door().caller(headers)
    assert "occluder keys create" in refusal.value.remedy
    assert refusal.value.headers == {"WWW-Authenticate": "Bearer"}


def test_another_scheme_than_bearer_is_named() -> None:
    with pytest.raises(UnauthenticatedError, match="Bearer"):
        Door().caller({"authorization": "Basic b2NjOm9jYw=="})


@pytest.mark.parametrize("form", ["Bearer {}", "bearer {}", "BEARER   {} "])
def test_a_key_comes_as_bearer(form: str) -> None:
    door = Door()
    key, secret = door.keys.create("studio", "ci", Scope.WRITE)
    found = door.caller({"authorization": form.format(secret)})
    assert found == Caller("studio", Scope.WRITE, key.id)


def test_a_key_comes_beside_the_authorization_of_a_proxy() -> None:
    door = Door()
    _, secret = door.keys.create("studio", "ci", Scope.WRITE)
    headers = {"authorization": "Basic b2NjOm9jYw==", "x-api-key": secret}
    assert door.caller(headers).tenant == "studio"


def test_a_key_in_use_is_looked_up_at_most_once_a_second() -> None:
    door = Door()
    _, secret = door.keys.create("studio", "ci", Scope.READ)
    for _ in range(100):
        door.caller(bearer(secret))
        door.clock.now += 0.009
    assert door.keys.asked == 1
    door.clock.now += 1.0
    door.caller(bearer(secret))
    assert door.keys.asked == 2


def test_a_revoked_key_ends_within_a_second_and_is_then_as_any_unknown_one() -> None:
    door = Door()
    key, secret = door.keys.create("studio", "ci", Scope.READ)
    door.caller(bearer(secret))
    door.keys.revoke(key.id)
    door.clock.now += 1.01
    for _ in range(20):
        door.refuse(secret)
    with pytest.raises(TooManyAttemptsError):
        door.caller(bearer(secret))


def test_a_key_that_expires_ends_within_a_second_and_its_session_too() -> None:
    door = Door()
    _, secret = door.keys.create("studio", "ci", Scope.READ, expires=60.0)
    session = in_cookie(door.authenticator.sign_in(secret, HERE))
    for headers in (bearer(secret), session):
        door.clock.now, door.keys.now = 59.0, 59.0
        assert door.caller(headers).tenant == "studio"
        door.clock.now, door.keys.now = 60.01, 60.01
        with pytest.raises(UnauthenticatedError):
            door.caller(headers)


def test_an_unknown_key_may_be_made_known_at_once() -> None:
    """Nothing remembers what was not there."""
    door = Door()
    door.refuse(unknown("a"))
    _, secret = door.keys.create("studio", "ci", Scope.READ)
    assert door.caller(bearer(secret)).tenant == "studio"


@pytest.mark.parametrize(("form", "looked_up"), [pytest.param("same{}", 0, id="alike"), ("{}x", 1)])
def test_the_twenty_first_unknown_key_of_a_minute_is_put_off(form: str, looked_up: int) -> None:
    """Without a look-up where all begin alike."""
    door = Door()
    for number in range(20):
        door.refuse(unknown(form.format(number)))
    asked = door.keys.asked
    with pytest.raises(TooManyAttemptsError) as refusal:
        door.caller(bearer(unknown(form.format(20))))
    assert refusal.value.status == 429
    assert refusal.value.headers == {"Retry-After": "3"}
    assert door.keys.asked == asked + looked_up
    door.refuse(unknown(form.format(21)), "192.0.2.8")


def test_a_key_that_was_never_used_gets_in_beside_any_number_of_unknown_ones() -> None:
    """All behind a proxy share an address: one of them must not lock out the others."""
    door = Door()
    for number in range(200):
        with pytest.raises((UnauthenticatedError, TooManyAttemptsError)):
            door.caller(bearer(unknown(f"{number}x")))
    _, secret = door.keys.create("studio", "ci", Scope.READ)
    assert door.caller(bearer(secret)).tenant == "studio"


def test_a_key_in_use_is_not_locked_out_by_others_behind_its_proxy() -> None:
    door = Door()
    _, secret = door.keys.create("studio", "ci", Scope.READ)
    door.caller(bearer(secret))
    for number in range(20):
        door.refuse(unknown(f"{number}x"))
    door.clock.now += 1.5
    assert door.caller(bearer(secret)).tenant == "studio"


def test_a_request_without_a_key_counts_as_no_attempt() -> None:
    door = Door()
    _, secret = door.keys.create("studio", "ci", Scope.READ)
    for _ in range(100):
        with pytest.raises(UnauthenticatedError):
            door.caller({})
    assert door.caller(bearer(secret)).tenant == "studio"


@pytest.mark.parametrize(
    "slip",
    [
        lambda key: key[:-1] + ("0" if key[-1] != "0" else "1"),
        lambda key: key[:5] + key[6] + key[5] + key[7:],
        lambda key: key[:-1],
        lambda key: key + "0",
        lambda key: key.swapcase(),
        lambda key: "password",
    ],
)
def test_a_slip_in_a_key_costs_no_look_up_and_no_attempt(slip: Callable[[str], str]) -> None:
    door = Door()
    secret = with_checksum(f"occ_{'aB3':x<43}")
    for _ in range(50):
        door.refuse(slip(secret))
    assert door.keys.asked == 0
    with pytest.raises(UnauthenticatedError, match="checksum"):
        door.authenticator.sign_in(slip(secret), HERE)
    with pytest.raises(UnauthenticatedError, match="not known"):
        door.caller(bearer(secret))
    assert door.keys.asked == 1


def test_keys_not_used_for_long_are_forgotten() -> None:
    door = Door()
    key, secret = door.keys.create("studio", "ci", Scope.READ)
    _, other = door.keys.create("studio", "desk", Scope.READ)
    for wait, lets_in in ((500.0, True), (700.0, False)):
        door.caller(bearer(secret))
        door.clock.now += wait
        door.caller(bearer(other))
        for number in range(20):
            door.refuse(unknown(f"{key.hint.removeprefix('occ_')}{number}"))
        if lets_in:
            door.caller(bearer(secret))
        else:
            with pytest.raises(TooManyAttemptsError):
                door.caller(bearer(secret))


def test_callers_may_come_in_many_threads() -> None:
    door = Door()
    made = [door.keys.create(f"tenant {number}", "ci", Scope.READ)[1] for number in range(8)]
    wrong: list[str] = []

    def ask(number: int) -> None:
        for _ in range(300):
            tenant = door.caller(bearer(made[number])).tenant
            door.clock.now += 0.01
            if tenant != f"tenant {number}":
                wrong.append(tenant)

    threads = [threading.Thread(target=ask, args=(number,)) for number in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


@pytest.mark.parametrize("held", list(Scope))
@pytest.mark.parametrize("needed", list(Scope))
def test_a_scope_reaches_as_far_as_those_before_it(held: Scope, needed: Scope) -> None:
    order = ["read", "write", "admin"]
    if order.index(held) >= order.index(needed):
        demand(Caller("studio", held), needed)
    else:
        with pytest.raises(ForbiddenError, match=f"use a key with the scope '{needed}'"):
            demand(Caller("studio", held), needed)


def in_cookie(token: str) -> dict[str, str]:
    return {"cookie": f"theme=dark; {COOKIE}={token}; other=1"}


def test_a_session_stands_for_its_key() -> None:
    door = Door()
    key, secret = door.keys.create("studio", "desk", Scope.WRITE)
    token = door.authenticator.sign_in(secret, HERE)
    assert secret not in token
    assert door.keys.signed_in == [(key.id, HERE)]
    assert door.caller(in_cookie(token)) == Caller("studio", Scope.WRITE, key.id)


def test_a_session_ends_within_a_second_of_its_key() -> None:
    door = Door()
    key, secret = door.keys.create("studio", "desk", Scope.READ)
    token = door.authenticator.sign_in(secret, HERE)
    door.caller(in_cookie(token))
    door.keys.revoke(key.id)
    door.clock.now += 1.1
    with pytest.raises(UnauthenticatedError):
        door.caller(in_cookie(token))


def test_a_session_that_was_signed_out_ends_at_once_and_for_good() -> None:
    door = Door()
    _, secret = door.keys.create("studio", "desk", Scope.READ)
    copied, other = (in_cookie(door.authenticator.sign_in(secret, HERE)) for _ in range(2))
    door.caller(copied)
    door.authenticator.sign_out(copied, HERE)
    for _ in range(2):
        assert door.authenticator.caller_at_once(copied) is None
        with pytest.raises(UnauthenticatedError):
            door.caller(copied)
        assert door.caller(other).tenant == "studio"
        door.restart()
    door.authenticator.sign_out({"cookie": f"{COOKIE}=nonsense"}, HERE)
    door.authenticator.sign_out({}, HERE)


def test_a_session_runs_out() -> None:
    door = Door()
    _, secret = door.keys.create("studio", "desk", Scope.READ)
    token = door.authenticator.sign_in(secret, HERE)
    door.clock.now += SESSION_SECONDS - 1.0
    door.caller(in_cookie(token))
    door.clock.now += 1.0
    with pytest.raises(UnauthenticatedError):
        door.caller(in_cookie(token))


def test_a_key_that_nobody_has_gives_no_session_and_counts_as_an_attempt() -> None:
    door = Door()
    for _ in range(20):
        with pytest.raises(UnauthenticatedError):
            door.authenticator.sign_in(new_secret(), HERE)
    with pytest.raises(TooManyAttemptsError):
        door.authenticator.sign_in(new_secret(), HERE)


def test_a_session_that_is_looked_up_again_and_again_asks_the_store_once_a_second() -> None:
    door = Door()
    _, secret = door.keys.create("studio", "desk", Scope.READ)
    token = door.authenticator.sign_in(secret, HERE)
    asked = door.keys.asked
    for _ in range(50):
        door.caller(in_cookie(token))
    assert door.keys.asked == asked + 1


def test_a_key_counts_before_a_session() -> None:
    door = Door()
    _, desk = door.keys.create("studio", "desk", Scope.READ)
    other, secret = door.keys.create("other", "ci", Scope.WRITE)
    headers = in_cookie(door.authenticator.sign_in(desk, HERE)) | bearer(secret)
    assert door.caller(headers) == Caller("other", Scope.WRITE, other.id)


def test_where_no_key_is_needed_an_old_session_does_no_harm() -> None:
    assert Door(keys_needed=False).caller(in_cookie("of.another.service")) == LOCAL
