"""What was judged is what is connected to."""

from __future__ import annotations

import asyncio
import socket
import ssl
import threading
from contextlib import suppress

import httpx
import pytest

from service.webhooks.address_guard import Resolve, UnsafeAddressError
from service.webhooks.posting import PinnedTransport
from tests.service.webhooks.receivers import Names, receiving


def post(url: str, resolve: Resolve | None = None, *, allow_private: bool = True) -> int:
    """The status of an answer."""

    async def ask() -> int:
        async with PinnedTransport(allow_private=allow_private, resolve=resolve) as transport:
            timeout = httpx.Timeout(5.0).as_dict()
            request = httpx.Request("POST", url, content=b"{}", extensions={"timeout": timeout})
            response = await transport.handle_async_request(request)
            await response.aclose()
            return response.status_code

    return asyncio.run(ask())


def test_the_connection_goes_to_the_address_and_the_host_keeps_its_name() -> None:
    with receiving() as receiver:
        url = f"http://hook.example:{receiver.port}/a?b=c"
        assert post(url, Names({"hook.example": ["127.0.0.1"]})) == 204
    assert receiver.heard[0].headers["host"] == f"hook.example:{receiver.port}"
    assert receiver.heard[0].path == "/a?b=c"


def test_a_name_is_asked_for_once_so_it_cannot_change_in_between() -> None:
    """Its second answer would lead inside."""
    names = Names({"hook.example": ["127.0.0.1", "10.0.0.1"]})
    with receiving() as receiver:
        assert post(f"http://hook.example:{receiver.port}/", names) == 204
    assert names.asked == ["hook.example"]


def test_an_answer_that_has_changed_since_the_submission_is_judged_again() -> None:
    names = Names({"hook.example": ["1.1.1.1", "127.0.0.1"]})
    asyncio.run(names("hook.example", 80))
    with receiving() as receiver:
        with pytest.raises(UnsafeAddressError, match="no public address"):
            post(f"http://hook.example:{receiver.port}/", names, allow_private=False)
        assert not receiver.heard


def test_one_bad_address_among_good_ones_is_enough() -> None:
    names = Names({"hook.example": ["127.0.0.1 169.254.169.254"]})
    with receiving() as receiver:
        with pytest.raises(UnsafeAddressError, match="no public address"):
            post(f"http://hook.example:{receiver.port}/", names)
        assert not receiver.heard


def test_the_next_address_is_tried_where_one_does_not_answer() -> None:
    with receiving() as receiver:
        names = Names({"hook.example": ["127.0.0.2 ::1 127.0.0.1"]})
        assert post(f"http://hook.example:{receiver.port}/", names) == 204


def test_proxies_of_the_environment_are_not_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    with receiving() as proxy, receiving() as receiver:
        for name in ("HTTP_PROXY", "http_proxy", "ALL_PROXY"):
            monkeypatch.setenv(name, f"http://127.0.0.1:{proxy.port}")
        assert post(receiver.url) == 204
        assert not proxy.heard


def test_a_certificate_is_asked_for_by_the_name() -> None:
    with TlsServer() as server, pytest.raises(httpx.ConnectError):
        post(f"https://hook.example:{server.port}/", Names({"hook.example": ["127.0.0.1"]}))
    assert server.names == ["hook.example"]


class TlsServer:
    """A server without a certificate, which hears what name it is asked for."""

    def __init__(self) -> None:
        self.names: list[str | None] = []
        self._context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        self._context.sni_callback = lambda _, name, __: self.names.append(name)  # type: ignore[assignment]
        self._socket = socket.create_server(("127.0.0.1", 0))
        self._thread = threading.Thread(target=self._serve)

    @property
    def port(self) -> int:
        return self._socket.getsockname()[1]

    def _serve(self) -> None:
        connection, _ = self._socket.accept()
        with connection, suppress(ssl.SSLError):
            self._context.wrap_socket(connection, server_side=True)

    def __enter__(self) -> TlsServer:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._thread.join()
        self._socket.close()
