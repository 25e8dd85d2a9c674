"""Receivers on loopback, a store in memory, and a resolver that says what it is told to."""

from __future__ import annotations

import asyncio
import threading
import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from ipaddress import ip_address

from service.jobs.deliveries import Delivery, DeliveryAttempt, SecretAge
from service.webhooks.address_guard import Address


@dataclass(frozen=True)
class Heard:
    """One request, with its headers' names in lower case."""

    path: str
    headers: dict[str, str]
    body: bytes
    at: float


@dataclass
class Receiver:
    """Answers with what is queued, then with 204; waits for ``gate`` first.

    ``endless``  whether its answers have a body that does not end.
    """

    port: int = 0
    endless: bool = False
    heard: list[Heard] = field(default_factory=list)
    answers: deque[tuple[int, dict[str, str]]] = field(default_factory=deque)
    gate: threading.Event = field(default_factory=threading.Event)

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}/hook"


@contextmanager
def receiving(*answers: tuple[int, dict[str, str]], endless: bool = False) -> Iterator[Receiver]:
    receiver = Receiver(answers=deque(answers), endless=endless)
    receiver.gate.set()

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["content-length"]))
            headers = {name.lower(): value for name, value in self.headers.items()}
            receiver.heard.append(Heard(self.path, headers, body, time.time()))
            receiver.gate.wait()
            status, more = receiver.answers.popleft() if receiver.answers else (204, {})
            self.send_response(status)
            for name, value in more.items():
                self.send_header(name, value)
            self.end_headers()
            while receiver.endless:
                self.wfile.write(b"more" * 256)

        do_GET = do_POST  # what a redirect would lead to

        def log_message(self, *_: object) -> None:
            pass

    class Server(ThreadingHTTPServer):
        daemon_threads = True

        def handle_error(self, *_: object) -> None:
            pass  # a sender that has given up

    with Server(("127.0.0.1", 0), Handler) as server:
        receiver.port = server.server_port
        thread = threading.Thread(target=server.serve_forever, args=(0.02,))
        thread.start()
        try:
            yield receiver
        finally:
            receiver.gate.set()
            receiver.endless = False
            server.shutdown()
            thread.join()


class Deliveries:
    """A delivery store in memory, whose clock is set by hand."""

    def __init__(self) -> None:
        self.now = 1000.0
        self.notes: list[tuple[str, str, str]] = []  # what became of which delivery, and why
        self.waits: list[float] = []
        self.attempts: list[DeliveryAttempt] = []
        self.looks = 0  # at what is due
        self.faults = 0
        self.fault: Exception | None = None
        self._lock = threading.Lock()
        self._waiting: dict[str, Delivery] = {}

    def add(self, url: str, name: str = "d1", tenant: str = "studio", job: str = "j1") -> None:
        with self._lock:
            self._waiting[name] = Delivery(name, tenant, job, url, 0, self.now)

    def claim(
        self, deliveries: Sequence[Delivery], owner: str, seconds: float
    ) -> Sequence[Delivery]:
        return deliveries

    def due(self, limit: int) -> Sequence[Delivery]:
        with self._lock:
            self.looks += 1
            self._fail()
            waiting = sorted(self._waiting.values(), key=lambda one: one.due)
            return [one for one in waiting if one.due <= self.now][:limit]

    def confirm(self, delivery: Delivery, attempt: DeliveryAttempt) -> None:
        with self._lock:
            self._fail()
            self.attempts.append(attempt)
            del self._waiting[delivery.id]
            self.notes.append(("delivered", delivery.id, ""))

    def postpone(self, delivery: Delivery, attempt: DeliveryAttempt, seconds: float) -> None:
        with self._lock:
            self._fail()
            self.attempts.append(attempt)
            later = replace(delivery, attempt=delivery.attempt + 1, due=self.now + seconds)
            self._waiting[delivery.id] = later
            self.waits.append(seconds)
            self.notes.append(("postponed", delivery.id, attempt.reason))

    def give_up(self, delivery: Delivery, attempt: DeliveryAttempt) -> None:
        with self._lock:
            self.attempts.append(attempt)
            del self._waiting[delivery.id]
            self.notes.append(("given up", delivery.id, attempt.reason))

    def _fail(self) -> None:
        if self.fault is not None:
            self.faults += 1
            raise self.fault

    def of(self, kind: str) -> list[str]:
        return [delivery for noted, delivery, _ in self.notes if noted == kind]


class Ages:
    """Ages of secrets in memory: of those that were rotated."""

    def __init__(self) -> None:
        self.of: dict[str, SecretAge] = {}

    def age(self, tenant: str) -> SecretAge:
        return self.of.get(tenant, SecretAge())

    def rotate(self, tenant: str, overlap_seconds: float) -> SecretAge:
        generation = self.age(tenant).generation + 1
        self.of[tenant] = SecretAge(generation, time.time() + overlap_seconds)
        return self.of[tenant]


class Names:
    """A resolver: each time a name is asked for it gives the next of its answers, then the last."""

    def __init__(self, answers: Mapping[str, Sequence[str]]) -> None:
        self._answers = {name: deque(them) for name, them in answers.items()}
        self.asked: list[str] = []

    async def __call__(self, host: str, port: int) -> list[Address]:
        self.asked.append(host)
        await asyncio.sleep(0)
        answers = self._answers[host]
        answer = answers.popleft() if len(answers) > 1 else answers[0]
        return [ip_address(one) for one in answer.split()]
