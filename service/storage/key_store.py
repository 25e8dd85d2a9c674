"""API keys in the database; see :class:`service.access.key.KeyStore` for what is promised."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress

from sqlalchemy import delete, or_, select, update

from service.access.key import ApiKey, Scope, hash_of, hint_of, new_secret
from service.access.session import Session
from service.errors import ConflictError, DiskFullError, NotFoundError
from service.storage.database import Database
from service.storage.rows import by_name, new_id
from service.storage.tables import ApiKeyRow, EndedSessionRow

_NOTED_EVERY = 60.0
"""Seconds between two notes of a key's use: a read must not cost a write."""


class SqlKeyStore:
    """API keys; a secret is looked up by its SHA-256 and never kept."""

    def __init__(self, database: Database, clock: Callable[[], float] = time.time) -> None:
        self._database = database
        self._clock = clock

    def create(self, tenant: str, name: str, scope: Scope) -> tuple[ApiKey, str]:
        secret = new_secret()
        with self._database.writing() as session:
            row = ApiKeyRow(
                id=new_id(),
                tenant=tenant,
                name=name,
                scope=scope,
                hint=hint_of(secret),
                digest=hash_of(secret),
                created=self._clock(),
            )
            session.add(row)
            session.flush()
            return _key_of(row), secret

    def keys(self, tenant: str | None = None) -> Sequence[ApiKey]:
        """All keys, also those that were revoked, in the order in which they were made."""
        query = select(ApiKeyRow).order_by(ApiKeyRow.number)
        if tenant is not None:
            query = query.where(ApiKeyRow.tenant == tenant)
        with self._database.reading() as session:
            return [_key_of(row) for row in session.scalars(query)]

    def revoke(self, key_id: str) -> ApiKey:
        """Raises :class:`~service.errors.ConflictError` too, for a hint that several keys have."""
        with self._database.writing() as session:
            rows = session.scalars(
                select(ApiKeyRow)
                .where(or_(ApiKeyRow.id == key_id, ApiKeyRow.hint == key_id))
                .order_by(ApiKeyRow.number)
            ).all()
            if not rows:
                raise NotFoundError(
                    f"there is no key '{key_id}'", remedy="see 'occluder keys list' for all"
                )
            # Those that are revoked already are not meant, unless there are no others.
            meant = [row for row in rows if row.revoked is None] or rows[:1]
            if len(meant) > 1:
                keys = "; ".join(f"{row.id} of {row.tenant} {row.name}".rstrip() for row in meant)
                raise ConflictError(
                    f"{len(meant)} keys begin with '{key_id}'", remedy=f"name one by its id: {keys}"
                )
            if meant[0].revoked is None:
                meant[0].revoked = self._clock()
            return _key_of(meant[0])

    def find(self, secret: str) -> ApiKey | None:
        with self._database.reading() as session:
            row = session.scalars(
                select(ApiKeyRow).where(
                    ApiKeyRow.digest == hash_of(secret), ApiKeyRow.revoked.is_(None)
                )
            ).first()
            if row is None:
                return None
            key = _key_of(row)
        now = self._clock()
        if key.last_used is None or abs(now - key.last_used) >= _NOTED_EVERY:
            self._note_use(key, now)
        return key

    def key(self, key_id: str) -> ApiKey | None:
        with self._database.reading() as session:
            row = session.scalars(
                select(ApiKeyRow).where(ApiKeyRow.id == key_id, ApiKeyRow.revoked.is_(None))
            ).first()
            return None if row is None else _key_of(row)

    def _note_use(self, key: ApiKey, now: float) -> None:
        # Where the disk is full, what is stored can still be read, by those who may.
        with suppress(DiskFullError), self._database.writing() as session:
            session.execute(update(ApiKeyRow).where(ApiKeyRow.id == key.id).values(last_used=now))

    def tenants(self) -> Collection[str]:
        with self._database.reading() as session:
            return set(session.scalars(select(ApiKeyRow.tenant).distinct()))

    def end_session(self, session: Session) -> None:
        with self._database.writing() as open_session:
            open_session.execute(
                delete(EndedSessionRow).where(EndedSessionRow.expires <= self._clock())
            )
            # Signed out twice in a moment, it is signed out once.
            open_session.merge(EndedSessionRow(name=session.name, expires=float(session.expires)))

    def ended_sessions(self, now: float) -> Mapping[str, float]:
        query = select(EndedSessionRow).where(EndedSessionRow.expires > now)
        with self._database.reading() as open_session:
            return {row.name: row.expires for row in open_session.scalars(query)}


def _key_of(row: ApiKeyRow) -> ApiKey:
    return ApiKey(**by_name(row, ApiKey))
