"""Unknown keys, counted over all servers that share a database; see
:class:`service.access.attempts.Attempts`.
"""

from __future__ import annotations

from sqlalchemy import case, delete, select

from service.access.attempts import LIMIT, SECONDS, bucket_of, level_at, wait_at
from service.storage.database import Database, dialect_insert, retried
from service.storage.tables import FailedSignInsRow

_FADED_SECONDS = 3600.0
"""After which a bucket that nobody has added to is forgotten."""


class SqlFailedAttempts:
    """A row a bucket; what has faded long ago goes as others come."""

    def __init__(self, database: Database) -> None:
        self._database = database

    @retried
    def count(self, address: str, hint: str = "") -> None:
        now = self._database.clock()
        row = FailedSignInsRow
        with self._database.writing() as session:
            self._database.do_without_flush(session)
            insert = dialect_insert(session)(row)
            left = row.level - (now - row.at) * (LIMIT / SECONDS)
            session.execute(
                insert.values(
                    bucket=bucket_of(address, hint), level=1.0, at=now
                ).on_conflict_do_update(
                    index_elements=[row.bucket],
                    set_={"level": case((left > 0.0, left), else_=0.0) + 1.0, "at": now},
                )
            )
            session.execute(delete(row).where(row.at < now - _FADED_SECONDS))

    def seconds_to_wait(self, address: str, hint: str = "") -> int:
        with self._database.reading() as session:
            query = select(FailedSignInsRow).where(
                FailedSignInsRow.bucket == bucket_of(address, hint)
            )
            row = session.scalars(query).first()
            if row is None:
                return 0
            return wait_at(level_at(row.level, self._database.clock() - row.at))
