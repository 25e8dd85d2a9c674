"""Where webhooks may go, however it is spelled."""

from __future__ import annotations

import asyncio
import logging
import socket
from ipaddress import ip_address, ip_network

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.errors import InvalidOptionsError
from service.webhooks.address_guard import (
    Address,
    UnsafeAddressError,
    check_webhook,
    fault_of,
    target_of,
)
from tests.service.webhooks.receivers import Names


def check(url: str, *, allow_private: bool = False, names: Names | None = None) -> None:
    asyncio.run(check_webhook(url, allow_private=allow_private, resolve=names))


def fault(url: str, *, allow_private: bool = False, names: Names | None = None) -> str:
    """What a refusal says of the field."""
    with pytest.raises(InvalidOptionsError) as refusal:
        check(url, allow_private=allow_private, names=names)
    (error,) = refusal.value.errors
    assert error.field == "webhook"
    assert error.remedy
    return error.detail


@pytest.mark.parametrize(
    "host",
    [
        "127.0.0.1", "127.1", "127.0.1", "2130706433", "0x7f000001", "0x7f.1", "017700000001",
        "127.8.8.8", "127。0。0。1", "[::1]", "[0:0:0:0:0:0:0:1]", "[::ffff:127.0.0.1]",
        "[::ffff:7f00:1]", "[2002:7f00:1::]", "[64:ff9b::7f00:1]", "[::127.0.0.1]",
        "localhost", "LOCALHOST", "localhost.", "a.localhost",
        "0", "0.0.0.0", "[::]",
    ],
)  # fmt: skip
def test_this_machine_is_refused_however_it_is_spelled(host: str) -> None:
    fault(f"http://{host}:8000/hook")


@pytest.mark.parametrize(
    "host",
    [
        "10.0.0.1", "172.16.0.1", "172.31.255.255", "192.168.1.1", "100.64.0.1", "3232235777",
        "169.254.169.254", "0xa9fea9fe", "[::ffff:169.254.169.254]", "[fd00:ec2::254]",
        "[fe80::1]", "[fc00::1]", "[fec0::1]", "[2002:a00:1::]", "[2002:c0a8:101::1]",
        "[64:ff9b::c0a8:101]", "[64:ff9b:1::1]", "[2001:0:4136:e378::]", "[ff02::1]",
        "224.0.0.1", "239.1.1.1", "240.0.0.1", "255.255.255.255", "198.18.0.1", "192.0.0.192",
        "192.0.2.1", "203.0.113.9", "[2001:db8::1]", "[3fff::1]", "168.63.129.16",
        "100.100.100.200",
    ],
)  # fmt: skip
def test_what_is_not_public_is_refused(host: str) -> None:
    fault(f"https://{host}/hook")


@pytest.mark.parametrize(
    "url",
    [
        "", "hook", "//example.com/", "example.com/hook", "ftp://1.1.1.1/", "file:///etc/passwd",
        "gopher://1.1.1.1/", "javascript:alert(1)", "http://", "http:///path", "http://:80/",
        "http://user@1.1.1.1/", "http://user:word@1.1.1.1/", "http://1.1.1.1\\@127.0.0.1/",
        "http://1.1.1.1:0/", "http://1.1.1.1:65536/", "http://1.1.1.1:-1/", "http://1.1.1.1:x/",
        "http://1.1.1.1\x00/", "http://1.1.1.1/a\r\nHost: b", "http://0177.0.0.1/",
        "http://[::1/", "http://①②⑦.⓪.⓪.①/", "http://1.1.1.1/" + "a" * 2000,
    ],
)  # fmt: skip
@pytest.mark.parametrize("allow_private", [False, True])
def test_what_is_no_plain_url_is_refused(url: str, allow_private: bool) -> None:
    fault(url, allow_private=allow_private)


@pytest.mark.parametrize(
    "url",
    [
        "http://1.1.1.1/",
        "https://8.8.8.8:8443/hook?room=7#top",
        "https://[2606:4700:4700::1111]/",
        "https://[64:ff9b::808:808]/",
        "https://[::ffff:8.8.8.8]/",
        "HTTPS://9.9.9.9",
    ],
)
def test_public_addresses_are_accepted(url: str) -> None:
    check(url)


@pytest.mark.parametrize("host", ["127.0.0.1", "[::1]", "10.1.2.3", "192.168.0.9", "[fd12::1]"])
def test_private_addresses_are_accepted_where_they_are_allowed(host: str) -> None:
    check(f"http://{host}:9000/hook", allow_private=True)


