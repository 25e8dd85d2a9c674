"""Which object of a bucket has which blob, for all processes that share a database and a bucket.

An object's key is written down before the object is put, and forgotten after it was removed.  So
whatever is in the bucket is known, and no name in it ever changes its meaning: what is read, put or
removed late, by whoever was held up, is the object that was meant.

**Nothing that a row names is removed.**  Three parties change an object's row: who comes to rely on
its blob (:meth:`BlobLedger.adopt`, and :func:`rely_on` within the transaction that names it), who
puts another in its place (:meth:`BlobLedger.publish`), and who sweeps (:meth:`BlobLedger.doom`).
Whoever relies on it raises ``touched``; whoever sweeps

1. reads some rows that no hold protects, with their ``touched`` (:meth:`BlobLedger.sweepable`);
2. after that reads what the jobs name;
3. dooms those that are not named, each only if it is stored still and ``touched`` is as it was.

A job's file that is committed at 3 either was so before 2 read, and is seen there; or the
transaction that named it raised ``touched`` after 1, and 3 leaves the row alone; or it does so
after 3, finds nothing stored, and is undone as a whole (:class:`~service.errors.HoldLostError`).
Nothing between depends on any clock, on leases, or on how long anybody was held up.

That the last case does not happen to who is alive is what holds are for.  What is put or found is
held from the same transaction on until its keeping ends, which is after its names are committed.
The holds of an owner count until its lease runs out; it renews that long before.

**READ COMMITTED is enough**, as in PostgreSQL: each change is one UPDATE that says in its WHERE
what it relies on.  Where two meet at a row, the second waits for the first and looks at the WHERE
again with the row as it is then; so one of them changes nothing, and tells by its count.  A
statement that had to wait does not see rows that came meanwhile: whoever relies on a blob looks
once more before it says that there is none, and of two that publish the same blob the second breaks
the index of stored digests and is done again.  Holds are written under a lock of their owner's
row, which whoever declares an owner dead has to remove.  Rows are locked in the order of their
keys where there are several.  In SQLite one writes at a time, and nobody waits within.
"""

from __future__ import annotations

import secrets
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any, TypeVarTuple, cast

from sqlalchemy import (
    ColumnElement,
    CursorResult,
    Result,
    Select,
    String,
    delete,
    exists,
    insert,
    select,
    type_coerce,
    update,
)
from sqlalchemy.orm import Session

from service.errors import HoldLostError
from service.jobs.job import Blob
from service.storage.blobs.tables import (
    BlobHoldRow,
    BlobObjectRow,
    BlobOwnerRow,
    ObjectState,
)
from service.storage.database import Database, retried

_BATCH = 1000
_IS_STORED = BlobObjectRow.state == ObjectState.STORED
_DIGEST = type_coerce(BlobObjectRow.digest, String(64))  # which all have that have a blob

Columns = TypeVarTuple("Columns")


@dataclass(frozen=True)
class Sweepable:
    """An object that no hold protected when it was looked at, and what it was then."""

    key: str
    digest: str
    touched: int


