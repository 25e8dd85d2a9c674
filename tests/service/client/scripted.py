"""A server on loopback that answers as a test says."""

from __future__ import annotations

import email
import email.policy
import json
import socket
import threading
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import parse_qs, urlsplit


@dataclass(frozen=True)
class Request:
    """What came; ``query`` has lists, as addresses may repeat a name."""

    method: str
    path: str
    query: dict[str, list[str]]
    headers: dict[str, str]
    body: bytes


def form_of(request):
    """The parts of a form by name: what the file is called, its media type, its bytes."""
    head = f"Content-Type: {request.headers['content-type']}\r\n\r\n".encode()
    message = email.message_from_bytes(head + request.body, policy=email.policy.HTTP)
    return {
        part.get_param("name", header="content-disposition"): (
            part.get_filename(), part["content-type"], part.get_payload(decode=True)
        )
        for part in message.iter_parts()
    }  # fmt: skip


@dataclass(frozen=True)
class Reply:
    """What goes back; ``cut`` is the number of bytes of the body after which the line drops."""

    body: bytes | dict = b""
    status: int = 200
    headers: dict[str, str] = field(default_factory=dict)
    cut: int | None = None


DROP = Reply(cut=-1)
"""The line drops before there is any answer."""


class _Server(ThreadingHTTPServer):
    request_queue_size = 256  # more than 5 at once would try again after seconds


@contextmanager
def serving(answer):
    """Run a server that asks ``answer(request)``; yields its address."""

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def handle_any(self):
            length = int(self.headers.get("Content-Length", 0))
            address = urlsplit(self.path)
            headers = {name.lower(): value for name, value in self.headers.items()}
            body = self.rfile.read(length)
            reply = answer(
                Request(self.command, address.path, parse_qs(address.query), headers, body)
            )
            self.send(reply)

        do_GET = do_POST = do_PUT = do_DELETE = handle_any

        def send(self, reply):
            data = json.dumps(reply.body).encode() if isinstance(reply.body, dict) else reply.body
            if reply.cut == -1:
                self.hang_up()
                return
            self.send_response(reply.status)
            for name, value in {"Content-Length": str(len(data)), **reply.headers}.items():
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(data[: reply.cut])
            if reply.cut is not None:
                self.wfile.flush()
                self.hang_up()

        def hang_up(self):
            self.close_connection = True
            self.connection.shutdown(socket.SHUT_RDWR)

        def log_message(self, format, *arguments):
            pass

    server = _Server(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def job(state="queued", **changes):
    """A job as the API tells it."""
    return {
        "id": "j1", "kind": "occluder", "state": state, "name": "castle.glb",
        "asset": {"id": "a1", "name": "props/castle"}, "created": "2025-01-02T03:04:05Z",
        "started": None, "ended": None, "attempt": 1, "attempts": 3, "options": {"budget": 64},
        "version": "0.1.0", "progress": None, "failure": None, "summary": None, "reused": None,
        "retry_of": None, "webhook": None, "links": {"self": "/v1/jobs/j1"}, **changes,
    }  # fmt: skip


def summary(**changes):
    """A summary as the API tells it."""
    return {
        "triangles": 64, "input_triangles": 15044, "levels": 3, "seconds": 1.5,
        "precision": 0.998, "recall": 0.9, "worst_recall": 0.8, "worst_view": 3,
        "error_bound": 0.1, "timings": {"refine": 1.0}, "warnings": [], **changes,
    }  # fmt: skip


def problem(status, slug, detail, **more):
    """A refusal as the API tells it."""
    body = {
        "type": f"/problems/{slug}", "title": "No", "status": status, "detail": detail,
        "remedy": "do better", "instance": "/v1", **more,
    }  # fmt: skip
    return Reply(body, status, {"Content-Type": "application/problem+json"})


def events(*pairs, cut=None):
    """A stream of server-sent events that ends."""
    text = "".join(f"event: {kind}\ndata: {json.dumps(data)}\n\n" for kind, data in pairs)
    return Reply(text.encode(), headers={"Content-Type": "text/event-stream"}, cut=cut)
