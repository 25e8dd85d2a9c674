"""Counts of jobs that have ended, in the database; see :class:`service.jobs.tallies.Tallies`.

A job is marked as counted in the transaction that counts it, whoever ended it and however that one
went on: so each counts once.  One counts at a time; those who come meanwhile read what is there.
"""

from __future__ import annotations

import json
from collections.abc import Mapping

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from service.jobs.job import Failure
from service.jobs.tallies import Labels, Tally, labels_of
from service.storage.database import Database, dialect_insert, retried
from service.storage.rows import summary_of
from service.storage.tables import JobRow, TallyRow

_AT_ONCE = 500
"""Jobs that are counted in one transaction."""


class SqlTallies:
    """A row for each set of labels."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def totals(self) -> Mapping[Labels, Tally]:
        while self._count_some() == _AT_ONCE:
            pass
        with self._database.reading() as session:
            rows = session.scalars(select(TallyRow))
            return {tuple(json.loads(row.labels)): Tally(row.count, row.total) for row in rows}

    def _count_some(self) -> int:
        with self._database.reading() as session:
            if session.scalars(select(JobRow.number).where(*_UNCOUNTED).limit(1)).first() is None:
                return 0
        return self._count()

    @retried
    def _count(self) -> int:
        with self._database.writing() as session:
            if not self._database.lock(session, "tallies"):
                return 0
            rows = session.execute(
                select(
                    JobRow.number, JobRow.kind, JobRow.state, JobRow.failure, JobRow.summary,
                    JobRow.reused,
                )
                .where(*_UNCOUNTED)
                .order_by(JobRow.number)
                .limit(_AT_ONCE)
            ).all()  # fmt: skip
            news: dict[Labels, Tally] = {}
            for row in rows:
                failure = None if row.failure is None else Failure(**row.failure)
                made = row.summary is not None and row.reused is None
                summary = summary_of(row.summary) if made else None
                for labels, tally in labels_of(row.kind, row.state, failure, summary):
                    news[labels] = news.get(labels, Tally(0)) + tally
            _add(session, news)
            session.execute(
                update(JobRow)
                .where(JobRow.number.in_([row.number for row in rows]))
                .values(tallied=True)
                .execution_options(synchronize_session=False)
            )
            return len(rows)


_UNCOUNTED = (JobRow.ended.is_not(None), ~JobRow.tallied)


def _add(session: Session, news: Mapping[Labels, Tally]) -> None:
    insert = dialect_insert(session)(TallyRow)
    more = {
        "count": TallyRow.count + insert.excluded.count,
        "total": TallyRow.total + insert.excluded.total,
    }
    rows = [
        {"labels": json.dumps(labels), "count": tally.count, "total": tally.total}
        for labels, tally in sorted(news.items())
    ]
    if rows:
        session.execute(insert.on_conflict_do_update(index_elements=["labels"], set_=more), rows)
