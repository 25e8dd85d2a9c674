"""API keys: 256 random bits, of which only the SHA-256 is stored.

A fast hash is enough: nobody can guess 256 bits, so there is nothing for a slow one to slow down.
"""

from __future__ import annotations

import hashlib
import secrets
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from service.access.session import Session

_PREFIX = "occ_"


class Scope(StrEnum):
    """What a key allows; each further one includes those before."""

    READ = "read"
    WRITE = "write"
    ADMIN = "admin"


@dataclass(frozen=True)
class ApiKey:
    """A key as it is stored; times are Unix seconds.

    ``hint`` is the beginning of the key, for people to tell keys apart.
    """

    id: str
    tenant: str
    name: str
    scope: Scope
    hint: str
    created: float
    last_used: float | None = None
    revoked: float | None = None


@dataclass(frozen=True)
class Caller:
    """On whose behalf a request is done, and what it may do."""

    tenant: str
    scope: Scope
    key_id: str | None = None

    def may(self, scope: Scope) -> bool:
        order = list(Scope)
        return order.index(self.scope) >= order.index(scope)


LOCAL = Caller("local", Scope.ADMIN)
"""Whoever asks, where no keys are needed."""


def new_secret() -> str:
    """A key to be shown once."""
    return _PREFIX + secrets.token_urlsafe(32)


def hash_of(secret: str) -> str:
    return hashlib.sha256(secret.encode()).hexdigest()


def hint_of(secret: str) -> str:
    return secret[: len(_PREFIX) + 4]


class KeyStore(Protocol):
    """API keys."""

    def create(self, tenant: str, name: str, scope: Scope) -> tuple[ApiKey, str]:
        """The key, and the secret that is shown this once."""

    def keys(self, tenant: str | None = None) -> Sequence[ApiKey]: ...

    def revoke(self, key_id: str) -> ApiKey:
        """End the key of an id or a hint.  Raises :class:`~service.errors.NotFoundError`."""

    def find(self, secret: str) -> ApiKey | None:
        """The key of this secret, unless revoked; noted as used (at most once a minute)."""

    def key(self, key_id: str) -> ApiKey | None:
        """The key of an id, unless it is revoked."""

    def tenants(self) -> Collection[str]: ...

    def end_session(self, session: Session) -> None:
        """Note that a session was signed out; those that are over by themselves are forgotten."""

    def ended_sessions(self, now: float) -> Mapping[str, float]:
        """By name, those that were signed out and not over at a time; and when they will be."""
