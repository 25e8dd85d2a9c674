"""Which requests other web sites could have made a browser send."""

from __future__ import annotations

import json
from typing import Any

import pytest

from service.middleware.host_guard import HostGuard
from service.settings import Settings
from tests.service.middleware.asgi import Echo, ask


def status(
    settings: dict[str, Any],
    headers: dict[str, str] | list[tuple[str, str]],
    method: str = "GET",
) -> int:
    return ask(HostGuard(Echo(), Settings(**settings)), method=method, headers=headers).status


def host(settings: dict[str, Any], name: str) -> int:
    return status(settings, {"host": name})


@pytest.mark.parametrize(
    "name",
    ["localhost", "localhost:8000", "LocalHost:1", "127.0.0.1:8000", "127.8.9.1", "[::1]:8000"],
)
def test_a_service_on_loopback_is_asked_by_its_own_names(name: str) -> None:
    assert host({}, name) == 200


@pytest.mark.parametrize(
    "name",
    [
        "evil.example", "evil.example:8000", "localhost.evil.example", "evil.localhost",
        "0.0.0.0:8000", "192.168.1.5", "[::]", "[fe80::1]", "127.1", "2130706433", "0x7f000001",
        "localhost@evil.example", "localhost:8000@evil", "user@localhost", "localhost:99999999",
        "localhost, evil.example", "localhost/evil", "local host", "", "[::1", "::1", "[localhost]",
        "\u217docalhost".encode().decode("latin-1"),
    ],
)  # fmt: skip
def test_other_names_are_refused_on_loopback(name: str) -> None:
    assert host({}, name) == 421


@pytest.mark.parametrize(
    "headers",
    [[], [("host", "localhost"), ("host", "evil.example")], [("host", "a"), ("host", "localhost")]],
)
def test_a_request_names_one_host(headers: list[tuple[str, str]]) -> None:
    assert status({}, headers) == 421


def test_a_refusal_says_which_host_and_what_to_do() -> None:
    answer = ask(HostGuard(Echo(), Settings()), "/v1/jobs", headers={"host": "evil.example"})
    problem = json.loads(answer.body)
    assert answer.headers["content-type"] == "application/problem+json"
    assert problem["type"] == "/problems/misdirected"
    assert "evil.example" in problem["detail"]
    assert "OCCLUDER_ALLOWED_HOSTS" in problem["remedy"]
    assert problem["instance"] == "/v1/jobs"


def test_allowed_names_reach_the_service() -> None:
    settings = {"allowed_hosts": "build.example.org, *.studio.example"}
    assert host(settings, "build.example.org:8000") == 200
    assert host(settings, "Occluders.Studio.example") == 200
    assert host(settings, "localhost") == 200
    assert host(settings, "studio.example") == 421
    assert host(settings, "evilstudio.example") == 421
    assert host(settings, "evil.example") == 421


def test_the_public_name_reaches_the_service() -> None:
    settings = {"public_url": "https://occluders.example.org/base"}
    assert host(settings, "occluders.example.org") == 200
    assert host(settings, "evil.example") == 421


def test_beyond_loopback_any_address_will_do_and_names_only_with_keys() -> None:
    """A name that a site may bend is of no use to it where a key is needed."""
    without_keys = {"host": "0.0.0.0", "require_keys": False}
    assert host(without_keys, "10.1.2.3:8000") == 200
    assert host(without_keys, "[2001:db8::7]") == 200
    assert host(without_keys, "evil.example") == 421
    assert host({"host": "0.0.0.0"}, "build") == 200
    assert host({"host": "0.0.0.0", "allowed_hosts": "build"}, "build") == 200
    assert host({"host": "0.0.0.0", "allowed_hosts": "build"}, "evil.example") == 421
    assert host({**without_keys, "allowed_hosts": "*"}, "evil.example") == 200


@pytest.mark.parametrize("method", ["POST", "PUT", "PATCH", "DELETE", "ODD"])
@pytest.mark.parametrize(
    "headers",
    [
        {"origin": "https://evil.example"},
        {"origin": "http://localhost:3000"},
        {"origin": "http://localhost"},
        {"origin": "null"},
        {"origin": ""},
        {"origin": "http://["},
        {"origin": "http://localhost:8000", "sec-fetch-site": "cross-site"},
        {"sec-fetch-site": "cross-site"},
        {"sec-fetch-site": "same-site"},
    ],
)
def test_pages_of_other_origins_change_nothing(method: str, headers: dict[str, str]) -> None:
    assert status({}, {"host": "localhost:8000", **headers}, method) == 403
    assert status({}, {"host": "localhost:8000", **headers}, "GET") == 200


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"origin": "http://localhost:8000"},
        {"origin": "http://localhost:8000", "sec-fetch-site": "same-origin"},
        {"sec-fetch-site": "none"},
    ],
)
def test_programs_and_pages_of_its_own_may_change_things(headers: dict[str, str]) -> None:
    assert status({}, {"host": "localhost:8000", **headers}, "POST") == 200


def test_pages_under_the_public_name_may_change_things_through_a_proxy() -> None:
    settings = {"public_url": "https://occluders.example.org"}
    headers = {"host": "127.0.0.1:8000", "origin": "https://occluders.example.org"}
    assert status(settings, headers, "POST") == 200
    assert status(settings, {**headers, "origin": "https://evil.example"}, "POST") == 403


def test_what_is_refused_does_not_reach_the_application() -> None:
    inside = Echo()
    ask(HostGuard(inside, Settings()), headers={"host": "evil.example"})
    assert not inside.scopes


def test_web_sockets_are_held_to_the_same() -> None:
    guard = HostGuard(Echo(), Settings())
    headers = {"host": "localhost:8000", "origin": "https://evil.example"}
    answer = ask(guard, headers=headers, type="websocket")
    assert answer.messages == [{"type": "websocket.close", "code": 1008}]
