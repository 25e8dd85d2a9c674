"""What routes work with, and how they come by it."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Protocol

from fastapi import Depends, Request

from service.access.key import Caller
from service.jobs.asset import AssetStore
from service.jobs.job import Job, JobKind
from service.jobs.progress import ProgressBoard
from service.jobs.stores import BlobStore, JobStore
from service.routes.collectors import Metrics
from service.schemas.options import OptionTable
from service.settings import Settings


class Work(Protocol):
    """What does the jobs."""

    def wake(self) -> None:
        """A job waits, or is to end: look now rather than later."""


Check = Callable[[], str | None]
"""What is wrong with a part of the service, in words; None where nothing is."""


@dataclass(frozen=True)
class Services:
    """All that the routes share.

    ``authenticate``   who asks: from headers and the client's address, in any thread; raises
                       :class:`~service.errors.ServiceError`.
    ``sign_in``        the cookie of a session, from a key and the client's address; raises so too.
    ``check_webhook``  raises :class:`~service.errors.ServiceError` for an address that no webhook
                       may go to.
    ``checks``         by name, what has to be well for the service to be ready.
    ``ended``          called once for each job that a route, and no work, has brought to its end.
    """

    settings: Settings
    version: str
    tables: Mapping[JobKind, OptionTable]
    jobs: JobStore
    assets: AssetStore
    blobs: BlobStore
    board: ProgressBoard
    work: Work
    metrics: Metrics
    authenticate: Callable[[Mapping[str, str], str], Caller]
    sign_in: Callable[[str, str], str]
    check_webhook: Callable[[str], Awaitable[None]]
    checks: Mapping[str, Check]
    ended: Callable[[Job], None]

    def taken(self, job: Job) -> None:
        """See to a job that was taken in: to be done, or done already by a stored result."""
        if job.state.ended:
            self.ended(job)
        else:
            self.work.wake()


def _services(request: Request) -> Services:
    services: Services = request.app.state.services
    return services


TheServices = Annotated[Services, Depends(_services)]
