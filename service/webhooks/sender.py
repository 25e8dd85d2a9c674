"""The thread that tells receivers.

Each word is told at least once: it waits until the store has noted that it was heard, so one that
was under way when the server died is told again, by the same id.  A sender claims what it tells, so
that others that share the store leave it alone, for as long as telling may take and a little more.
"""

from __future__ import annotations

import asyncio
import json
import logging
import re
import secrets as secrets_of_python
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

import httpx

from service.errors import NotFoundError, ServiceError
from service.jobs.deliveries import Delivery, DeliveryAttempt, DeliveryStore, WebhookOutcome
from service.logs import begin_request
from service.settings import Settings
from service.tracing import HEADER, SpanKind, span, traceparent
from service.webhooks.address_guard import Resolve
from service.webhooks.posting import PinnedTransport, PostOutcome, post_webhook, seconds_until_retry
from service.webhooks.rotation import CurrentSecrets
from service.webhooks.signing import (
    DELIVERY_HEADER,
    EVENT_HEADER,
    REQUEST_HEADER,
    SIGNATURE_HEADER,
    TIMESTAMP_HEADER,
    signatures,
)

Describe = Callable[[Delivery], Mapping[str, Any]]
"""The job of a delivery as the API shows it, with ``ended``.

Raises :class:`~service.errors.NotFoundError` when it is there no more.
"""

EVENT = "job.ended"

_AT_ONCE = 64
_AT_ONCE_TO_A_HOST = 4  # so that a slow receiver holds up nobody but itself,
_AT_ONCE_OF_A_TENANT = 16  # by however many names it goes
_LOOK_AHEAD = 500  # deliveries among which those of other receivers are looked for
_GLANCE = 1.0  # seconds between looks at what has become due,
_BREATH = 0.05  # and at least, so that a backlog does not cost a query a delivery
_CLAIM_SLACK = 30.0  # seconds for which a claim holds beyond the time of the receiver
_STORE_PAUSE = 5.0  # seconds before a store that fails is asked again
_STOP_SECONDS = 1.0

_log = logging.getLogger("service.webhooks")