class BlobLedger:
    """The rows of objects, owners and holds.  Every method is one transaction, or reads.

    ``clock``  Unix seconds, of all who share the database.
    ``lease``  seconds after which a silent owner counts as dead.
    """

    def __init__(
        self,
        database: Database,
        clock: Callable[[], float] | None = None,
        lease: float = 300.0,
    ) -> None:
        self._database = database
        self._clock = clock or database.clock
        self.lease = lease

    # Who puts and holds.

    @retried
    def join(self, owner: str) -> None:
        """Begin as an owner, under a new name."""
        with self._database.writing() as session:
            session.add(BlobOwnerRow(id=owner, until=self._clock() + self.lease))

    @retried
    def renew(self, owner: str, ended: Collection[str], abandoned: Collection[str]) -> bool:
        """Whether the owner still counts as alive, which it does from now on for a lease.

        ``ended``      its keepings that hold nothing any more.
        ``abandoned``  keys of its own that nothing will be put to any more.
        """
        with self._database.writing() as session:
            alive = session.execute(
                update(BlobOwnerRow)
                .where(BlobOwnerRow.id == owner)
                .values(until=self._clock() + self.lease)
            )
            for some in _batches(ended):
                session.execute(delete(BlobHoldRow).where(BlobHoldRow.keeping.in_(some)))
            for some in _batches(abandoned):
                _doom_writing(session, BlobObjectRow.key.in_(some))
            return _count(alive) == 1

    @retried
    def leave(self, owner: str) -> None:
        """End an owner in good order: it holds nothing, and what it did not finish is removed."""
        with self._database.writing() as session:
            _bury(session, owner)

    @retried
    def bury_dead(self) -> int:
        """Do so for all whose lease has run out; how many."""
        with self._database.writing() as session:
            now = self._clock()
            silent = session.scalars(
                select(BlobOwnerRow.id)
                .where(BlobOwnerRow.until < now)
                .order_by(BlobOwnerRow.id)
                .with_for_update()
            ).all()
            for owner in silent:
                _bury(session, owner)
            return len(silent)

    @retried
    def reserve(self, owner: str, count: int) -> list[str]:
        """Write new keys down, for objects to be put.  Raises :class:`HoldLostError`."""
        keys = [secrets.token_hex(16) for _ in range(count)]
        with self._database.writing() as session:
            _lock_owner(session, owner)
            session.execute(
                insert(BlobObjectRow),
                [{"key": key, "state": ObjectState.WRITING, "owner": owner} for key in keys],
            )
        return keys

    @retried
    def publish(self, owner: str, keeping: str, key: str, blob: Blob) -> bool:
        """Have an object that was put be the blob's, in place of any other, and hold the blob.

        Whether that had been damaged.  Raises :class:`HoldLostError`, where a sweep may have
        removed the object by now.
        """
        with self._database.writing() as session:
            _lock_owner(session, owner)
            others = select(BlobObjectRow.key, BlobObjectRow.state).where(
                BlobObjectRow.digest == blob.digest,
                BlobObjectRow.state.in_([ObjectState.STORED, ObjectState.ASIDE]),
            )
            found = session.execute(_locked(others)).all()
            session.execute(
                update(BlobObjectRow)
                .where(BlobObjectRow.key.in_([one.key for one in found]))
                .values(state=ObjectState.DOOMED)
            )
            mine = session.execute(
                update(BlobObjectRow)
                .where(BlobObjectRow.key == key, BlobObjectRow.state == ObjectState.WRITING)
                .values(
                    state=ObjectState.STORED, digest=blob.digest, size=blob.size, owner=None
                )
            )  # fmt: skip
            if _count(mine) != 1:
                raise _lost()
            _hold(session, owner, keeping, blob.digest)
            return any(one.state == ObjectState.ASIDE for one in found)

    @retried
    def adopt(self, owner: str, keeping: str, blob: Blob) -> None:
        """Hold a blob that is stored.  Raises KeyError where it is not, and
        :class:`HoldLostError`."""
        with self._database.writing() as session:
            _lock_owner(session, owner)
            if _touch(session, [blob]):
                raise KeyError(blob.digest)
            _hold(session, owner, keeping, blob.digest)

    # Who reads.

    def key_of(self, blob: Blob) -> str:
        """Of the object that has it.  Raises KeyError."""
        with self._database.reading() as session:
            key = session.scalars(
                select(BlobObjectRow.key).where(
                    _IS_STORED,
                    BlobObjectRow.digest == blob.digest,
                    BlobObjectRow.size == blob.size,
                )
            ).first()
        if key is None:
            raise KeyError(blob.digest)
        return key

    def find(self, digest: str, *, aside: bool = False) -> tuple[str, int] | None:
        """Key and size of the object that has a blob, or had it before it was put aside."""
        state = ObjectState.ASIDE if aside else ObjectState.STORED
        with self._database.reading() as session:
            row = session.execute(
                select(BlobObjectRow.key, BlobObjectRow.size)
                .where(BlobObjectRow.digest == digest, BlobObjectRow.state == state)
                .order_by(BlobObjectRow.key)
            ).first()
        return None if row is None else (row[0], row[1] or 0)

    def digests(self, first: str, last: str) -> Iterator[str]:
        """Those of stored blobs from one up to before another, some in each transaction."""
        while True:
            query = (
                select(_DIGEST)
                .where(_IS_STORED, BlobObjectRow.digest >= first, BlobObjectRow.digest < last)
                .order_by(BlobObjectRow.digest)
                .limit(_BATCH)
            )
            with self._database.reading() as session:
                found = session.scalars(query).all()
            yield from found
            if found:
                first = found[-1] + "0"  # the next that there could be
            if len(found) < _BATCH:
                return

    @retried
    def put_aside(self, key: str) -> bool:
        """Have an object that is damaged, or gone, be the blob's no more; whether it was."""
        with self._database.writing() as session:
            changed = session.execute(
                update(BlobObjectRow)
                .where(BlobObjectRow.key == key, BlobObjectRow.state == ObjectState.STORED)
                .values(state=ObjectState.ASIDE)
            )
            return _count(changed) == 1

    @retried
    def put_back(self, key: str, digest: str) -> bool:
        """Have an object that was put aside be the blob's again, unless there is another."""
        with self._database.writing() as session:
            another = select(BlobObjectRow.key).where(_IS_STORED, BlobObjectRow.digest == digest)
            if session.scalars(another).first() is not None:
                return False
            back = session.execute(
                update(BlobObjectRow)
                .where(BlobObjectRow.key == key, BlobObjectRow.state == ObjectState.ASIDE)
                .values(state=ObjectState.STORED, touched=BlobObjectRow.touched + 1)
            )
            return _count(back) == 1

    def aside(self) -> Sequence[str]:
        """Digests of what was put aside."""
        with self._database.reading() as session:
            return session.scalars(
                select(_DIGEST)
                .where(BlobObjectRow.state == ObjectState.ASIDE)
                .distinct()
                .order_by(BlobObjectRow.digest)
            ).all()

    # Who sweeps.

    def sweepable(self) -> Iterator[list[Sweepable]]:
        """Stored objects that no hold protects, some at a time, in the order of their keys."""
        held = exists().where(BlobHoldRow.digest == BlobObjectRow.digest)
        last = ""
        while True:
            query = (
                select(BlobObjectRow.key, _DIGEST, BlobObjectRow.touched)
                .where(_IS_STORED, BlobObjectRow.key > last, ~held)
                .order_by(BlobObjectRow.key)
                .limit(_BATCH)
            )
            with self._database.reading() as session:
                found = [Sweepable(*row) for row in session.execute(query)]
            if found:
                last = found[-1].key
                yield found
            if len(found) < _BATCH:
                return

    @retried
    def doom(self, seen: Collection[Sweepable]) -> int:
        """Have objects be nobody's that are as they were when they were seen; how many were."""
        doomed = 0
        with self._database.writing() as session:
            for one in sorted(seen, key=lambda one: one.key):
                changed = session.execute(
                    update(BlobObjectRow)
                    .where(
                        BlobObjectRow.key == one.key,
                        BlobObjectRow.state == ObjectState.STORED,
                        BlobObjectRow.touched == one.touched,
                    )
                    .values(state=ObjectState.DOOMED)
                )
                doomed += _count(changed)
        return doomed

    @retried
    def doom_aside(self, digests: Collection[str]) -> None:
        """Have what was put aside of these blobs be removed."""
        with self._database.writing() as session:
            session.execute(
                update(BlobObjectRow)
                .where(BlobObjectRow.digest.in_(digests), BlobObjectRow.state == ObjectState.ASIDE)
                .values(state=ObjectState.DOOMED)
            )

    def doomed(self) -> list[tuple[str, bool]]:
        """Keys of objects to be removed, and whether each was never finished: some of them."""
        with self._database.reading() as session:
            rows = session.execute(
                select(BlobObjectRow.key, BlobObjectRow.owner)
                .where(BlobObjectRow.state == ObjectState.DOOMED)
                .order_by(BlobObjectRow.key)
                .limit(_BATCH)
            )
            return [(key, owner is not None) for key, owner in rows]

    @retried
    def forget(self, keys: Collection[str]) -> None:
        """Of objects that were removed."""
        with self._database.writing() as session:
            session.execute(
                delete(BlobObjectRow).where(
                    BlobObjectRow.key.in_(keys), BlobObjectRow.state == ObjectState.DOOMED
                )
            )

    def unknown(self, keys: Collection[str]) -> set[str]:
        """Those that no row has, of some thousand at most."""
        with self._database.reading() as session:
            known = session.scalars(select(BlobObjectRow.key).where(BlobObjectRow.key.in_(keys)))
            return set(keys).difference(known)