@pytest.mark.parametrize(
    "host",
    [
        "169.254.169.254", "[fe80::a9fe:a9fe]", "[fd00:ec2::254]", "100.100.100.200",
        "168.63.129.16", "0.0.0.0", "[::]", "255.255.255.255", "224.0.0.1", "192.0.0.192",
        "[::ffff:169.254.169.254]",
    ],
)  # fmt: skip
def test_what_serves_a_clouds_secrets_is_refused_even_then(host: str) -> None:
    fault(f"http://{host}/latest/meta-data", allow_private=True)


def test_a_refusal_tells_nothing_of_the_network_inside(caplog: pytest.LogCaptureFixture) -> None:
    """Not where a name leads, nor whether there is such a name; the owner's log says it."""

    async def nothing(host: str, port: int) -> list[Address]:
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    names = Names({host: ["10.0.0.7"] for host in ("db.corp", "hook.example")})
    with caplog.at_level(logging.INFO, "service.webhooks"):
        inside = fault("https://db.corp/", names=names)
    assert "db.corp" in inside
    assert "10.0.0.7" not in inside
    assert "10.0.0.7" in caplog.text
    with pytest.raises(InvalidOptionsError) as refusal:
        asyncio.run(check_webhook("https://db.corp/", allow_private=False, resolve=nothing))
    assert refusal.value.errors[0].detail == inside


def test_every_address_of_a_name_must_be_public() -> None:
    fault("https://hook.example/", names=Names({"hook.example": ["1.1.1.1 10.0.0.7"]}))
    check("https://hook.example/", names=Names({"hook.example": ["1.1.1.1 8.8.8.8"]}))


def test_the_local_names_are_not_left_to_the_resolver() -> None:
    names = Names({"localhost": ["1.1.1.1"]})
    fault("http://localhost/", names=names)
    assert not names.asked


def test_a_name_without_an_address_is_refused() -> None:
    async def nothing(host: str, port: int) -> list[Address]:
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    with pytest.raises(InvalidOptionsError, match="hook"):
        asyncio.run(check_webhook("http://hook.example/", allow_private=False, resolve=nothing))


def test_a_name_that_cannot_be_resolved_just_now_passes() -> None:
    async def busy(host: str, port: int) -> list[Address]:
        raise socket.gaierror(socket.EAI_AGAIN, "Temporary failure in name resolution")

    asyncio.run(check_webhook("http://hook.example/", allow_private=False, resolve=busy))


def test_a_resolver_that_hangs_does_not_hold_up_a_submission(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def hanging(host: str, port: int) -> list[Address]:
        await asyncio.Event().wait()
        raise AssertionError

    monkeypatch.setattr("service.webhooks.address_guard._RESOLVE_SECONDS", 0.05)
    asyncio.run(check_webhook("http://hook.example/", allow_private=False, resolve=hanging))


@pytest.mark.parametrize("host", ["a..b", "a" * 70 + ".example"])
def test_odd_names_are_refused_and_break_nothing(host: str) -> None:
    fault(f"http://{host}/")


def test_an_international_name_is_asked_for_in_ascii() -> None:
    assert target_of("https://exämple.com/").host == "xn--exmple-cua.com"


@given(st.ip_addresses(v=4))
def test_an_ipv4_address_is_judged_the_same_in_ipv6(address: Address) -> None:
    """Mapped, by NAT64 and by 6to4."""
    plain = fault_of(address, allow_private=False)
    number = int(address)
    for disguised in (
        (0xFFFF << 32) | number,
        (0x64FF9B << 96) | number,
        (0x2002 << 112) | (number << 80),
    ):
        assert fault_of(ip_address(disguised.to_bytes(16)), allow_private=False) == plain


@given(st.ip_addresses())
def test_nothing_passes_that_python_calls_private(address: Address) -> None:
    if fault_of(address, allow_private=False) is None:
        inner = getattr(address, "ipv4_mapped", None) or getattr(address, "sixtofour", None)
        assert (inner or address).is_global or address in ip_network("64:ff9b::/96")


@given(st.text(max_size=60))
def test_no_text_breaks_the_parser(text: str) -> None:
    for url in (text, f"http://{text}", f"https://example.com{text}"):
        try:
            target = target_of(url)
        except UnsafeAddressError:
            continue
        assert 1 <= target.port <= 65535
