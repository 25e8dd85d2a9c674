"""The tables: every job, what it was given and has given, and who may ask.

Rows point at each other by ``number``, which rises with every insert whatever the clock does;
``id`` is random and for the outside.  What belongs to a job or an asset goes with it.

The indexes serve the queries that run while the service is full: 100,000 jobs, 5,000 assets.  Each
ends with ``number``, SQLite's own key of a row, so what it finds comes in the order of lists; what
follows ``number`` lets a filter be decided without fetching the row.

:mod:`service.storage.column_types` says how a value is kept.
"""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum
from typing import Any

from sqlalchemy import (
    CheckConstraint,
    Double,
    Enum,
    ForeignKey,
    Index,
    MetaData,
    String,
    UniqueConstraint,
    false,
    text,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column, relationship

from service.access.key import Scope
from service.jobs.deliveries import DeliveryState
from service.jobs.job import JobKind, JobState, Priority
from service.keep import Keep
from service.storage.column_types import Document, Text, whole


def _words(enum: type[StrEnum]) -> Enum:
    """A column of an enumeration's values; the table checks them by :func:`_one_of`."""
    return Enum(
        enum,
        native_enum=False,
        length=16,
        values_callable=lambda words: [str(one) for one in words],
    )


def _one_of(column: str, words: Iterable[StrEnum]) -> CheckConstraint:
    listed = ", ".join(f"'{word}'" for word in words)
    return CheckConstraint(f"{column} IN ({listed})", name=column)


class Base(DeclarativeBase):
    """What all tables share: how constraints are named, and how values are kept."""

    metadata = MetaData(
        naming_convention={
            "ix": "ix_%(table_name)s_%(column_0_name)s",
            "uq": "uq_%(table_name)s_%(column_0_name)s",
            "ck": "ck_%(table_name)s_%(constraint_name)s",
            "fk": "fk_%(table_name)s_%(column_0_name)s",
            "pk": "pk_%(table_name)s",
        }
    )
    type_annotation_map = {  # noqa: RUF012 - as the base class has it
        str: Text(),
        int: whole(),
        float: Double(),
        dict[str, Any]: Document(),
        JobKind: _words(JobKind),
        JobState: _words(JobState),
        Priority: _words(Priority),
        Keep: _words(Keep),
        Scope: _words(Scope),
        DeliveryState: _words(DeliveryState),
    }


class AssetRow(Base):
    """A name of a tenant's; ``folded`` is the name without its case, for searching.

    ``goes``  when it is removed for good, if somebody has removed it.
    """

    __tablename__ = "assets"
    __table_args__ = (
        UniqueConstraint("tenant", "name"),
        CheckConstraint("length(name) BETWEEN 1 AND 300", name="name"),
        CheckConstraint("min_precision BETWEEN 0 AND 1", name="min_precision"),
        CheckConstraint("min_recall BETWEEN 0 AND 1", name="min_recall"),
        CheckConstraint("max_overhang >= 0", name="max_overhang"),
        Index("ix_assets_name", "name", "number"),
        Index(
            "ix_assets_goes", "goes",
            sqlite_where=text("goes IS NOT NULL"), postgresql_where=text("goes IS NOT NULL"),
        ),
        {"sqlite_autoincrement": True},
    )  # fmt: skip

    number: Mapped[int] = mapped_column(primary_key=True)
    id: Mapped[str] = mapped_column(String(32), unique=True)
    tenant: Mapped[str]
    name: Mapped[str]
    folded: Mapped[str]
    created: Mapped[float]
    min_precision: Mapped[float | None]
    min_recall: Mapped[float | None]
    max_overhang: Mapped[float | None]
    goes: Mapped[float | None]


class FolderRow(Base):
    """What is demanded of all assets in a folder; ``path`` is empty for all of a tenant's."""

    __tablename__ = "folders"
    __table_args__ = (
        CheckConstraint("min_precision BETWEEN 0 AND 1", name="min_precision"),
        CheckConstraint("min_recall BETWEEN 0 AND 1", name="min_recall"),
        CheckConstraint("max_overhang >= 0", name="max_overhang"),
    )

    tenant: Mapped[str] = mapped_column(primary_key=True)
    path: Mapped[str] = mapped_column(primary_key=True)
    min_precision: Mapped[float | None]
    min_recall: Mapped[float | None]
    max_overhang: Mapped[float | None]


class JobRow(Base):
    """A job.  ``state`` decides which of the columns that may be empty are.

    ``owner``, ``beat``, ``lease_seconds``  who works at it; ``beat`` rises while that one lives,
    and has to within ``lease_seconds``.
    ``due``  before which it is not begun, by the clock that all share.
    ``tallied``  whether metrics have counted its end.
    """

    __tablename__ = "jobs"
    __table_args__ = (
        _one_of("kind", JobKind),
        _one_of("state", JobState),
        _one_of("priority", Priority),
        _one_of("keep", Keep),
        CheckConstraint("attempt BETWEEN 0 AND attempts", name="attempt"),
        CheckConstraint(
            "(state IN ('succeeded', 'failed', 'cancelled')) = (ended IS NOT NULL)", name="ended"
        ),
        CheckConstraint("(state = 'running') = (owner IS NOT NULL)", name="owner"),
        CheckConstraint("(state = 'failed') = (failure IS NOT NULL)", name="failure"),
        CheckConstraint("(state = 'succeeded') = (summary IS NOT NULL)", name="summary"),
        Index("ix_jobs_tenant", "tenant", "number", "state", "kind", "created"),
        Index("ix_jobs_tenant_state", "tenant", "state", "number"),
        Index("ix_jobs_state", "state", "number"),
        Index("ix_jobs_line", "state", "tenant", "priority", "number", "due"),
        Index("ix_jobs_asset", "asset_number", "state", "number", "kind"),
        Index(
            "ix_jobs_untallied", "number",
            sqlite_where=text("ended IS NOT NULL AND NOT tallied"),
            postgresql_where=text("ended IS NOT NULL AND NOT tallied"),
        ),
        Index("ix_jobs_work", "work_key", "tenant", "state", "number"),
        {"sqlite_autoincrement": True},
    )  # fmt: skip

    number: Mapped[int] = mapped_column(primary_key=True)
    id: Mapped[str] = mapped_column(String(32), unique=True)
    tenant: Mapped[str]
    kind: Mapped[JobKind]
    state: Mapped[JobState]
    name: Mapped[str]
    options: Mapped[dict[str, Any]]
    version: Mapped[str]
    work_key: Mapped[str] = mapped_column(String(64))
    created: Mapped[float]
    started: Mapped[float | None]
    ended: Mapped[float | None] = mapped_column(index=True)
    attempt: Mapped[int] = mapped_column(default=0)
    attempts: Mapped[int]
    priority: Mapped[Priority] = mapped_column(server_default=Priority.INTERACTIVE)
    keep: Mapped[Keep] = mapped_column(server_default=Keep.ALL)
    asset_number: Mapped[int | None] = mapped_column(
        ForeignKey("assets.number", ondelete="CASCADE")
    )
    webhook: Mapped[str | None]
    cancel_asked: Mapped[bool] = mapped_column(default=False)
    failure: Mapped[dict[str, Any] | None]
    summary: Mapped[dict[str, Any] | None]
    reused: Mapped[str | None] = mapped_column(String(32))
    retry_of: Mapped[str | None] = mapped_column(String(32))
    request_id: Mapped[str | None] = mapped_column(String(64))
    trace: Mapped[str | None]
    owner: Mapped[str | None]
    beat: Mapped[int] = mapped_column(default=0)
    lease_seconds: Mapped[float] = mapped_column(default=0.0)
    due: Mapped[float] = mapped_column(default=0.0, server_default=text("0"))
    tallied: Mapped[bool] = mapped_column(default=False, server_default=false())

    asset: Mapped[AssetRow | None] = relationship(lazy="joined")


class LineRow(Base):
    """The line of a tenant: how many of its jobs wait and run, and when it last had its turn.

    Counted in the transactions that change the jobs, so that nothing has to count those.  The
    tenant with the lowest ``turn`` is next.

    ``streak``  interactive jobs that it had since, in a row, while a bulk job of its own waited.
    """

    __tablename__ = "lines"
    __table_args__ = (
        CheckConstraint("waiting >= 0 AND running >= 0", name="counts"),
        Index(
            "ix_lines_waiting", "tenant",
            sqlite_where=text("waiting > 0"), postgresql_where=text("waiting > 0"),
        ),
    )  # fmt: skip

    tenant: Mapped[str] = mapped_column(primary_key=True)
    turn: Mapped[int] = mapped_column(index=True, default=0)
    streak: Mapped[int] = mapped_column(default=0)
    waiting: Mapped[int] = mapped_column(default=0)
    running: Mapped[int] = mapped_column(default=0)


class JobFileRow(Base):
    """A file of a job; the bytes are in the blob store.

    ``label``  what the job's owner calls an input.
    """

    __tablename__ = "job_files"

    job_number: Mapped[int] = mapped_column(
        ForeignKey("jobs.number", ondelete="CASCADE"), primary_key=True
    )
    name: Mapped[str] = mapped_column(primary_key=True)
    digest: Mapped[str] = mapped_column(String(64), index=True)
    size: Mapped[int]
    media_type: Mapped[str]
    is_input: Mapped[bool]
    label: Mapped[str | None]


class BlobCheckRow(Base):
    """When all blobs of a folder were last read to see whether they are right; by its number."""

    __tablename__ = "blob_checks"
    __table_args__ = (CheckConstraint("folder BETWEEN 0 AND 255", name="folder"),)

    folder: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    checked: Mapped[float]


class IdempotencyKeyRow(Base):
    """What a tenant's request under a key was answered, and a hash of the request.

    ``status`` is null only within the transaction that does what was asked for.
    """

    __tablename__ = "idempotency_keys"

    tenant: Mapped[str] = mapped_column(primary_key=True)
    key: Mapped[str] = mapped_column(primary_key=True)
    fingerprint: Mapped[str] = mapped_column(String(64))
    created: Mapped[float] = mapped_column(index=True)
    status: Mapped[int | None]
    headers: Mapped[dict[str, Any] | None]
    body: Mapped[bytes | None]
    job_id: Mapped[str | None] = mapped_column(String(32))


class ApiKeyRow(Base):
    """A key, of which only the hash is known; ``digest`` is the SHA-256 of the secret.

    The other columns are as :class:`~service.access.key.ApiKey` has them.
    """

    __tablename__ = "api_keys"
    __table_args__ = (
        _one_of("scope", Scope),
        Index("ix_api_keys_live", "revoked", "tenant"),
        {"sqlite_autoincrement": True},
    )

    number: Mapped[int] = mapped_column(primary_key=True)
    id: Mapped[str] = mapped_column(String(32), unique=True)
    tenant: Mapped[str]
    name: Mapped[str]
    scope: Mapped[Scope]
    hint: Mapped[str]
    digest: Mapped[str] = mapped_column(String(64), unique=True)
    created: Mapped[float]
    last_used: Mapped[float | None]
    expires: Mapped[float | None]
    revoked: Mapped[float | None]
    replaces: Mapped[str | None] = mapped_column(String(32))
    curates: Mapped[bool] = mapped_column(default=False, server_default=false())


class JournalRow(Base):
    """Who did what; the columns are as :class:`~service.journal.Entry` has them."""

    __tablename__ = "journal"
    __table_args__ = (
        Index("ix_journal_tenant", "tenant", "number", "at"),
        {"sqlite_autoincrement": True},
    )

    number: Mapped[int] = mapped_column(primary_key=True)
    at: Mapped[float] = mapped_column(index=True)
    tenant: Mapped[str]
    actor: Mapped[str]
    address: Mapped[str | None]
    action: Mapped[str]
    subject: Mapped[str]
    details: Mapped[dict[str, Any]]


class EndedSessionRow(Base):
    """A session that was signed out, by its name, until ``expires``, when it is over anyway."""

    __tablename__ = "ended_sessions"

    name: Mapped[str] = mapped_column(String(32), primary_key=True)
    expires: Mapped[float]


class DeliveryRow(Base):
    """A webhook of a job; it waits from ``since`` to ``due``, and ``reason`` says why.

    ``owner``  who sends it, until then.
    """

    __tablename__ = "deliveries"
    __table_args__ = (
        _one_of("state", DeliveryState),
        Index("ix_deliveries_due", "state", "due"),
        {"sqlite_autoincrement": True},
    )

    number: Mapped[int] = mapped_column(primary_key=True)
    id: Mapped[str] = mapped_column(String(32), unique=True)
    job_number: Mapped[int] = mapped_column(
        ForeignKey("jobs.number", ondelete="CASCADE"), index=True
    )
    state: Mapped[DeliveryState]
    url: Mapped[str]
    attempt: Mapped[int] = mapped_column(default=0)
    since: Mapped[float]
    due: Mapped[float]
    reason: Mapped[str | None]
    redelivered: Mapped[int] = mapped_column(default=0, server_default="0")
    owner: Mapped[str | None]

    job: Mapped[JobRow] = relationship(lazy="joined", innerjoin=True)


class DeliveryAttemptRow(Base):
    """What came of one try to deliver a webhook."""

    __tablename__ = "delivery_attempts"
    __table_args__ = ({"sqlite_autoincrement": True},)

    number: Mapped[int] = mapped_column(primary_key=True)
    delivery_number: Mapped[int] = mapped_column(
        ForeignKey("deliveries.number", ondelete="CASCADE"), index=True
    )
    at: Mapped[float]
    milliseconds: Mapped[float]
    status: Mapped[int | None]
    reason: Mapped[str]
    excerpt: Mapped[str | None]


class WebhookSecretRow(Base):
    """How often a tenant's secret of webhooks was rotated; none is kept here.

    ``overlap_ends``  until when the one before is good as well.
    """

    __tablename__ = "webhook_secrets"

    tenant: Mapped[str] = mapped_column(primary_key=True)
    generation: Mapped[int]
    overlap_ends: Mapped[float]


class ProgressRow(Base):
    """How far a running job is, for servers other than the one that does it."""

    __tablename__ = "progress"

    job_id: Mapped[str] = mapped_column(String(32), primary_key=True)
    stage: Mapped[str]
    fraction: Mapped[float]
    measure: Mapped[float | None]
    level: Mapped[int]
    levels: Mapped[int]
    seconds: Mapped[float]
    picture: Mapped[bytes | None]
    picture_number: Mapped[int]


class FailedSignInsRow(Base):
    """How much the unknown keys of an address weigh at a time; see :mod:`service.access`."""

    __tablename__ = "failed_sign_ins"

    bucket: Mapped[str] = mapped_column(primary_key=True)
    level: Mapped[float]
    at: Mapped[float] = mapped_column(index=True)


class TallyRow(Base):
    """What was counted of jobs that have ended, by labels, for metrics."""

    __tablename__ = "tallies"

    labels: Mapped[str] = mapped_column(primary_key=True)
    count: Mapped[int]
    total: Mapped[float]


class DeploymentRow(Base):
    """The one row that says which release's servers take work, and which may use the tables.

    ``runs_from``  the schema of the oldest of these.
    ``secret``     tells the secret that all share from another; empty until one is known.
    """

    __tablename__ = "deployment"
    __table_args__ = (CheckConstraint("number = 1", name="number"),)

    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    release: Mapped[str]
    runs_from: Mapped[str]
    secret: Mapped[str] = mapped_column(default="", server_default="")
