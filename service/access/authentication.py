"""From the headers of a request to whoever sent it, and how often an address may be wrong."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from service.access.attempts import Attempts, FailedAttempts
from service.access.key import LOCAL, ApiKey, Caller, KeyStore, Scope, hash_of, hint_of, may_be_key
from service.access.session import Session, Sessions, token_in
from service.errors import ForbiddenError, TooManyAttemptsError, UnauthenticatedError

_TRUSTED_SECONDS = 1.0  # for which a revoked key may still be let in
_REMEMBERED_SECONDS = 600.0
_MOST_REMEMBERED = 4096

_SEND_A_KEY = "send 'Authorization: Bearer occ_...'; 'occluder keys create' makes a key"


@dataclass(frozen=True)
class _GoodKey:
    """A key that was good at a time of the clock."""

    caller: Caller
    at: float


class Authenticator:
    """Tells callers by their keys.  Safe from any thread; ``clock`` is monotonic, in seconds.

    A key that was good within the last second is not looked up again, so one that is revoked or
    expires ends within a second.  Unknown keys are counted by address, and by address and
    beginning.  Too many of one beginning are put off without a look-up; too many of an address are
    put off once the look-up has shown them to be unknown, so that no known key is locked out by
    others at the same address.  What has not the form of a key is refused without a look-up, and is
    no attempt.

    ``time_of_day``  Unix seconds, for the end of sessions.
    ``failures``     where unknown keys are counted; in memory if not given.
    """

    def __init__(
        self,
        keys: KeyStore,
        sessions: Sessions,
        *,
        keys_needed: bool,
        clock: Callable[[], float] = time.monotonic,
        time_of_day: Callable[[], float] = time.time,
        failures: Attempts | None = None,
    ) -> None:
        self._keys = keys
        self._sessions = sessions
        self._keys_needed = keys_needed
        self._clock = clock
        self._time_of_day = time_of_day
        self._failures = failures or FailedAttempts(clock)
        self._lock = threading.Lock()
        self._good_keys: dict[str, _GoodKey] = {}
        self._ended = dict(keys.ended_sessions(time_of_day()))  # when they would have by themselves

    def caller_at_once(self, headers: Mapping[str, str]) -> Caller | None:
        """Whoever can be told at once, without the key store; None where that has to be asked."""
        secret = _sent_key(headers)
        session = self._session(headers) if secret is None else None
        if secret is None and session is None:
            return None if self._keys_needed else LOCAL
        name = session.name if session else hash_of(secret or "")
        known = self._good_key(name)
        return known.caller if known and self._is_trusted(known) else None

    def caller(self, headers: Mapping[str, str], address: str) -> Caller:
        """Whoever sends a request from an address.  ``headers`` by their names in lower case.

        A key counts before the cookie of a session, and is judged even where none is needed.
        Raises :class:`~service.errors.UnauthenticatedError` and
        :class:`~service.errors.TooManyAttemptsError`.
        """
        secret = _sent_key(headers)
        if secret is not None:
            return self._of_key(secret, address)
        session = self._session(headers)
        caller = None if session is None else self._of_session(session)
        if caller is not None:
            return caller
        if self._keys_needed:
            raise UnauthenticatedError(_what_is_missing(headers), remedy=_SEND_A_KEY)
        return LOCAL

    def sign_in(self, secret: str, address: str) -> str:
        """The value of a session's cookie.  Raises as :meth:`caller` does."""
        caller = self._of_key(secret, address)
        assert caller.key_id is not None  # only LOCAL has none
        self._keys.begin_session(caller, address)
        return self._sessions.token(caller.key_id, self._time_of_day())

    def sign_out(self, headers: Mapping[str, str], address: str) -> None:
        """End the session of a request, if it has one, here and after any restart.

        Waits for the database.  Raises :class:`~service.errors.DiskFullError`.
        """
        session = self._session(headers)
        if session is None:
            return
        now = self._time_of_day()
        with self._lock:
            self._ended[session.name] = float(session.expires)
            for name in [name for name, expires in self._ended.items() if expires <= now]:
                del self._ended[name]
        self._keys.end_session(session, address)

    def _session(self, headers: Mapping[str, str]) -> Session | None:
        token = token_in(headers)
        session = None if token is None else self._sessions.read(token, self._time_of_day())
        if session is None:
            return None
        with self._lock:
            return None if session.name in self._ended else session

    def _of_session(self, session: Session) -> Caller | None:
        known, now = self._good_key(session.name), self._clock()
        if known is not None and self._is_trusted(known):
            return known.caller
        # It may have been signed out at another server.
        key = None if self._keys.has_ended(session) else self._keys.key(session.key_id)
        return self._judge(session.name, key, now)

    def _of_key(self, secret: str, address: str) -> Caller:
        digest = hash_of(secret)
        known, now = self._good_key(digest), self._clock()
        if known is not None and self._is_trusted(known):
            return known.caller
        if not may_be_key(secret):
            raise UnauthenticatedError(
                "what was sent is no API key: its form or its checksum is wrong",
                remedy="copy the key whole, as it was shown when it was made",
            )
        hint = hint_of(secret)
        if known is None and (wait := self._failures.seconds_to_wait(address, hint)):
            raise TooManyAttemptsError(wait)
        caller = self._judge(digest, self._keys.find(secret), now)
        if caller is None:
            wait = self._failures.seconds_to_wait(address)
            self._failures.count(address)
            self._failures.count(address, hint)
            if wait:
                raise TooManyAttemptsError(wait)
            raise UnauthenticatedError(
                "the API key is not known, was revoked or has expired",
                remedy="check the key; 'occluder keys list' shows those that there are",
            )
        return caller

    def _judge(self, name: str, key: ApiKey | None, now: float) -> Caller | None:
        """What the store says of a digest or a session, remembered by that name."""
        if key is None:
            with self._lock:
                self._good_keys.pop(name, None)
            return None
        caller = Caller(key.tenant, key.scope, key.id, key.curates)
        self._remember(name, _GoodKey(caller, now))
        return caller

    def _good_key(self, name: str) -> _GoodKey | None:
        with self._lock:
            return self._good_keys.get(name)

    def _is_trusted(self, known: _GoodKey) -> bool:
        return self._clock() - known.at <= _TRUSTED_SECONDS

    def _remember(self, name: str, known: _GoodKey) -> None:
        with self._lock:
            self._good_keys.pop(name, None)  # so that the dictionary stays in order of time
            self._good_keys[name] = known
            while len(self._good_keys) > _MOST_REMEMBERED or self._oldest_is_stale(known.at):
                del self._good_keys[next(iter(self._good_keys))]

    def _oldest_is_stale(self, now: float) -> bool:
        return now - next(iter(self._good_keys.values())).at > _REMEMBERED_SECONDS


def demand(caller: Caller, scope: Scope) -> None:
    """Raises :class:`~service.errors.ForbiddenError` where the caller's key does not reach."""
    if not caller.may(scope):
        raise ForbiddenError(
            f"the API key has the scope '{caller.scope}', and this needs '{scope}'",
            remedy=f"use a key with the scope '{scope}'",
            extra={"scope": caller.scope, "needed": scope},
        )


def demand_curator(caller: Caller) -> None:
    """As :func:`demand` for an admin's key, which sets thresholds and removes assets; some keys
    of before may that too (:class:`~service.access.key.ApiKey`)."""
    if not caller.may_curate:
        demand(caller, Scope.ADMIN)


def _sent_key(headers: Mapping[str, str]) -> str | None:
    """``X-API-Key`` counts first: a proxy may need ``Authorization`` for itself."""
    key = headers.get("x-api-key", "").strip()
    if key:
        return key
    scheme, _, token = headers.get("authorization", "").strip().partition(" ")
    return token.strip() or None if scheme.lower() == "bearer" else None


def _what_is_missing(headers: Mapping[str, str]) -> str:
    if "authorization" in headers:
        return "the Authorization header holds no 'Bearer' and a key"
    return "the request has no API key"
