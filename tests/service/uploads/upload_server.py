"""A real server whose one resource stores what is posted to it, and raw connections to it.

As a program, it serves a folder of blobs until its input ends, and says its port and, at the end,
the most memory that it had, KiB.
"""

from __future__ import annotations

import json
import socket
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import uvicorn
from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from service.errors import ServiceError
from service.jobs.stores import BlobStore
from service.settings import Settings
from service.storage.blobs.file_blobs import FileBlobs
from service.uploads.receiving import Wanted, receive

MESH = Wanted("mesh", (".glb", ".obj", ".stl"))


def upload_app(blobs: BlobStore, settings: Settings) -> Starlette:
    async def upload(request: Request) -> Response:
        try:
            with blobs.keeping() as keeping:
                uploads = await receive(request, keeping, [MESH], settings)
        except ServiceError as error:
            problem = {"type": error.slug, "detail": error.detail, "remedy": error.remedy}
            return JSONResponse(problem, error.status, error.headers)
        except ClientDisconnect:
            return Response(status_code=400)
        return JSONResponse(uploads.files["mesh"].blob.digest)

    return Starlette(routes=[Route("/", upload, methods=["POST"])])


@contextmanager
def served(blobs: BlobStore, settings: Settings) -> Iterator[int]:
    """Serve from a thread; the port."""
    config = uvicorn.Config(upload_app(blobs, settings), log_level="critical", backlog=2048)
    server = uvicorn.Server(config)
    with socket.create_server(("127.0.0.1", 0), backlog=2048) as listening:
        thread = threading.Thread(target=server.run, args=([listening],))
        thread.start()
        try:
            yield listening.getsockname()[1]
        finally:
            server.should_exit = server.force_exit = True
            thread.join()


class Connection:
    """Bytes to the server as they are, and what it answers."""

    def __init__(self, port: int) -> None:
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=20)

    def __enter__(self) -> Connection:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def send(self, *lines: str, body: bytes = b"") -> None:
        head = "\r\n".join(["POST /?filename=a.obj HTTP/1.1", "Host: here", *lines, "", ""])
        self.socket.sendall(head.encode() + body)

    def answer(self) -> tuple[int, dict[str, str], bytes]:
        """Status, headers and all that comes until the server closes or the body is there."""
        received = b""
        while b"\r\n\r\n" not in received:
            received += self._more()
        head, _, body = received.partition(b"\r\n\r\n")
        status, *lines = head.decode().split("\r\n")
        headers = {key.lower(): value for key, value in (line.split(": ", 1) for line in lines)}
        while len(body) < int(headers.get("content-length", 0)):
            body += self._more()
        return int(status.split()[1]), headers, body

    def problem(self) -> tuple[int, str]:
        """Of a refusal after which the server closes: status and type."""
        status, headers, body = self.answer()
        assert headers["connection"] == "close"
        assert self.is_closed()
        return status, json.loads(body)["type"]

    def is_closed(self) -> bool:
        try:
            return self.socket.recv(1) == b""
        except ConnectionResetError:
            return True

    def _more(self) -> bytes:
        data = self.socket.recv(65_536)
        if not data:
            raise ConnectionError("the server closed the connection")
        return data


def main(folder: str) -> None:
    with served(FileBlobs(Path(folder)), Settings()) as port:
        print(port, flush=True)
        sys.stdin.read()
    status = Path("/proc/self/status").read_text()
    print(next(line.split()[1] for line in status.splitlines() if line.startswith("VmHWM")))


if __name__ == "__main__":
    main(sys.argv[1])
