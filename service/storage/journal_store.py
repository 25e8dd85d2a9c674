"""The journal in the database; see :class:`service.journal.Journal` for what is promised."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from service.journal import Action, Actor, Entry, EntryPage
from service.storage.database import Database, retried
from service.storage.rows import by_name
from service.storage.tables import JournalRow


def note(
    session: Session,
    at: float,
    tenant: str,
    actor: Actor,
    action: Action,
    subject: str,
    details: Mapping[str, Any] | None = None,
) -> None:
    """Write an entry within the transaction of what it tells of."""
    session.add(
        JournalRow(
            at=at,
            tenant=tenant,
            actor=actor.name,
            address=actor.address,
            action=action,
            subject=subject,
            details=dict(details or {}),
        )
    )


class SqlJournal:
    """Who did what, newest first."""

    def __init__(self, database: Database, clock: Callable[[], float] | None = None) -> None:
        self._database = database
        self._clock = clock or database.clock

    @retried
    def note(
        self,
        tenant: str,
        actor: Actor,
        action: Action,
        subject: str,
        details: Mapping[str, Any] | None = None,
    ) -> None:
        with self._database.writing() as session:
            note(session, self._clock(), tenant, actor, action, subject, details)

    def entries(
        self,
        tenant: str | None,
        *,
        since: float | None = None,
        before: int | None = None,
        limit: int = 100,
    ) -> EntryPage:
        query = select(JournalRow).order_by(JournalRow.number.desc()).limit(limit + 1)
        if tenant is not None:
            query = query.where(JournalRow.tenant == tenant)
        if since is not None:
            query = query.where(JournalRow.at >= since)
        if before is not None:
            query = query.where(JournalRow.number < before)
        with self._database.reading() as session:
            found = [Entry(**by_name(row, Entry)) for row in session.scalars(query)]
        page = tuple(found[:limit])
        return EntryPage(page, page[-1].number if len(found) > limit else None)

    @retried
    def expire(self, before: float) -> int:
        old = JournalRow.at < before
        with self._database.writing() as session:
            count = session.scalars(select(func.count()).select_from(JournalRow).where(old)).one()
            session.execute(delete(JournalRow).where(old))
        return count
