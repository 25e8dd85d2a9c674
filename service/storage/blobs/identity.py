"""Which store of blobs belongs to a database: both are called by the same name.

A database that is served with the blobs of another would have all of them swept away, since it
names none of them, and would take all of its own for lost.  So each carries a name that was drawn
once, and servers refuse a pair of two.  A copy of a database has its name as well: whoever serves
one beside the original has to give it a copy of the blobs.
"""

from __future__ import annotations

import secrets
import socket
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.errors import SettingsError
from service.storage.blobs.tables import BlobIdentityRow
from service.storage.database import Database
from service.storage.tables import JobFileRow


class Home(Protocol):
    """Where blobs are."""

    def __str__(self) -> str:
        """For people."""

    @property
    def place(self) -> str:
        """For people on other hosts."""

    def read_identity(self) -> str | None:
        """The name that it was given; None where it has none yet."""

    def write_identity(self, identity: str) -> None: ...


@dataclass(frozen=True)
class FolderHome:
    """A folder of blobs."""

    folder: Path

    def __str__(self) -> str:
        return str(self.folder.absolute())

    @property
    def place(self) -> str:
        return f"'{self}' on {socket.gethostname()}"

    @property
    def _file(self) -> Path:
        return self.folder / "identity"

    def read_identity(self) -> str | None:
        try:
            return self._file.read_text("ascii").strip()
        except FileNotFoundError:
            return None
        except (OSError, ValueError) as error:
            raise SettingsError(
                f"'{self._file}' cannot be read ({error}); check its permissions"
            ) from error

    def write_identity(self, identity: str) -> None:
        draft = self._file.with_suffix(".tmp")
        try:
            draft.write_text(identity + "\n", "ascii")
            draft.replace(self._file)
        except OSError as error:
            raise SettingsError(
                f"'{self._file}' cannot be written ({error.strerror}); check its permissions"
            ) from error


def check_identity(
    database: Database, home: Home, *, claim: bool, may_lack: bool = False
) -> str | None:
    """Refuse blobs of another database; the name that both have.

    ``claim``     draw a name where neither has one.  Without, nothing is written: one folder has
                  both, as a server alone has them.
    ``may_lack``  whether a database whose files are elsewhere may be given new blobs, which is for
                  whoever brings the files from there.

    Of two that claim at once, the second waits for the first and is refused.  Raises
    :class:`~service.errors.SettingsError`, and what reading and writing the name raises.
    """
    known, place, found = database.again(
        lambda: _both(database, home, claim=claim, may_lack=may_lack)
    )
    if known == found:
        return known
    if known is None:
        raise SettingsError(
            f"the files in '{home}' belong to another database; put that one back or name another "
            f"place, or, if no database needs them any more, remove '{home}/identity'"
        )
    if found is None:
        raise SettingsError(
            f"the files of this database are in {place}, and '{home}' has none of them; set "
            "OCCLUDER_BLOBS to where they are, or bring them to a bucket: "
            f"occluder verify --repair --from FOLDER{_for_several(home)}"
        )
    raise SettingsError(
        f"the files of this database are in {place}, and those in '{home}' belong to another "
        "one; set OCCLUDER_BLOBS to where they are, or name the other database"
    )


def _both(
    database: Database, home: Home, *, claim: bool, may_lack: bool
) -> tuple[str | None, str, str | None]:
    """The name in the database and the place that goes with it, and the name there."""
    with database.writing() as session:
        row = session.get(BlobIdentityRow, 1)
        found = home.read_identity()
        if claim and found is None and (row is None or may_lack):
            row = _claim(session, home, row, may_lack=may_lack)
            found = row.identity
        return (None, "", found) if row is None else (row.identity, row.place, found)


def _claim(
    session: Session, home: Home, row: BlobIdentityRow | None, *, may_lack: bool
) -> BlobIdentityRow:
    """``row``  of the blobs that were the database's before, and are refused from now on."""
    if not may_lack and session.scalars(select(JobFileRow.name).limit(1)).first() is not None:
        raise SettingsError(
            f"this database names files, and '{home}' has none; set OCCLUDER_BLOBS to where "
            "they are, or bring them there: occluder verify --repair --from FOLDER"
        )
    identity = secrets.token_hex(16)
    if row is None:
        row = BlobIdentityRow(number=1, identity=identity, place=home.place)
        session.add(row)
    else:
        row.identity, row.place = identity, home.place
    session.flush()  # who does so at the same time waits here until this is committed
    home.write_identity(row.identity)
    return row


def _for_several(home: Home) -> str:
    if not isinstance(home, FolderHome):
        return ""
    return "; a folder serves one host, several need OCCLUDER_BLOBS=s3://BUCKET/PREFIX"