class WebhookSender:
    """Tells receivers of jobs that have ended, many at once, until it is stopped."""

    def __init__(
        self,
        deliveries: DeliveryStore,
        describe: Describe,
        secrets: CurrentSecrets,
        settings: Settings,
        *,
        resolve: Resolve | None = None,
        count: Callable[[WebhookOutcome], None] = lambda outcome: None,
    ) -> None:
        self._count = count
        self._deliveries = deliveries
        self._describe = describe
        self._secrets = secrets
        self._settings = settings
        self._resolve = resolve
        self._owner = f"sender-{secrets_of_python.token_hex(8)}"
        self._claim_seconds = 2.0 * settings.webhook_seconds + _CLAIM_SLACK
        self._under_way: dict[str, Delivery] = {}
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._run, name="webhooks", daemon=True)
        self._woken = asyncio.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._serving: asyncio.Task[None] | None = None

    def start(self) -> None:
        self._thread.start()
        self._ready.wait()

    def wake(self) -> None:
        """Something may be due.  From any thread, also before it has started or once it stopped."""
        self._call(self._woken.set)

    def stop(self) -> None:
        """End within a second; what is under way will be told again."""
        if self._serving is not None:
            self._call(self._serving.cancel)
            self._thread.join(_STOP_SECONDS)

    def _call(self, work: Callable[[], object]) -> None:
        if self._loop is not None:
            with suppress(RuntimeError):  # the loop is closed
                self._loop.call_soon_threadsafe(work)

    def _run(self) -> None:
        asyncio.run(self._serve_until_stopped())

    async def _serve_until_stopped(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._serving = asyncio.create_task(self._serve())
        self._ready.set()
        with suppress(asyncio.CancelledError):
            await self._serving

    async def _serve(self) -> None:
        transport = PinnedTransport(
            allow_private=self._settings.webhook_private, resolve=self._resolve
        )
        async with transport, asyncio.TaskGroup() as tasks:
            while True:
                self._woken.clear()
                for delivery in self._claimed(list(self._next())):
                    self._under_way[delivery.id] = delivery
                    tasks.create_task(self._deliver(transport, delivery))
                with suppress(TimeoutError):
                    async with asyncio.timeout(_GLANCE):
                        await self._woken.wait()
                await asyncio.sleep(_BREATH)

    def _next(self) -> Iterator[Delivery]:
        """The deliveries that are due and have a place."""
        try:
            due = self._deliveries.due(_LOOK_AHEAD)
        except Exception as error:
            _complain(error)
            return
        hosts = Counter(map(_host, self._under_way.values()))
        tenants = Counter(one.tenant for one in self._under_way.values())
        for delivery in due:
            if len(self._under_way) >= _AT_ONCE:
                return
            host, tenant = _host(delivery), delivery.tenant
            if (
                delivery.id not in self._under_way
                and hosts[host] < _AT_ONCE_TO_A_HOST
                and tenants[tenant] < _AT_ONCE_OF_A_TENANT
            ):
                hosts[host] += 1
                tenants[tenant] += 1
                yield delivery

    def _claimed(self, deliveries: Sequence[Delivery]) -> Sequence[Delivery]:
        """Those of them that no other sender has."""
        try:
            return self._deliveries.claim(deliveries, self._owner, self._claim_seconds)
        except Exception as error:
            _complain(error)
            return ()

    async def _deliver(self, transport: httpx.AsyncBaseTransport, delivery: Delivery) -> None:
        if delivery.request_id:
            begin_request(delivery.request_id)
        try:
            began, since = time.time(), time.perf_counter()
            about = {"occluder.job": delivery.job_id, "occluder.webhook": delivery.id}
            with span("webhook", SpanKind.CLIENT, delivery.trace, about) as part:
                outcome = await self._tell(transport, delivery)
                part.set_attribute("http.response.status_code", outcome.status or 0)
            attempt = DeliveryAttempt(
                at=began,
                milliseconds=1000.0 * (time.perf_counter() - since),
                status=outcome.status,
                reason=outcome.reason,
                excerpt=outcome.excerpt,
            )
            # What was heard must not be told again because the disk is full.
            while not self._try_to_settle(delivery, outcome, attempt):
                await asyncio.sleep(_STORE_PAUSE)
        finally:
            del self._under_way[delivery.id]
            self._woken.set()

    async def _tell(self, transport: httpx.AsyncBaseTransport, delivery: Delivery) -> PostOutcome:
        try:
            body = _body(delivery, self._describe(delivery))
            headers = _headers(delivery, self._secrets.of(delivery.tenant), body)
            seconds = self._settings.webhook_seconds
            return await post_webhook(transport, delivery.url, headers, body, seconds)
        except NotFoundError:
            return PostOutcome("the job is there no more", gone=True)
        except Exception as error:
            _complain(error)
            return PostOutcome(f"unexpected {type(error).__name__}")

    def _try_to_settle(
        self, delivery: Delivery, outcome: PostOutcome, attempt: DeliveryAttempt
    ) -> bool:
        try:
            self._settle(delivery, outcome, attempt)
        except Exception as error:
            _complain(error)
            return False
        return True

    def _settle(self, delivery: Delivery, outcome: PostOutcome, attempt: DeliveryAttempt) -> None:
        tried = delivery.attempt + 1
        # The URL is the receiver's secret, but for the host.
        about = f"webhook {delivery.id} of job {delivery.job_id} to {_host(delivery)}"
        fields = {"job": delivery.job_id, "webhook": delivery.id, "status": outcome.status}
        extra = {"fields": fields | {"milliseconds": round(attempt.milliseconds, 1)}}
        if outcome.heard:
            self._deliveries.confirm(delivery, attempt)
            self._count(WebhookOutcome.HEARD)
            _log.info("%s was heard", about, extra=extra)
        elif outcome.gone or tried >= self._settings.webhook_attempts:
            self._deliveries.give_up(delivery, attempt)
            self._count(WebhookOutcome.GIVEN_UP)
            _log.warning(
                "%s was given up after %d tries: %s", about, tried, outcome.reason, extra=extra
            )
        else:
            seconds = seconds_until_retry(tried, outcome.wait)
            self._deliveries.postpone(delivery, attempt, seconds)
            self._count(WebhookOutcome.FAILED)
            _log.info(
                "%s is tried again in %.0f seconds: %s",
                about, seconds, outcome.reason, extra=extra,
            )  # fmt: skip


def _complain(error: Exception) -> None:
    """The thread goes on whatever happens; what is no fault of the store's is one of ours."""
    _log.warning("webhooks are held up: %s", error, exc_info=not isinstance(error, ServiceError))


def _body(delivery: Delivery, job: Mapping[str, Any]) -> bytes:
    """The body of a webhook: the same for every try, but for what the job has lost meanwhile."""
    word = {"event": EVENT, "id": delivery.id, "created": job["ended"], "job": job}
    return json.dumps(word, allow_nan=False).encode()


def _headers(delivery: Delivery, secrets: Sequence[str], body: bytes) -> dict[str, str]:
    timestamp = int(time.time())
    return {
        "Content-Type": "application/json",
        "User-Agent": "occluder-webhooks",
        EVENT_HEADER: EVENT,
        DELIVERY_HEADER: delivery.id,
        TIMESTAMP_HEADER: str(timestamp),
        SIGNATURE_HEADER: signatures(secrets, timestamp, body),
        **({REQUEST_HEADER: delivery.request_id} if delivery.request_id else {}),
        **({HEADER: trace} if (trace := traceparent()) else {}),
    }


def _host(delivery: Delivery) -> str:
    """The host with its port, as it is spelled; for counting and for the log."""
    authority = re.split(r"[/?#]", delivery.url.partition("://")[2], maxsplit=1)[0]
    return authority.rpartition("@")[2].lower()
