"""Failed attempts fade, and are counted by address."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from service.access.attempts import FailedAttempts


class Clock:
    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


def fail(attempts: FailedAttempts, address: str, times: int) -> None:
    for _ in range(times):
        attempts.count(address)


def test_as_many_as_the_limit_are_free_and_the_next_has_to_wait() -> None:
    attempts = FailedAttempts(Clock(), limit=20, seconds=60.0)
    fail(attempts, "192.0.2.1", 19)
    assert attempts.seconds_to_wait("192.0.2.1") == 0
    fail(attempts, "192.0.2.1", 1)
    assert attempts.seconds_to_wait("192.0.2.1") == 3


def test_whoever_waits_as_long_as_told_may_fail_once_more() -> None:
    clock = Clock()
    attempts = FailedAttempts(clock, limit=20, seconds=60.0)
    fail(attempts, "192.0.2.1", 25)
    clock.now += attempts.seconds_to_wait("192.0.2.1")
    assert attempts.seconds_to_wait("192.0.2.1") == 0
    attempts.count("192.0.2.1")
    assert attempts.seconds_to_wait("192.0.2.1") > 0


def test_addresses_do_not_count_for_each_other() -> None:
    attempts = FailedAttempts(Clock())
    fail(attempts, "192.0.2.1", 100)
    assert attempts.seconds_to_wait("192.0.2.2") == 0
    assert attempts.seconds_to_wait("") == 0


def test_the_addresses_of_one_ipv6_network_count_together() -> None:
    attempts = FailedAttempts(Clock())
    for host in range(100):
        attempts.count(f"2001:db8:0:7::{host:x}")
    assert attempts.seconds_to_wait("2001:db8:0:7:ffff::1") > 0
    assert attempts.seconds_to_wait("2001:db8:0:8::1") == 0


def test_a_flood_of_addresses_is_not_remembered_for_ever() -> None:
    attempts = FailedAttempts(Clock())
    fail(attempts, "first", 100)
    for address in range(10_000):
        attempts.count(f"address {address}")
    assert attempts.seconds_to_wait("first") == 0
    fail(attempts, "address 9999", 100)
    assert attempts.seconds_to_wait("address 9999") > 0


@given(st.lists(st.floats(0.0, 10.0), max_size=200))
def test_never_more_than_twice_the_limit_fail_in_a_minute(pauses: list[float]) -> None:
    """Whoever fails as soon as allowed: those in a row, and those that faded meanwhile."""
    clock = Clock()
    attempts = FailedAttempts(clock, limit=5, seconds=60.0)
    failed: list[float] = []
    for pause in pauses:
        clock.now += pause
        if not attempts.seconds_to_wait("a"):
            attempts.count("a")
            failed.append(clock.now)
    for begin in failed:
        assert sum(begin <= at < begin + 60.0 for at in failed) <= 10
