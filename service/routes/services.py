"""What routes work with, who asks, and whether they may."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Protocol

from anyio import CapacityLimiter
from anyio.to_thread import run_sync
from fastapi import Depends, Request
from fastapi.security import APIKeyHeader, HTTPBearer

from service.access.authentication import Authenticator, demand, demand_curator
from service.access.key import Caller, KeyStore, Scope
from service.idempotency import Answers
from service.jobs.asset import AssetStore
from service.jobs.deliveries import DeliveryLog
from service.jobs.job import Job, JobKind, Submission
from service.jobs.on_demand import FileMaker
from service.jobs.progress import ProgressBoard
from service.jobs.stores import BlobStore, JobStore
from service.journal import Journal
from service.logs import request_id
from service.metrics import Metrics
from service.schemas.options import OptionTable
from service.settings import Settings
from service.tracing import traceparent

_SUBMITTING = 8
"""Threads that submit at once: the database takes one after the other anyway."""
_MOST_LOOKS = 8
"""At stored results of the same work: more than one is there only where some were damaged."""
Check = Callable[[], str | None]
"""What is wrong with a part of the service, in words; None where nothing is."""
_BEARER = HTTPBearer(
    auto_error=False, scheme_name="bearer", description="A key that begins with `occ_`."
)
_HEADER = APIKeyHeader(
    name="X-API-Key", auto_error=False, scheme_name="key", description="The same key."
)
KEYED = [Depends(_BEARER), Depends(_HEADER)]
"""Says in OpenAPI that a key is needed; the callers below see to it."""


class JobRunner(Protocol):
    """What does the jobs."""

    def wake(self) -> None:
        """A job waits, or is to end: look now rather than later."""


@dataclass(frozen=True)
class Services:
    """All parts of the service that the routes share.

    ``check_webhook``  raises :class:`~service.errors.ServiceError` for an address that no webhook
                       may go to.
    ``wake_webhooks``  called when a webhook is to be sent at once.
    ``checks``         by name, what has to be well for the service to be ready.
    ``submitting``     limits the threads that submit, so that others need not wait for one.
    ``on_end``         called once for each job that a route, and no runner, has brought to its end.
    ``files``          makes those of jobs that come on demand; None where nobody does.
    """

    settings: Settings
    version: str
    tables: Mapping[JobKind, OptionTable]
    jobs: JobStore
    assets: AssetStore
    blobs: BlobStore
    board: ProgressBoard
    runner: JobRunner
    metrics: Metrics
    authenticator: Authenticator
    keys: KeyStore
    journal: Journal
    answers: Answers
    check_webhook: Callable[[str], Awaitable[None]]
    deliveries: DeliveryLog
    wake_webhooks: Callable[[], None]
    checks: Mapping[str, Check]
    on_end: Callable[[Job], None]
    files: FileMaker | None = None
    submitting: CapacityLimiter = field(default_factory=lambda: CapacityLimiter(_SUBMITTING))

    def submit(self, submission: Submission) -> Job:
        """Take a job in, whatever its kind, and see to it: it is to be done, or done already.

        Waits for the database.  Raises :class:`~service.errors.ServiceError` as
        :meth:`JobStore.submit <service.jobs.stores.JobStore.submit>` does.
        """
        self.check_stored_result(submission)
        return self.take_in(submission)

    def take_in(self, submission: Submission) -> Job:
        """As :meth:`submit`, where the stored result was looked at; fit for a transaction."""
        submission = replace(submission, request_id=request_id(), trace=traceparent())
        job, to_do = self.jobs.submit(submission, self.settings.queue_limit)
        self.answers.afterwards(self.runner.wake if to_do else lambda: self.on_end(job))
        return job

    def check_stored_result(self, submission: Submission) -> None:
        """Have a stored result counted no more whose bytes are damaged; then the next is looked at.

        Here and not within the transaction, which others wait for.  It costs as much as the upload,
        which was hashed as well, and nothing for what was looked at a short while ago.
        """
        for _ in range(_MOST_LOOKS):
            files = self.jobs.stored_result(submission)
            if all(self.blobs.is_right(file.blob) for file in files):
                return


def _services(request: Request) -> Services:
    services: Services = request.app.state.services
    return services


TheServices = Annotated[Services, Depends(_services)]


def _caller_whom(judge: Callable[[Caller], None]) -> Callable[..., Awaitable[Caller]]:
    """Whoever asks, where ``judge`` raises nothing."""

    async def caller(request: Request, services: TheServices) -> Caller:
        authenticator, headers = services.authenticator, request.headers
        # A thread only where the database has to be asked: status calls are many.
        one = authenticator.caller_at_once(headers)
        if one is None:
            one = await run_sync(authenticator.caller, headers, address_of(request))
        request.state.caller = one  # for the log
        judge(one)
        return one

    return caller


def _with(scope: Scope) -> Callable[[Caller], None]:
    return lambda caller: demand(caller, scope)


Reader = Annotated[Caller, Depends(_caller_whom(_with(Scope.READ)))]
Writer = Annotated[Caller, Depends(_caller_whom(_with(Scope.WRITE)))]
Curator = Annotated[Caller, Depends(_caller_whom(demand_curator))]
Admin = Annotated[Caller, Depends(_caller_whom(_with(Scope.ADMIN)))]


def address_of(request: Request) -> str:
    """From where a request comes; empty for a socket without addresses."""
    return request.client.host if request.client else ""
