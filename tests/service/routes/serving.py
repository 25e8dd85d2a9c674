"""A service on a free port of this machine, whose jobs the tests end by hand."""

from __future__ import annotations

import io
import json
import threading
import time
from collections.abc import Iterator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import httpx
import uvicorn

from service.access.authentication import Authenticator
from service.access.session import Sessions
from service.errors import FieldError, InvalidOptionsError
from service.jobs.job import Failure, Job, JobFile, Summary
from service.jobs.progress import ProgressBoard
from service.metrics import Metrics
from service.middleware.request_log import RequestLog, SentAnswer
from service.routes.api import make_api
from service.routes.services import Services
from service.schemas.job_options import option_tables
from service.settings import Settings
from service.storage.answer_store import SqlAnswerStore
from service.storage.asset_store import SqlAssetStore
from service.storage.blobs.file_blobs import FileBlobs
from service.storage.blobs.scrubbing import Scrubber
from service.storage.check_store import SqlCheckStore
from service.storage.delivery_store import SqlDeliveryStore
from service.storage.job_store import SqlJobStore
from service.storage.journal_store import SqlJournal
from service.storage.key_store import SqlKeyStore
from service.storage.tally_store import SqlTallies
from tests.service.storage.fresh import fresh_database
from tests.waiting import until

OBJ = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
REPORT = {
    "triangles": 2, "precision": 0.999, "recall": 0.8, "error_bound": 0.1,
    "levels": [
        {"level": 0, "triangles": 2, "precision": 0.999, "recall": 0.8, "error_bound": 0.1,
         "switch_distance": 0.0, "overhang": {"share": 0.0042}, "verdict": {"word": "weak"}},
        {"level": 1, "triangles": 1, "precision": 0.99, "recall": 0.6, "error_bound": 0.2,
         "switch_distance": 7.5},
    ],
}  # fmt: skip
RESULTS = {
    "occluder.glb": (
        b"glTF" + b"".join(one.to_bytes(2, "big") for one in range(5120)),
        "model/gltf-binary",
    ),
    "lod0.glb": (b"glTF0", "model/gltf-binary"),
    "lod0.obj": (OBJ, "model/obj"),
    "lod1.obj": (OBJ + b"# coarse\n", "model/obj"),
    "report.json": (json.dumps(REPORT).encode(), "application/json"),
    "report.html": (b"<!doctype html><p>all is well", "text/html; charset=utf-8"),
    "pictures/silhouettes.png": (b"\x89PNG", "image/png"),
}


@dataclass
class ByHand:
    """Work that a test does: jobs are claimed, told of and ended when it says so."""

    jobs: SqlJobStore
    blobs: FileBlobs
    board: ProgressBoard
    woken: threading.Event = field(default_factory=threading.Event)

    def wake(self) -> None:
        self.woken.set()

    def begin(self) -> Job:
        assert self.try_to_begin()
        return self.claim.job

    def try_to_begin(self) -> bool:
        """Whether a job was waiting."""
        claim = self.jobs.claim("hand", 60.0)
        if claim is None:
            return False
        self.claim = claim
        self.board.announce(claim.job.id)
        return True

    def succeed(
        self, *, recall: float = 0.8, seconds: float = 1.5, overhang: float | None = 0.0042
    ) -> Job:
        """End the job that was begun, with two levels of detail."""
        summary = Summary(
            2, 12, 2, seconds, 0.999, recall, 0.5, 17, 0.1, {"refine": 1.0}, ("one hole",),
            overhang, "weak", "it hides little", "occluder simplify a.obj -o a.glb --budget 128",
        )  # fmt: skip
        with self.blobs.keeping() as keeping:
            files = [
                JobFile(name, keeping.put(io.BytesIO(data)), media_type)
                for name, (data, media_type) in RESULTS.items()
            ]
            assert self.jobs.succeed(self.claim, files, summary)
        return self._ended()

    def fail(self, kind: str = "unreadable-mesh") -> Job:
        failure = Failure(kind, "there is no triangle", "send another mesh")
        self.jobs.fail(self.claim, failure, final=True)
        return self._ended()

    def end_cancelled(self) -> None:
        assert self.jobs.end_cancelled(self.claim)
        self._ended()

    def _ended(self) -> Job:
        job = self.jobs.job(None, self.claim.job.id)
        self.board.end(job.id)
        return job


