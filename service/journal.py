"""Who did what: the values of the journal, and what a store of it promises.

What is written down is who changed what protects others: keys, sessions, what is demanded of
assets, and what was removed.  Jobs are not in it, since their rows say all of themselves.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Protocol


class Action(StrEnum):
    """What was done; what it was done to is the id that is said with each."""

    KEY_MADE = "key-made"
    """A key."""
    KEY_ROTATED = "key-rotated"
    """The key of before; ``new`` is the one in its place, ``until`` when it ends."""
    KEY_REVOKED = "key-revoked"
    """A key."""
    SIGNED_IN = "signed-in"
    """The key of the session."""
    SIGNED_OUT = "signed-out"
    """The key of the session."""
    WEBHOOK_SECRET_SHOWN = "webhook-secret-shown"
    """The tenant."""
    WEBHOOK_SECRET_ROTATED = "webhook-secret-rotated"
    """The tenant."""
    THRESHOLDS_SET = "thresholds-set"
    """An asset, with its thresholds ``before`` and ``after``."""
    FOLDER_THRESHOLDS_SET = "folder-thresholds-set"
    """A folder by its path, empty for the project; with its thresholds ``before`` and ``after``."""
    ASSET_RENAMED = "asset-renamed"
    """An asset, with its names ``before`` and ``after``."""
    ASSET_REMOVED = "asset-removed"
    """An asset; ``goes`` is until when it can be restored, where it can."""
    ASSET_RESTORED = "asset-restored"
    """An asset."""


@dataclass(frozen=True)
class Actor:
    """Who does something.

    ``name``     the id of an API key, ``command-line``, or ``no-key`` where none was needed.
    ``address``  from which it came, if by HTTP.
    """

    name: str
    address: str | None = None


COMMAND_LINE = Actor("command-line")
"""Whoever may write to the data folder."""
NO_KEY = "no-key"


@dataclass(frozen=True)
class Entry:
    """A line of the journal.

    ``number``   rises with every entry, whatever the clock does.
    ``at``       Unix seconds.
    ``subject``  id of what it was done to.
    ``details``  what else is to be known, only what JSON can hold; never a secret.
    """

    number: int
    at: float
    tenant: str
    actor: str
    address: str | None
    action: str
    subject: str
    details: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class EntryPage:
    """Entries, newest first, and the cursor of the next page; None on the last."""

    entries: tuple[Entry, ...]
    cursor: int | None


class Journal(Protocol):
    """Entries are made in the transaction of what they tell of: there is none without the other."""

    def note(
        self,
        tenant: str,
        actor: Actor,
        action: Action,
        subject: str,
        details: Mapping[str, Any] | None = None,
    ) -> None:
        """Write down what changes nothing in the database itself."""

    def entries(
        self,
        tenant: str | None,
        *,
        since: float | None = None,
        before: int | None = None,
        limit: int = 100,
    ) -> EntryPage:
        """Entries of a tenant, or of all; ``since`` in Unix seconds, ``before`` a cursor."""

    def expire(self, before: float) -> int:
        """Forget entries of before then; how many."""
