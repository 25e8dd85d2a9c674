"""Who asks, and whether they may: a dependency of every route that is not open to all."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Annotated

from anyio.to_thread import run_sync
from fastapi import Depends, Request
from fastapi.security import APIKeyHeader, HTTPBearer

from service.access.authentication import demand
from service.access.key import Caller, Scope
from service.routes.services import TheServices

_BEARER = HTTPBearer(
    auto_error=False, scheme_name="bearer", description="A key that begins with `occ_`."
)
_HEADER = APIKeyHeader(
    name="X-API-Key", auto_error=False, scheme_name="key", description="The same key."
)


def _caller_with(scope: Scope) -> Callable[..., Awaitable[Caller]]:
    async def caller(request: Request, services: TheServices) -> Caller:
        authenticator, headers = services.authenticator, request.headers
        # A thread only where the database has to be asked: status calls are many.
        one = authenticator.known(headers)
        if one is None:
            address = request.client.host if request.client else ""
            one = await run_sync(authenticator.caller, headers, address)
        request.state.caller = one  # for the log
        demand(one, scope)
        return one

    return caller


KEYED = [Depends(_BEARER), Depends(_HEADER)]
"""Says in OpenAPI that a key is needed; the callers below see to it."""

Reader = Annotated[Caller, Depends(_caller_with(Scope.READ))]
Writer = Annotated[Caller, Depends(_caller_with(Scope.WRITE))]
