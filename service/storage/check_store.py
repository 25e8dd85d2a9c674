"""When blobs were last checked, and which files they are, in the database.

A row for each blob would outgrow all others; one for each of the folders that they lie in will do,
for a folder is checked as a whole.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from sqlalchemy import func, select

from service.jobs.stores import FOLDERS
from service.storage.database import Database, dialect_insert, retried
from service.storage.tables import BlobCheckRow, JobFileRow, JobRow


@dataclass(frozen=True)
class FolderCheck:
    """A folder of blobs, by its number, and when its check began, Unix seconds."""

    folder: int
    checked: float


@dataclass(frozen=True)
class Named:
    """Where a blob is named: a file of a job, and how many more files are the same."""

    job_id: str
    file: str
    others: int


class SqlCheckStore:
    """Checks of blobs.  Safe from any thread, and beside other processes."""

    def __init__(self, database: Database, clock: Callable[[], float] | None = None) -> None:
        self._database = database
        self._clock = clock or database.clock

    @retried
    def begin(self) -> None:
        """What has never been checked is watched from now on: its age counts from here."""
        with self._database.writing() as session:
            known = set(session.scalars(select(BlobCheckRow.folder)))
            missing, now = set(range(FOLDERS)) - known, self._clock()
            if missing:
                rows = [{"folder": one, "checked": now} for one in sorted(missing)]
                insert = dialect_insert(session)(BlobCheckRow).on_conflict_do_nothing()
                session.execute(insert.values(rows))

    def all(self) -> list[FolderCheck]:
        """Those that are watched, the oldest check first."""
        with self._database.reading() as session:
            rows = session.execute(
                select(BlobCheckRow.folder, BlobCheckRow.checked).order_by(
                    BlobCheckRow.checked, BlobCheckRow.folder
                )
            )
            return [FolderCheck(*row) for row in rows]

    @retried
    def note(self, *checks: FolderCheck) -> None:
        """The whole of these folders was checked."""
        with self._database.writing() as session:
            for check in checks:
                session.merge(BlobCheckRow(folder=check.folder, checked=check.checked))

    def named(self, folder: int) -> frozenset[str]:
        """Digests of a folder that files of jobs have."""
        first, last = f"{folder:02x}", f"{folder:02x}g"  # no digit comes after f but g
        with self._database.reading() as session:
            return frozenset(
                session.scalars(
                    select(JobFileRow.digest).where(
                        JobFileRow.digest >= first, JobFileRow.digest < last
                    )
                )
            )

    def name_of(self, digest: str) -> Named | None:
        """The first file of a blob; None where no row names it any more."""
        with self._database.reading() as session:
            of_it = JobFileRow.digest == digest
            count = session.scalars(select(func.count()).select_from(JobFileRow).where(of_it)).one()
            row = session.execute(
                select(JobRow.id, JobFileRow.name)
                .join(JobFileRow, JobFileRow.job_number == JobRow.number)
                .where(of_it)
                .order_by(JobFileRow.job_number, JobFileRow.name)
                .limit(1)
            ).first()
        return None if row is None else Named(row.id, row.name, count - 1)
