"""The surroundings as a whole."""

from __future__ import annotations

from service.app import surround
from service.settings import Settings
from tests.service.middleware.asgi import Echo, ask


def test_refusals_have_a_name_and_the_headers_too() -> None:
    answer = ask(surround(Echo(), Settings()), headers={"host": "evil.example"})
    assert answer.status == 421
    assert answer.headers["x-request-id"]
    assert answer.headers["x-content-type-options"] == "nosniff"


def test_a_request_goes_through() -> None:
    inside = Echo()
    answer = ask(surround(inside, Settings()))
    assert (answer.status, answer.body) == (200, b"done")
    assert inside.scopes[0]["state"]["request_id"] == answer.headers["x-request-id"]


def test_the_start_and_the_end_of_the_application_pass_through() -> None:
    inside = Echo()
    ask(surround(inside, Settings()), type="lifespan")
    assert inside.scopes[0]["type"] == "lifespan"
