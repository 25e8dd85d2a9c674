"""API keys in the database; see :class:`service.access.key.KeyStore` for what is promised."""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from typing import Any

from sqlalchemy import ColumnElement, delete, or_, select, update
from sqlalchemy.orm import Session as OrmSession

from service.access.key import (
    LONGEST_OVERLAP,
    ApiKey,
    Caller,
    Rotation,
    Scope,
    hash_of,
    hint_of,
    new_secret,
)
from service.access.session import Session
from service.errors import (
    ConflictError,
    DiskFullError,
    FieldError,
    InvalidOptionsError,
    NotFoundError,
)
from service.journal import COMMAND_LINE, Action, Actor
from service.storage.database import Database, dialect_insert, retried
from service.storage.journal_store import note
from service.storage.rows import by_name, new_id
from service.storage.tables import ApiKeyRow, EndedSessionRow

_log = logging.getLogger(__name__)

_NOTED_EVERY = 60.0
"""Seconds between two notes of a key's use: a read must not cost a write."""


class SqlKeyStore:
    """API keys; a secret is looked up by its SHA-256 and never kept."""

    def __init__(self, database: Database, clock: Callable[[], float] | None = None) -> None:
        self._database = database
        self._clock = clock or database.clock

    @retried
    def create(
        self,
        tenant: str,
        name: str,
        scope: Scope,
        *,
        expires: float | None = None,
        by: Actor = COMMAND_LINE,
    ) -> tuple[ApiKey, str]:
        now = self._clock()
        _check_end(expires, now)
        with self._database.writing() as session:
            row, secret = _add(session, now, tenant=tenant, name=name, scope=scope, expires=expires)
            note(session, now, tenant, by, Action.KEY_MADE, row.id, _told(row))
            return _key_of(row), secret

    def keys(self, tenant: str | None = None) -> Sequence[ApiKey]:
        """All keys, also those that have ended, in the order in which they were made."""
        query = select(ApiKeyRow).order_by(ApiKeyRow.number)
        if tenant is not None:
            query = query.where(ApiKeyRow.tenant == tenant)
        with self._database.reading() as session:
            return [_key_of(row) for row in session.scalars(query)]

    @retried
    def rotate(
        self,
        key_id: str,
        *,
        overlap: float,
        expires: float | None = None,
        tenant: str | None = None,
        by: Actor = COMMAND_LINE,
    ) -> Rotation:
        now = self._clock()
        _check_end(expires, now)
        _check_overlap(overlap)
        with self._database.writing() as session:
            old = _find(session, key_id, tenant, now)
            _check_rotates(session, old, now)
            if expires is None and old.expires is not None:
                expires = now + old.expires - old.created
            new, secret = _add(
                session, now, tenant=old.tenant, name=old.name, scope=old.scope, expires=expires,
                replaces=old.id, curates=old.curates,
            )  # fmt: skip
            old.revoked = now + overlap
            until = min(end for end in (old.revoked, old.expires) if end is not None)
            note(
                session, now, old.tenant, by, Action.KEY_ROTATED, old.id,
                {**_told(new), "new": new.id, "until": until},
            )  # fmt: skip
            return Rotation(_key_of(old), _key_of(new), secret)

    @retried
    def revoke(self, key_id: str, *, tenant: str | None = None, by: Actor = COMMAND_LINE) -> ApiKey:
        """Raises :class:`~service.errors.ConflictError` too, for a hint that several keys have."""
        now = self._clock()
        with self._database.writing() as session:
            row = _find(session, key_id, tenant, now)
            if row.revoked is None or row.revoked > now:
                row.revoked = now
                note(session, now, row.tenant, by, Action.KEY_REVOKED, row.id, {"name": row.name})
            return _key_of(row)

    def find(self, secret: str) -> ApiKey | None:
        return self._live(ApiKeyRow.digest == hash_of(secret))

    def key(self, key_id: str) -> ApiKey | None:
        return self._live(ApiKeyRow.id == key_id)

    def _live(self, named: ColumnElement[bool]) -> ApiKey | None:
        """The key that is named so, noted as used, unless it has ended."""
        now = self._clock()
        with self._database.reading() as session:
            row = session.scalars(select(ApiKeyRow).where(named)).first()
            key = None if row is None else _key_of(row)
        if key is None or not key.counts_at(now):
            return None
        if key.last_used is None or abs(now - key.last_used) >= _NOTED_EVERY:
            self._note_use(key, now)
        return key

    @retried
    def _note_use(self, key: ApiKey, now: float) -> None:
        # Of those who read the same moment, one notes; the others find it noted.
        as_read = (ApiKeyRow.id == key.id, ApiKeyRow.last_used.is_not_distinct_from(key.last_used))
        # Where the disk is full, what is stored can still be read, by those who may.
        with suppress(DiskFullError), self._database.writing() as session:
            session.execute(update(ApiKeyRow).where(*as_read).values(last_used=now))

    def tenants(self) -> Collection[str]:
        with self._database.reading() as session:
            return set(session.scalars(select(ApiKeyRow.tenant).distinct()))

    @retried
    def begin_session(self, key: Caller, address: str) -> None:
        by = key.at(address)
        try:
            with self._database.writing() as session:
                note(session, self._clock(), key.tenant, by, Action.SIGNED_IN, by.name)
        except DiskFullError:
            _log.warning("key %s signed in, which the journal has no room for", by.name)

    @retried
    def end_session(self, session: Session, address: str) -> None:
        now, key_id = self._clock(), session.key_id
        with self._database.writing() as open_session:
            open_session.execute(delete(EndedSessionRow).where(EndedSessionRow.expires <= now))
            ends = dialect_insert(open_session)(EndedSessionRow).values(
                name=session.name, expires=float(session.expires)
            )
            ends = ends.on_conflict_do_nothing().returning(EndedSessionRow.name)
            if open_session.scalars(ends).first() is None:
                return  # signed out twice in a moment, it is signed out once
            tenant = open_session.scalars(
                select(ApiKeyRow.tenant).where(ApiKeyRow.id == key_id)
            ).first()
            if tenant is not None:
                by = Actor(key_id, address)
                note(open_session, now, tenant, by, Action.SIGNED_OUT, key_id)

    def has_ended(self, session: Session) -> bool:
        with self._database.reading() as open_session:
            return open_session.get(EndedSessionRow, session.name) is not None

    def ended_sessions(self, now: float) -> Mapping[str, float]:
        query = select(EndedSessionRow).where(EndedSessionRow.expires > now)
        with self._database.reading() as open_session:
            return {row.name: row.expires for row in open_session.scalars(query)}