def rely_on(session: Session, blobs: Collection[Blob]) -> None:
    """Within a transaction that names these blobs: keep all sweeps from taking them.

    To be called before it ends.  Raises :class:`HoldLostError` where one is stored no more, upon
    which the transaction has to be undone.
    """
    if _touch(session, blobs):
        raise _lost()


def _touch(session: Session, blobs: Collection[Blob]) -> set[str]:
    """Raise ``touched`` of blobs that are stored; the digests of those that are not."""
    missing = {blob.digest: blob.size for blob in blobs}
    while missing:
        there = select(BlobObjectRow.key, BlobObjectRow.digest, BlobObjectRow.size).where(
            _IS_STORED, BlobObjectRow.digest.in_(missing)
        )
        # Locked first, in one order for all.
        rows = session.execute(_locked(there)).all()
        right = [row for row in rows if missing[row.digest] == row.size]
        if right:
            session.execute(
                update(BlobObjectRow)
                .where(BlobObjectRow.key.in_([row.key for row in right]))
                .values(touched=BlobObjectRow.touched + 1)
            )
        for row in right:
            del missing[row.digest]
        # What came while this waited for a lock, it has not seen.
        if not right and (rows or session.execute(there.limit(1)).first() is None):
            break
    return set(missing)


def _locked(query: Select[*Columns]) -> Select[*Columns]:
    """Lock the rows, in one order for all."""
    return query.order_by(BlobObjectRow.key).with_for_update()


