"""The whole service: every part opened in order, given to the routes, closed in reverse."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator, Mapping
from contextlib import ExitStack, asynccontextmanager, contextmanager
from functools import partial
from typing import Any

from anyio.to_thread import current_default_thread_limiter, run_sync
from fastapi import FastAPI
from starlette.types import ASGIApp

from service.access.authentication import Authenticator
from service.access.session import Sessions
from service.at_work import Runner, running_engine
from service.engines.on_demand import OnDemand
from service.jobs.deliveries import Delivery
from service.jobs.job import Job
from service.jobs.progress import ProgressBoard
from service.jobs.stores import BlobStore
from service.metrics import Metrics, Readings
from service.middleware.bodies import LingeringClose, Turnstile
from service.middleware.forwarded import ForwardedAddress
from service.middleware.host_guard import HostGuard
from service.middleware.request_log import Observe, RequestLog, SentAnswer
from service.middleware.security_headers import SecurityHeaders
from service.routes.api import make_api
from service.routes.services import Check, Services
from service.schemas.job import JobBody
from service.schemas.job_options import option_tables
from service.settings import Settings
from service.storage.blobs.scrubbing import Scrubber
from service.storage.cleaning import Cleaner
from service.storage.database import Database, Topic
from service.storage.job_store import SqlJobStore
from service.storage.opening import agree_on_secret, open_storage
from service.webhooks.address_guard import check_webhook
from service.webhooks.rotation import CurrentSecrets
from service.webhooks.sender import Describe, WebhookSender
from service.webhooks.tenant_secrets import TenantSecrets
from simplifier import __version__

_THREADS = 32
"""Requests that may be at the database or the disk at once; each waits for milliseconds."""


def create_app(settings: Settings) -> FastAPI:
    """The application; its parts are opened when it starts.

    Starting raises :class:`~service.errors.SettingsError` where the data folder cannot be used,
    and :class:`~service.errors.DatabaseDamagedError`.
    """

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        current_default_thread_limiter().total_tokens = _THREADS
        with ExitStack() as parts:
            app.state.services = await run_sync(parts.enter_context, open_services(settings))
            yield

    app = make_api(lifespan)
    if settings.dashboard:
        # Here, since it costs 20 MiB: a service without pages does not pay for them.
        from service.dashboard.mount import add_dashboard

        add_dashboard(app)
    inside = app.build_middleware_stack
    # Around all of it: no answer may come without its headers, not even that to a fault of ours.
    app.build_middleware_stack = lambda: surround(  # type: ignore[method-assign]
        inside(), settings, observe=partial(_count_answer, app)
    )
    return app


def _count_answer(app: FastAPI, answer: SentAnswer) -> None:
    metrics: Metrics = app.state.services.metrics
    metrics.count_answer(
        answer.method, answer.route, answer.status, answer.seconds, waited=answer.waited
    )


@contextmanager
def open_services(settings: Settings) -> Iterator[Services]:
    """Everything that routes work with, running within the block.

    Raises as starting does.
    """
    with ExitStack() as parts:
        stores = parts.enter_context(open_storage(settings))
        jobs, blobs, sharing = stores.jobs, stores.blobs, stores.sharing
        scrubber = Scrubber(
            stores.inventory,
            stores.checks,
            settings.scrub_days,
            settings.scrub_rate,
            leads=sharing.leads,
        )
        board = ProgressBoard()
        metrics = Metrics(
            jobs, stores.assets, blobs, scrubber, stores.tallies, settings.metrics_assets
        )
        tenant_secrets = TenantSecrets.named_by(settings)
        if sharing.shared:
            agree_on_secret(stores.database, tenant_secrets.fingerprint)
        secrets = CurrentSecrets(tenant_secrets, stores.secret_ages, stores.database.clock)
        sender = WebhookSender(
            stores.deliveries, _describe_from(jobs), secrets, settings, count=metrics.count_webhook
        )
        if not sharing.shared:
            stores.deliveries.release_all()
        sessions = Sessions(tenant_secrets.signing_key("sessions"))

        def on_end(job: Job) -> None:
            sender.wake()

        async def check(address: str) -> None:
            await check_webhook(address, allow_private=settings.webhook_private)

        cleaner = Cleaner(
            jobs,
            stores.assets,
            blobs,
            stores.journal,
            stores.answers,
            settings.keep_days,
            settings.journal_days,
            settings.clean_seconds,
            leads=sharing.leads,
        )
        parts.enter_context(cleaner.running())
        parts.enter_context(scrubber.running())
        sender.start()
        parts.callback(sender.stop)
        runner = parts.enter_context(running_engine(settings, stores, board, on_end))
        metrics.watch(_readings(settings, blobs, runner))

        def hear(topic: Topic, what: str) -> None:
            if topic is Topic.ENDED:
                board.end(what)
                sender.wake()
            else:
                runner.wake()

        def look_anew() -> None:
            sender.wake()
            runner.wake()

        parts.enter_context(sharing.listening(hear, look_anew))
        on_demand = OnDemand(jobs, blobs, settings, stores.scratch)
        on_demand.start()
        parts.callback(on_demand.stop)
        yield Services(
            settings=settings,
            version=__version__,
            tables=option_tables(settings.job_seconds, settings.job_memory),
            jobs=jobs,
            assets=stores.assets,
            blobs=blobs,
            board=board,
            runner=runner,
            metrics=metrics,
            authenticator=Authenticator(
                stores.keys,
                sessions,
                keys_needed=settings.keys_needed,
                failures=stores.failures,
            ),
            keys=stores.keys,
            journal=stores.journal,
            answers=stores.answers,
            check_webhook=check,
            deliveries=stores.deliveries,
            wake_webhooks=sender.wake,
            checks=_checks(settings, stores.database, blobs, runner, board),
            on_end=on_end,
            files=on_demand,
        )


def _readings(settings: Settings, blobs: BlobStore, runner: Runner) -> Readings:
    return {
        "occluder_workers_configured": (
            "Worker processes that there are to be.", lambda: runner.workers,
        ),
        "occluder_workers_live": (
            "Worker processes that can do a job or do one.", lambda: runner.live,
        ),
        "occluder_workers_busy": ("Jobs that are done just now.", lambda: runner.busy),
        "occluder_disk_free_bytes": (
            "What the disk of OCCLUDER_DATA has left.", blobs.free_bytes,
        ),
        "occluder_disk_reserve_bytes": (
            "What is left free of it: below that uploads are refused.", lambda: settings.min_free,
        ),
    }  # fmt: skip


def _describe_from(jobs: SqlJobStore) -> Describe:
    def describe(delivery: Delivery) -> Mapping[str, Any]:
        job = jobs.job(delivery.tenant, delivery.job_id)
        return JobBody.of(job, whole_webhook=True).model_dump(mode="json")

    return describe


def _checks(
    settings: Settings, database: Database, blobs: BlobStore, runner: Runner, board: ProgressBoard
) -> Mapping[str, Check]:
    def of_database() -> str | None:
        return None if database.is_sound() else "it cannot be read"

    def of_disk() -> str | None:
        free = blobs.free_bytes()
        if free > settings.min_free:
            return None
        return f"{free:,} bytes are free, and {settings.min_free:,} are to stay so"

    def of_kernels() -> str | None:
        preparing = board.preparing
        if preparing is None:
            return None
        return (
            f"they are made ready, for {preparing.seconds:,.0f} seconds so far; the first start on "
            "a machine compiles for a minute or two, and jobs wait for it"
        )

    return {
        "database": of_database,
        "blobs": blobs.problem,
        "disk": of_disk,
        "engine": lambda: runner.problem,
        "kernels": of_kernels,
    }


def surround(
    app: ASGIApp, settings: Settings, *, observe: Observe = lambda answer: None
) -> ASGIApp:
    """The application within its surroundings.

    It goes around the whole of it, the handler of unexpected errors included, so that no answer
    comes without its headers.
    """
    guarded = SecurityHeaders(HostGuard(app, settings), settings)
    logged = RequestLog(guarded, observe)
    return ForwardedAddress(Turnstile(LingeringClose(logged)), settings.trusted_proxies)
