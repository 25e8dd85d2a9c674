"""What is shown of an answer leads nobody into the network inside."""

from __future__ import annotations

import asyncio

import httpx
import pytest

from service.webhooks.excerpt import MAY_BE_SHOWN, excerpt_of, without_addresses
from service.webhooks.posting import PinnedTransport, post_webhook
from tests.service.webhooks.receivers import Names


def answer(text: bytes, *, public: bool = True, **headers: str) -> httpx.Response:
    told = {name.replace("_", "-"): value for name, value in headers.items()}
    return httpx.Response(
        500, headers={"content-type": "text/plain", **told}, extensions={MAY_BE_SHOWN: public}
    )


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("upstream 10.0.3.7:8080 is down", "upstream [internal]:8080 is down"),
        ("at 192.168.1.1, 8.8.8.8.", "at [internal], 8.8.8.8."),
        ("http://169.254.169.254/latest", "http://[internal]/latest"),
        ("[fd00::12]:80 and [::1] and [::ffff:10.0.0.1]", "[[internal]]:80 and [[internal]] and "
         "[[internal]]"),
        ("[2606:4700::1111]", "[2606:4700::1111]"),
        ("db-3.prod.internal and web.svc.cluster.local", "[internal] and [internal]"),
        ("localhost:9", "[internal]:9"),
        ("at 12:30:45 by 1.2.3", "at 12:30:45 by 1.2.3"),
        ("version 10.0.0.1.5 of a local file", "version 10.0.0.1.5 of a local file"),
    ],
)  # fmt: skip
def test_addresses_inside_are_taken_out(text: str, shown: str) -> None:
    assert without_addresses(text) == shown


def test_it_is_a_line_of_text_and_short() -> None:
    body = b"no\r\nsuch\x00 hook \xff" + b"x" * 4000
    shown = excerpt_of(answer(body), body)
    assert shown is not None
    assert shown.startswith("no such hook \ufffdx")
    assert len(shown) == 500


@pytest.mark.parametrize(
    "response",
    [
        answer(b"", public=False),
        answer(b"", content_type="image/png"),
        answer(b"", content_encoding="gzip"),
        httpx.Response(500, headers={"content-type": "text/plain"}),
    ],
)
def test_nothing_else_is_shown(response: httpx.Response) -> None:
    assert excerpt_of(response, b"secret") is None


def test_a_blank_answer_is_none() -> None:
    assert excerpt_of(answer(b""), b" \r\n\x00") is None


@pytest.mark.parametrize("kind", ["application/json", "application/problem+json; charset=utf-8"])
def test_json_is_text(kind: str) -> None:
    assert excerpt_of(answer(b"", content_type=kind), b'{"a": 1}') == '{"a": 1}'


@pytest.mark.parametrize(
    ("address", "shown"), [("93.184.216.34", "no such hook"), ("10.1.2.3", None)]
)
def test_only_a_public_address_is_quoted(address: str, shown: str | None) -> None:
    """Also where private receivers are allowed: a tenant must not read them by webhooks."""

    def reply(request: httpx.Request) -> httpx.Response:
        assert request.url.host == address
        text = httpx.ByteStream(b"no such hook")
        return httpx.Response(404, headers={"content-type": "text/plain"}, stream=text)

    async def post() -> None:
        transport = PinnedTransport(allow_private=True, resolve=Names({"hook.test": [address]}))
        transport._transport = httpx.MockTransport(reply)  # type: ignore[assignment]
        outcome = await post_webhook(transport, "http://hook.test/", {}, b"{}", 5.0)
        assert (outcome.status, outcome.excerpt) == (404, shown)

    asyncio.run(post())
