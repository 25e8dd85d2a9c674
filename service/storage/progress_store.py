"""How far jobs are that other servers do; see :class:`service.jobs.progress.ProgressStore`.

In PostgreSQL the table is unlogged: it costs no flush, and is empty after a crash.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from sqlalchemy import select

from service.jobs.progress import JobProgress, Snapshot
from service.storage.database import Database, dialect_insert, retried
from service.storage.tables import ProgressRow


class SqlProgressStore:
    """A row a job, which goes with the attempt that it tells of."""

    def __init__(self, database: Database) -> None:
        self._database = database

    @retried
    def write(self, progress: Mapping[str, JobProgress]) -> None:
        rows = [_columns(job_id, one) for job_id, one in sorted(progress.items())]
        with self._database.writing() as session:
            self._database.do_without_flush(session)
            insert = dialect_insert(session)(ProgressRow)
            given = {name: insert.excluded[name] for name in rows[0] if name != "job_id"}
            session.execute(
                insert.on_conflict_do_update(index_elements=[ProgressRow.job_id], set_=given), rows
            )

    def read(self, job_ids: Collection[str]) -> Mapping[str, JobProgress]:
        with self._database.reading() as session:
            rows = session.scalars(select(ProgressRow).where(ProgressRow.job_id.in_(job_ids)))
            return {row.job_id: _progress_of(row) for row in rows}


def _columns(job_id: str, progress: JobProgress) -> dict[str, Any]:
    picture = progress.picture
    return {
        "job_id": job_id,
        "stage": progress.stage,
        "fraction": progress.fraction,
        "measure": progress.measure,
        "level": progress.level,
        "levels": progress.levels,
        "seconds": progress.seconds,
        "picture": picture.png if picture else None,
        "picture_number": picture.number if picture else 0,
    }


def _progress_of(row: ProgressRow) -> JobProgress:
    return JobProgress(
        row.stage,
        row.fraction,
        row.measure,
        row.level,
        row.levels,
        row.seconds,
        None if row.picture is None else Snapshot(row.picture_number, row.picture),
    )
