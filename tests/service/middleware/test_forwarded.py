"""Whose address counts, where proxies are in front."""

from __future__ import annotations

import logging

import pytest

from service.app import surround
from service.settings import Settings, read_settings
from tests.service.middleware.asgi import Echo, ask

TRUSTED = "10.0.0.0/8, 2001:db8:1::7"
XFF, FWD = "x-forwarded-for", "forwarded"


def address_of(peer: str, *headers: tuple[str, str], trusted: str = TRUSTED) -> str:
    inside = Echo()
    settings = read_settings({"trusted_proxies": trusted})
    told = [("host", "localhost"), *headers]
    assert ask(surround(inside, settings), headers=told, client=(peer, 5000)).status == 200
    return inside.scopes[0]["client"][0]


@pytest.mark.parametrize(
    ("headers", "client"),
    [
        ([], "10.0.0.1"),
        ([(XFF, "198.51.100.7")], "198.51.100.7"),
        ([(XFF, "203.0.113.9, 198.51.100.7")], "198.51.100.7"),
        ([(XFF, "203.0.113.9, 198.51.100.7, 10.1.2.3")], "198.51.100.7"),
        ([(XFF, "203.0.113.9"), (XFF, "198.51.100.7,10.1.2.3")], "198.51.100.7"),
        ([(XFF, "10.7.7.7, 10.1.2.3")], "10.7.7.7"),
        ([(XFF, "198.51.100.7:4711")], "198.51.100.7"),
        ([(XFF, "::ffff:198.51.100.7")], "198.51.100.7"),
        ([(XFF, "203.0.113.9, who knows, 10.1.2.3")], "10.1.2.3"),
        ([(XFF, "127.0.0.1")], "127.0.0.1"),
        ([(FWD, "for=198.51.100.7")], "198.51.100.7"),
        ([(FWD, 'for=203.0.113.9, proto=https;For="[2001:db8:9::1]:80";by=10.0.0.2')],
         "2001:db8:9::1"),
        ([(FWD, "for=203.0.113.9, for=_hidden, for=10.1.2.3")], "10.1.2.3"),
        ([(FWD, "for=198.51.100.7"), (XFF, "198.51.100.7")], "198.51.100.7"),
        ([(FWD, "for=203.0.113.9"), (XFF, "198.51.100.7")], "10.0.0.1"),
    ],
)  # fmt: skip
def test_the_last_address_that_is_no_proxy_counts(
    headers: list[tuple[str, str]], client: str
) -> None:
    assert address_of("10.0.0.1", *headers) == client


@pytest.mark.parametrize("peer", ["192.0.2.1", "2001:db8:1::8"])
def test_strangers_cannot_say_who_they_are(peer: str) -> None:
    assert address_of(peer, (XFF, "198.51.100.7"), (FWD, "for=198.51.100.7")) == peer


def test_nobody_is_trusted_unless_it_is_set() -> None:
    assert address_of("10.0.0.1", (XFF, "198.51.100.7"), trusted="") == "10.0.0.1"


def test_the_log_has_the_forwarded_address(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, "service.requests"):
        address_of("2001:db8:1::7", (XFF, "198.51.100.7"))
    assert caplog.messages[0].startswith("198.51.100.7 GET ")


def test_where_a_proxy_is_no_address_the_setting_is_named() -> None:
    with pytest.raises(Exception, match="OCCLUDER_TRUSTED_PROXIES cannot be 'proxy'"):
        read_settings({"trusted_proxies": "10.0.0.1, proxy"})
    assert Settings().trusted_proxies == ()
