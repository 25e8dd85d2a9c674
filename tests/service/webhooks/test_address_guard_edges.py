"""The guard to the letter: ports, lengths, names without a host, and a caller who is gone."""

from __future__ import annotations

import asyncio
import threading
from ipaddress import ip_address
from typing import Any

import pytest

from service.jobs.stores import LONGEST_URL
from service.webhooks import address_guard
from service.webhooks.address_guard import (
    Address,
    UnsafeAddressError,
    addresses_of,
    safe_addresses,
    target_of,
)


@pytest.mark.parametrize(
    ("url", "port"),
    [("https://a.example/", 443), ("http://a.example/", 80), ("http://a.example:81/", 81)],
)
def test_the_port_is_the_schemes_unless_it_is_given(url: str, port: int) -> None:
    assert target_of(url).port == port


@pytest.mark.parametrize("url", ["http://", "http:///path", "https://:443/"])
def test_a_url_without_a_host_is_refused_before_anyone_is_asked(url: str) -> None:
    with pytest.raises(UnsafeAddressError, match="host"):
        target_of(url)


def test_a_refusal_says_why_and_what_to_do() -> None:
    assert str(UnsafeAddressError("it is not a URL", "give one")) == "it is not a URL; give one"


def test_a_url_may_be_as_long_as_the_limit() -> None:
    longest = "http://1.1.1.1/".ljust(LONGEST_URL, "a")
    assert target_of(longest).host == "1.1.1.1"
    with pytest.raises(UnsafeAddressError, match="too long; give"):
        target_of(longest + "a")


def test_the_names_of_this_machine_are_asked_for_where_private_addresses_are_allowed() -> None:
    async def loopback(host: str, port: int) -> list[Address]:
        return [ip_address("127.0.0.1")]

    target = target_of("http://localhost:9000/")
    found = asyncio.run(safe_addresses(target, allow_private=True, resolve=loopback))
    assert found == [ip_address("127.0.0.1")]


def test_a_resolver_that_answers_late_disturbs_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its thread keeps no process alive, and its answer is dropped."""
    asked, go_on = threading.Event(), threading.Event()
    faults: list[dict[str, Any]] = []

    def slow(host: str, port: int) -> list[Address]:
        asked.set()
        assert go_on.wait(10)
        return []

    async def main() -> None:
        before = set(threading.enumerate())
        asyncio.get_running_loop().set_exception_handler(lambda _, fault: faults.append(fault))
        task = asyncio.create_task(addresses_of("slow.example", 80))
        while not asked.is_set():
            await asyncio.sleep(0)
        (thread,) = set(threading.enumerate()) - before
        assert thread.name == "resolver"
        assert thread.daemon
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        go_on.set()
        while thread.is_alive():
            await asyncio.sleep(0)
        await asyncio.sleep(0)

    monkeypatch.setattr(address_guard, "_ask_resolver", slow)
    asyncio.run(main())
    assert not faults