def _add(session: OrmSession, now: float, **columns: Any) -> tuple[ApiKeyRow, str]:
    """A new key and its secret."""
    secret = new_secret()
    row = ApiKeyRow(
        id=new_id(), hint=hint_of(secret), digest=hash_of(secret), created=now, **columns
    )
    session.add(row)
    session.flush()
    return row, secret


def _find(session: OrmSession, key_id: str, tenant: str | None, now: float) -> ApiKeyRow:
    """The key of an id or a hint, locked; of several, the one that has not ended."""
    query = (
        select(ApiKeyRow)
        .where(or_(ApiKeyRow.id == key_id, ApiKeyRow.hint == key_id))
        .order_by(ApiKeyRow.number)
    )
    if tenant is not None:
        query = query.where(ApiKeyRow.tenant == tenant)
    rows = session.scalars(query.with_for_update()).all()
    if not rows:
        raise NotFoundError(
            f"there is no key '{key_id}'", remedy="see 'occluder keys list' for all"
        )
    # Those that have ended already are not meant, unless there are no others.
    meant = [row for row in rows if _key_of(row).counts_at(now)] or rows[:1]
    if len(meant) > 1:
        keys = "; ".join(f"{row.id} of {row.tenant} {row.name}".rstrip() for row in meant)
        raise ConflictError(
            f"{len(meant)} keys begin with '{key_id}'", remedy=f"name one by its id: {keys}"
        )
    return meant[0]


def _check_end(expires: float | None, now: float) -> None:
    if expires is not None and expires <= now:
        fault = FieldError("expires", "it is over already", "choose a time that is to come")
        raise InvalidOptionsError([fault])


def _check_overlap(overlap: float) -> None:
    if not 0.0 <= overlap <= LONGEST_OVERLAP:
        remedy = f"choose 0 to {LONGEST_OVERLAP / 86_400.0:.0f} days"
        raise InvalidOptionsError([FieldError("overlap", "it is out of range", remedy)])


def _check_rotates(session: OrmSession, old: ApiKeyRow, now: float) -> None:
    if not _key_of(old).counts_at(now):
        raise ConflictError(f"the key '{old.id}' has ended", remedy="make a new key in its place")
    others = session.scalars(select(ApiKeyRow).where(ApiKeyRow.replaces == old.id))
    for other in others:
        if _key_of(other).counts_at(now):
            raise ConflictError(
                f"the key '{other.id}' replaces '{old.id}' already",
                remedy="rotate that one, or revoke it first",
            )


def _told(row: ApiKeyRow) -> dict[str, Any]:
    """What the journal says of a new key."""
    return {"name": row.name, "scope": row.scope, "expires": row.expires}


def _key_of(row: ApiKeyRow) -> ApiKey:
    return ApiKey(**by_name(row, ApiKey))
