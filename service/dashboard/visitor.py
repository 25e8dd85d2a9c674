"""On whose behalf a page acts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import cast

from nicegui import ui

from service.access.authentication import demand, demand_curator
from service.access.key import Caller, Scope
from service.routes.services import Services

_TELLING = ("authorization", "cookie", "x-api-key")


@dataclass(frozen=True)
class Visitor:
    """Whoever has a page open.

    A page outlives the request that it came by, so its handlers ask anew each time: a key may have
    been revoked meanwhile, or a session may have ended.
    """

    services: Services
    headers: Mapping[str, str]
    address: str

    @classmethod
    def of(cls, services: Services, headers: Mapping[str, str], address: str) -> Visitor:
        """``headers`` by their names in lower case."""
        kept = {name: headers[name] for name in _TELLING if name in headers}
        return cls(services, kept, address)

    def caller(self, scope: Scope = Scope.READ) -> Caller:
        """Waits for the database.  Raises :class:`~service.errors.UnauthenticatedError` and
        :class:`~service.errors.ForbiddenError`."""
        caller = self.services.authenticator.caller(self.headers, self.address)
        demand(caller, scope)
        return caller

    def curator(self) -> Caller:
        """As :meth:`caller`, for who may set thresholds and remove assets."""
        caller = self.caller()
        demand_curator(caller)
        return caller


def current_visitor() -> Visitor:
    """Whose page is being built; within a page function, before it awaits anything."""
    return cast(Visitor, ui.context.client.request.state.visitor)


def current_caller() -> Caller:
    """What :meth:`Visitor.caller` said when the page was asked for; for what a page offers."""
    return cast(Caller, ui.context.client.request.state.caller)
