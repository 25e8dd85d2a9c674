"""API keys: 256 random bits, of which only the SHA-256 is stored.

A fast hash is enough: nobody can guess 256 bits, so there is nothing for a slow one to slow down.

A key is ``occ_``, 43 random digits of base 62, and 6 digits that are the CRC-32 of what is before
them: so a scanner of secrets knows one without asking, and a slip of the hand costs no look-up.
It is the form of GitHub's tokens ("Behind GitHub's new authentication token formats", 2021).  Keys
of before have 43 characters of URL-safe base64 and no checksum, and go on.
"""

from __future__ import annotations

import hashlib
import re
import secrets
import string
import zlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from service.access.session import Session
from service.journal import COMMAND_LINE, NO_KEY, Actor

_PREFIX = "occ_"
_DIGITS = string.digits + string.ascii_uppercase + string.ascii_lowercase
_RANDOM_DIGITS = 43  # 256 bits
_CHECK_DIGITS = 6  # 62**6 is more than 2**32
_FORM = re.compile(rf"{_PREFIX}[0-9A-Za-z]{{{_RANDOM_DIGITS + _CHECK_DIGITS}}}", re.ASCII)
_OLD_FORM = re.compile(rf"{_PREFIX}[0-9A-Za-z_-]{{43}}", re.ASCII)


class Scope(StrEnum):
    """What a key allows; each further one includes those before."""

    READ = "read"
    WRITE = "write"
    ADMIN = "admin"


@dataclass(frozen=True)
class ApiKey:
    """A key as it is stored; times are Unix seconds.

    ``hint``      the beginning of the key, for people to tell keys apart.
    ``last_used`` to the minute.
    ``expires``   when it ends by itself.
    ``revoked``   when it was ended; ahead of now where another replaces it and both still count.
    ``replaces``  id of the key in whose place it was made.
    ``curates``   whether it may set thresholds and remove assets although it is no admin's: as all
                  keys to write could that were made before this was asked for.
    """

    id: str
    tenant: str
    name: str
    scope: Scope
    hint: str
    created: float
    last_used: float | None = None
    expires: float | None = None
    revoked: float | None = None
    replaces: str | None = None
    curates: bool = False

    def counts_at(self, now: float) -> bool:
        """Whether it lets anybody in."""
        return all(end is None or now < end for end in (self.expires, self.revoked))


@dataclass(frozen=True)
class Rotation:
    """A key of before, which ends, the key in its place, and that one's secret."""

    old: ApiKey
    new: ApiKey
    secret: str


@dataclass(frozen=True)
class Caller:
    """On whose behalf a request is done, and what it may do; ``curates`` as :class:`ApiKey`."""

    tenant: str
    scope: Scope
    key_id: str | None = None
    curates: bool = False

    def may(self, scope: Scope) -> bool:
        order = list(Scope)
        return order.index(self.scope) >= order.index(scope)

    @property
    def may_curate(self) -> bool:
        """Whether it may set thresholds and remove assets."""
        return self.may(Scope.ADMIN) or self.curates

    def at(self, address: str | None) -> Actor:
        """Who the journal says it was."""
        return Actor(self.key_id or NO_KEY, address)


LOCAL = Caller("local", Scope.ADMIN)
"""Whoever asks, where no keys are needed."""


def new_secret() -> str:
    """A key to be shown once."""
    return with_checksum(_PREFIX + "".join(secrets.choice(_DIGITS) for _ in range(_RANDOM_DIGITS)))


def with_checksum(text: str) -> str:
    """A text and its CRC-32, in 6 digits of base 62, the highest first."""
    rest, digits = zlib.crc32(text.encode()), ""
    for _ in range(_CHECK_DIGITS):
        rest, digit = divmod(rest, len(_DIGITS))
        digits = _DIGITS[digit] + digits
    return text + digits


def may_be_key(text: str) -> bool:
    """Whether a text has the form of a key, of today with the right checksum or of before."""
    if _FORM.fullmatch(text):
        return with_checksum(text[:-_CHECK_DIGITS]) == text
    return _OLD_FORM.fullmatch(text) is not None


def hash_of(secret: str) -> str:
    return hashlib.sha256(secret.encode()).hexdigest()


def hint_of(secret: str) -> str:
    return secret[: len(_PREFIX) + 4]


LONGEST_NAME = 100


def key_name(text: str) -> str:
    """What a key is for, for people.  Raises ValueError that says what is wrong."""
    if len(text) > LONGEST_NAME or not text.isprintable():
        raise ValueError(
            f"a name has at most {LONGEST_NAME} characters, and none that cannot be printed"
        )
    if text.isspace():
        raise ValueError("nothing of it can be seen")
    return text


LONGEST_OVERLAP = 90 * 86_400.0
"""Seconds for which a key may go on beside the one that replaces it."""


class KeyStore(Protocol):
    """API keys.  What changes them, or begins or ends a session, is in the journal.

    ``tenant``  whose keys are looked at; None for all.
    """

    def create(
        self,
        tenant: str,
        name: str,
        scope: Scope,
        *,
        expires: float | None = None,
        by: Actor = COMMAND_LINE,
    ) -> tuple[ApiKey, str]:
        """The key, and the secret that is shown this once; ``expires`` in Unix seconds.

        Raises :class:`~service.errors.InvalidOptionsError` where that is over.
        """

    def keys(self, tenant: str | None = None) -> Sequence[ApiKey]: ...

    def rotate(
        self,
        key_id: str,
        *,
        overlap: float,
        expires: float | None = None,
        tenant: str | None = None,
        by: Actor = COMMAND_LINE,
    ) -> Rotation:
        """A key in the place of that of an id or a hint, which goes on for ``overlap`` seconds.

        It may what that one may, and lives as long from now on, unless ``expires`` says otherwise.
        Raises as :meth:`create` and :meth:`revoke` do, and
        :class:`~service.errors.ConflictError` for a key that has ended or was rotated.
        """

    def revoke(self, key_id: str, *, tenant: str | None = None, by: Actor = COMMAND_LINE) -> ApiKey:
        """End the key of an id or a hint.  Raises :class:`~service.errors.NotFoundError`."""

    def find(self, secret: str) -> ApiKey | None:
        """The key of this secret, unless it has ended; noted as used, at most once a minute."""

    def key(self, key_id: str) -> ApiKey | None:
        """The key of an id, as :meth:`find` finds it: one comes by a session of it."""

    def tenants(self) -> Collection[str]: ...

    def begin_session(self, key: Caller, address: str) -> None:
        """Note that somebody signed in; with a full disk nobody is kept out, and nothing noted."""

    def end_session(self, session: Session, address: str) -> None:
        """Note that a session was signed out; those that are over by themselves are forgotten."""

    def has_ended(self, session: Session) -> bool:
        """Whether a session was signed out, wherever that was."""

    def ended_sessions(self, now: float) -> Mapping[str, float]:
        """By name, those that were signed out and not over at a time; and when they will be."""
