"""Every request has a name and a line."""

from __future__ import annotations

import logging

import pytest
from starlette.types import Receive, Scope, Send

from service.access.key import Caller
from service.access.key import Scope as KeyScope
from service.middleware.request_log import RequestLog
from tests.service.middleware.asgi import Echo, ask


@pytest.fixture
def lines(caplog: pytest.LogCaptureFixture) -> pytest.LogCaptureFixture:
    caplog.set_level(logging.INFO, "service.requests")
    return caplog


def test_a_request_keeps_its_name(lines: pytest.LogCaptureFixture) -> None:
    inside = Echo()
    answer = ask(RequestLog(inside), headers={"x-request-id": "build-7.lod_2"})
    assert answer.headers["x-request-id"] == "build-7.lod_2"
    assert inside.scopes[0]["state"]["request_id"] == "build-7.lod_2"
    assert "id=build-7.lod_2" in lines.messages[0]


@pytest.mark.parametrize("name", ["", "a b", "a\nb", "x" * 65, "id=7", "é", "<script>"])
def test_a_name_that_could_spoil_the_log_is_replaced(name: str) -> None:
    app = RequestLog(Echo())
    made = [ask(app, headers={"x-request-id": name}).headers["x-request-id"] for _ in range(2)]
    assert name not in made
    assert made[0] != made[1]


def test_a_line_tells_what_was_asked_and_what_came_of_it(lines: pytest.LogCaptureFixture) -> None:
    ask(RequestLog(Echo(status=202, body=(b"abc", b"de"))), "/v1/occluders", "POST")
    assert lines.messages[0].startswith("127.0.0.1 POST /v1/occluders 202 5 bytes ")


def test_a_line_holds_no_secret_and_cannot_be_forged(lines: pytest.LogCaptureFixture) -> None:
    ask(
        RequestLog(Echo()),
        "/v1/jobs/\n127.0.0.1 POST /forged",
        headers={"authorization": "Bearer occ_secret"},
        query_string=b"webhook=https%3A%2F%2Fexample.org%2F%3Ftoken%3Dsecret",
    )
    assert "\n" not in lines.messages[0]
    assert "secret" not in lines.messages[0]


def test_a_line_tells_whose_key_it_was(lines: pytest.LogCaptureFixture) -> None:
    async def keyed(scope: Scope, receive: Receive, send: Send) -> None:
        scope["state"]["caller"] = Caller("studio", KeyScope.READ, "key7")
        await Echo()(scope, receive, send)

    ask(RequestLog(keyed))
    assert "key=key7" in lines.messages[0]


def test_answers_that_fail_are_told_too(lines: pytest.LogCaptureFixture) -> None:
    async def failing(scope: Scope, receive: Receive, send: Send) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b"half", "more_body": True})
        raise ConnectionResetError

    with pytest.raises(ConnectionResetError):
        ask(RequestLog(failing))
    assert "200 4 bytes" in lines.messages[0]
    assert lines.messages[0].endswith("broken off")


@pytest.mark.parametrize(("announced", "end"), [(b"4", "id=first"), (b"5", "broken off")])
def test_who_has_all_may_hang_up(
    lines: pytest.LogCaptureFixture, announced: bytes, end: str
) -> None:
    async def left(scope: Scope, receive: Receive, send: Send) -> None:
        headers = [(b"content-length", announced)]
        await send({"type": "http.response.start", "status": 200, "headers": headers})
        await send({"type": "http.response.body", "body": b"half", "more_body": True})

    ask(RequestLog(left), headers={"x-request-id": "first"})
    assert lines.messages[0].endswith(end)


def test_a_client_without_an_address_is_told_too(lines: pytest.LogCaptureFixture) -> None:
    ask(RequestLog(Echo()), client=None)
    assert lines.messages[0].startswith("- GET ")
