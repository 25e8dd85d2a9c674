"""The tables of blobs in a bucket: which object has which blob, who puts one, and who holds one."""

from __future__ import annotations

from enum import StrEnum

from sqlalchemy import CheckConstraint, ForeignKey, Index, String, text
from sqlalchemy.orm import Mapped, mapped_column

from service.storage.tables import Base


class ObjectState(StrEnum):
    """What an object of the bucket is to us."""

    WRITING = "writing"
    """Its key is written down: it may come, be there in part, or whole."""
    STORED = "stored"
    """It has the bytes of a blob; no other has them, as far as we know."""
    ASIDE = "aside"
    """Its bytes turned out to be others than its blob's, or it is gone: it is kept for whoever asks
    why, and may turn out to be right after all."""
    DOOMED = "doomed"
    """Nobody is given it any more, and a sweep removes it."""


_STORED = text(f"state = '{ObjectState.STORED}'")
_NOT_STORED = text(f"state <> '{ObjectState.STORED}'")
_OWNED = text("owner IS NOT NULL")
_STATES = ", ".join(f"'{state}'" for state in ObjectState)


class BlobObjectRow(Base):
    """An object, by its key, which is random and never used again.

    ``owner``    of one that was begun and never became a blob: who puts it, or did.
    ``touched``  rises each time that somebody comes to rely on it: see
                 :mod:`service.storage.blobs.ledger`.
    """

    __tablename__ = "blob_objects"
    __table_args__ = (
        CheckConstraint(f"state IN ({_STATES})", name="state"),
        CheckConstraint(
            "state IN ('writing', 'doomed') OR (digest IS NOT NULL AND size IS NOT NULL)",
            name="digest",
        ),
        CheckConstraint("state <> 'writing' OR owner IS NOT NULL", name="owner"),
        Index(
            "ix_blob_objects_stored", "digest", unique=True,
            sqlite_where=_STORED, postgresql_where=_STORED,
        ),
        Index(
            "ix_blob_objects_other", "state", "key",
            sqlite_where=_NOT_STORED, postgresql_where=_NOT_STORED,
        ),
        Index("ix_blob_objects_owner", "owner", sqlite_where=_OWNED, postgresql_where=_OWNED),
    )  # fmt: skip

    key: Mapped[str] = mapped_column(String(32), primary_key=True)
    state: Mapped[str] = mapped_column(String(16))
    digest: Mapped[str | None] = mapped_column(String(64))
    size: Mapped[int | None]
    owner: Mapped[str | None] = mapped_column(String(32))
    touched: Mapped[int] = mapped_column(default=0, server_default=text("0"))


class BlobOwnerRow(Base):
    """A process that puts or holds blobs, and the time, Unix seconds, until which it counts as
    alive.
    """

    __tablename__ = "blob_owners"

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    until: Mapped[float]


class BlobHoldRow(Base):
    """A blob that a keeping of an owner holds: no sweep takes it."""

    __tablename__ = "blob_holds"
    __table_args__ = ({"sqlite_autoincrement": True},)

    number: Mapped[int] = mapped_column(primary_key=True)
    owner: Mapped[str] = mapped_column(
        String(32), ForeignKey("blob_owners.id", ondelete="CASCADE"), index=True
    )
    keeping: Mapped[str] = mapped_column(String(32), index=True)
    digest: Mapped[str] = mapped_column(String(64), index=True)


class BlobIdentityRow(Base):
    """The one store of blobs that belongs to this database: what it is called, and where it is."""

    __tablename__ = "blob_identity"
    __table_args__ = (CheckConstraint("number = 1", name="number"),)

    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    identity: Mapped[str] = mapped_column(String(32))
    place: Mapped[str]