@dataclass
class Served:
    """A service that runs: a client of it, and what it works with."""

    http: httpx.Client
    hand: ByHand
    services: Services
    keys: SqlKeyStore
    faults: dict[str, str]
    deliveries: SqlDeliveryStore
    webhooks_woken: threading.Event

    def post(self, path: str = "/v1/occluders?filename=a.obj", body: bytes = OBJ, **more):
        return self.http.post(path, content=body, **more)

    def queued(self, path: str = "/v1/occluders?filename=a.obj", **more) -> str:
        """The id of a new job, which no other work is equal to."""
        response = self.post(path, OBJ + f"# {time.monotonic_ns()}\n".encode(), **more)
        assert response.status_code == 202, response.text
        return response.json()["id"]

    def done(self, path: str = "/v1/occluders?filename=a.obj", **numbers) -> str:
        job_id = self.queued(path)
        assert self.hand.begin().id == job_id
        self.hand.succeed(**numbers)
        return job_id


@contextmanager
def served(folder: Path, **chosen) -> Iterator[Served]:
    settings = Settings(data=folder, min_free=0, **chosen)
    database = fresh_database(folder / "occluder.db")
    (folder / "blobs").mkdir()
    blobs = FileBlobs(folder / "blobs")
    jobs = SqlJobStore(database, is_stored=blobs.has)
    assets, keys = SqlAssetStore(database), SqlKeyStore(database)
    scrubber = Scrubber(blobs.places, SqlCheckStore(database), 30.0, 1 << 30)
    tallies = SqlTallies(database)
    board = ProgressBoard()
    metrics = Metrics(jobs, assets, blobs, scrubber, tallies, settings.metrics_assets)
    hand = ByHand(jobs, blobs, board)
    faults: dict[str, str] = {}
    deliveries, webhooks_woken = SqlDeliveryStore(database), threading.Event()

    async def check_webhook(address: str) -> None:
        if "private" in address:
            raise InvalidOptionsError([FieldError("webhook", "this is private", "choose another")])

    sessions = Sessions(bytes(32))
    services = Services(
        settings=settings, version="1.0",
        tables=option_tables(settings.job_seconds, settings.job_memory), jobs=jobs,
        assets=assets, blobs=blobs, board=board, runner=hand, metrics=metrics,
        authenticator=Authenticator(keys, sessions, keys_needed=settings.keys_needed),
        keys=keys, journal=SqlJournal(database), answers=SqlAnswerStore(database),
        check_webhook=check_webhook, deliveries=deliveries, wake_webhooks=webhooks_woken.set,
        checks={"engine": lambda: faults.get("engine")},
        on_end=lambda job: None,
    )  # fmt: skip

    def count(answer: SentAnswer) -> None:
        metrics.count_answer(
            answer.method, answer.route, answer.status, answer.seconds, waited=answer.waited
        )

    @asynccontextmanager
    async def lifespan(app):
        app.state.services = services
        yield

    with (
        listening(RequestLog(make_api(lifespan), count)) as address,
        httpx.Client(base_url=address, timeout=20.0) as http,
    ):
        yield Served(http, hand, services, keys, faults, deliveries, webhooks_woken)
    database.close()


@contextmanager
def listening(app, **more) -> Iterator[str]:
    """The address of an application that is served in a thread; ``more`` is uvicorn's."""
    settings = {"log_level": "critical", "timeout_graceful_shutdown": 1, **more}
    config = uvicorn.Config(app, port=0, **settings)
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        until(lambda: server.started or not thread.is_alive())
        port = server.servers[0].sockets[0].getsockname()[1]
        yield f"http://127.0.0.1:{port}"
    finally:
        server.should_exit = True
        thread.join()


def problem(response: httpx.Response, status: int, slug: str) -> dict:
    """The body of a refusal, which is as it has to be."""
    assert response.headers["content-type"] == "application/problem+json"
    body = response.json()
    assert (response.status_code, body["status"], body["type"]) == (
        status, status, f"/problems/{slug}",
    )  # fmt: skip
    return body