def _lock_owner(session: Session, owner: str) -> None:
    """Keep an owner from being buried until the transaction ends."""
    alive = select(BlobOwnerRow.id).where(BlobOwnerRow.id == owner)
    if session.scalars(alive.with_for_update(read=True, key_share=True)).first() is None:
        raise _lost()


def _hold(session: Session, owner: str, keeping: str, digest: str) -> None:
    session.add(BlobHoldRow(owner=owner, keeping=keeping, digest=digest))


def _bury(session: Session, owner: str) -> None:
    """An owner and its holds go; what it did not finish is to be removed."""
    session.execute(delete(BlobHoldRow).where(BlobHoldRow.owner == owner))
    session.execute(delete(BlobOwnerRow).where(BlobOwnerRow.id == owner))
    _doom_writing(session, BlobObjectRow.owner == owner)


def _doom_writing(session: Session, which: ColumnElement[bool]) -> None:
    session.execute(
        update(BlobObjectRow)
        .where(which, BlobObjectRow.state == ObjectState.WRITING)
        .values(state=ObjectState.DOOMED)
    )


def _lost() -> HoldLostError:
    return HoldLostError(
        "what was stored for this was taken away again, since nothing was heard of it for long",
        remedy="send it again",
    )


def _count(result: Result[Any]) -> int:
    return cast("CursorResult[Any]", result).rowcount


def _batches(items: Collection[str]) -> Iterator[list[str]]:
    rest = iter(items)
    while some := list(islice(rest, _BATCH)):
        yield some
