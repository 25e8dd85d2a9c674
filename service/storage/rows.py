"""From rows to values and back."""

from __future__ import annotations

import secrets
from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.jobs.job import Blob, Failure, Job, JobFile, Summary
from service.storage.tables import JobFileRow, JobRow


def new_id() -> str:
    """128 random bits: nobody comes upon another's by trying."""
    return secrets.token_hex(16)


def job_of(row: JobRow) -> Job:
    return Job(
        id=row.id,
        number=row.number,
        tenant=row.tenant,
        kind=row.kind,
        state=row.state,
        name=row.name,
        options=row.options,
        version=row.version,
        created=row.created,
        attempt=row.attempt,
        attempts=row.attempts,
        asset=row.asset.name if row.asset else None,
        asset_id=row.asset.id if row.asset else None,
        webhook=row.webhook,
        started=row.started,
        ended=row.ended,
        cancel_asked=row.cancel_asked,
        failure=None if row.failure is None else Failure(**row.failure),
        summary=None if row.summary is None else summary_of(row.summary),
        reused=row.reused,
        retry_of=row.retry_of,
    )


def failure_columns(failure: Failure) -> dict[str, Any]:
    return asdict(failure)


def summary_columns(summary: Summary) -> dict[str, Any]:
    fields = {name: getattr(summary, name) for name in summary.__dataclass_fields__}
    return fields | {"timings": dict(summary.timings), "warnings": list(summary.warnings)}


def summary_of(stored: dict[str, Any]) -> Summary:
    return Summary(**(stored | {"warnings": tuple(stored["warnings"])}))


def files_of(session: Session, job_number: int) -> tuple[JobFile, ...]:
    """By name."""
    rows = session.scalars(
        select(JobFileRow).where(JobFileRow.job_number == job_number).order_by(JobFileRow.name)
    )
    return tuple(
        JobFile(row.name, Blob(row.digest, row.size), row.media_type, row.is_input, row.label)
        for row in rows
    )


def add_files(session: Session, job_number: int, files: Iterable[JobFile]) -> None:
    session.add_all(
        JobFileRow(
            job_number=job_number,
            name=file.name,
            digest=file.blob.digest,
            size=file.blob.size,
            media_type=file.media_type,
            is_input=file.is_input,
            label=file.label,
        )
        for file in files
    )
