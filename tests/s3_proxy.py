"""A server between a client and an S3 server, which answers in its place where a test says so."""

from __future__ import annotations

import http.client
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import urlsplit

from tests.s3 import S3Server

Fault = Callable[[str, str], tuple[int, str] | None]
"""By method and path of a request, the status and body of what is answered; None to pass it on."""


@dataclass
class Proxy:
    """``fault`` may change at any time; ``seen`` are the requests that came."""

    port: int = 0
    fault: Fault = lambda method, path: None
    seen: list[tuple[str, str]] = field(default_factory=list)

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}"


def error_body(code: str, more: str = "") -> str:
    return f'<?xml version="1.0"?><Error><Code>{code}</Code><Message>no</Message>{more}</Error>'


@contextmanager
def proxy_of(server: S3Server) -> Iterator[Proxy]:
    proxy = Proxy()
    upstream = urlsplit(server.address).netloc

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def log_message(self, *told: object) -> None: ...

        def _handle(self) -> None:
            length = int(self.headers.get("Content-Length") or 0)
            body = self.rfile.read(length)
            if len(body) < length:  # who asks is gone, and whoever is asked would wait for the rest
                self.close_connection = True
                return
            proxy.seen.append((self.command, self.path))
            answer = proxy.fault(self.command, self.path)
            if answer is not None:
                status, text = answer
                self._answer(status, [], text.encode())
                return
            connection = http.client.HTTPConnection(upstream)
            connection.request(self.command, self.path, body, dict(self.headers))
            passed = connection.getresponse()
            self._answer(passed.status, passed.getheaders(), passed.read())
            connection.close()

        def _answer(self, status: int, headers: list[tuple[str, str]], body: bytes) -> None:
            self.send_response_only(status)
            length = str(len(body))
            for name, value in headers:
                if name.lower() == "content-length":
                    length = value  # of what HEAD does not send
                elif name.lower() not in ("connection", "transfer-encoding"):
                    self.send_header(name, value)
            self.send_header("Content-Length", length)
            self.end_headers()
            if self.command != "HEAD":
                self.wfile.write(body)

        do_GET = do_PUT = do_POST = do_DELETE = do_HEAD = _handle

    class Quiet(ThreadingHTTPServer):
        daemon_threads = True

        def handle_error(self, *told: object) -> None:
            """Either side may be killed in the midst of a request."""

    httpd = Quiet(("127.0.0.1", 0), Handler)
    proxy.port = httpd.server_port
    thread = threading.Thread(target=httpd.serve_forever, args=(0.05,), daemon=True)
    thread.start()
    try:
        yield proxy
    finally:
        httpd.shutdown()
        httpd.server_close()
        thread.join()
