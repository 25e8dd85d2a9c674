"""Who may see pages, and what browsers may do with them."""

from __future__ import annotations

from urllib.parse import quote

from anyio.to_thread import run_sync
from fastapi import FastAPI
from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.answers.problems import MEDIA_TYPE, ProblemResponse, refusal_of
from service.dashboard.visitor import Visitor
from service.errors import ServiceError, UnauthenticatedError
from service.routes.services import Services

_OPEN = "/_nicegui/"
"""Scripts and styles, the same for everybody."""

_SOCKET = "/_nicegui_ws/"

_POLICY = (
    "default-src 'none'; base-uri 'none'; object-src 'none'; frame-ancestors 'none'; "
    "form-action 'self'; connect-src 'self' blob: data:; font-src 'self'; "
    "img-src 'self' blob: data:; worker-src 'self' blob:; style-src 'self' 'unsafe-inline'; "
    # NiceGUI starts its pages by a script within them, and Vue compiles templates.
    "script-src 'self' 'unsafe-inline' 'unsafe-eval'"
)
_HEADERS = {
    "Content-Security-Policy": _POLICY,
    # Without an origin, the form that ends a session would be taken for another site's.
    "Referrer-Policy": "same-origin",
}


class Gate:
    """Lets in whoever has a session or needs none; sends others to sign in.

    ``owner`` is the application whose ``state`` holds the services.
    """

    def __init__(self, pages: ASGIApp, owner: FastAPI) -> None:
        self._pages = pages
        self._owner = owner

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        send = _with_problems(send, scope["path"])
        if scope["path"].startswith(_OPEN):
            await self._pages(scope, receive, send)
            return
        services: Services = self._owner.state.services
        address = scope["client"][0] if scope.get("client") else ""
        visitor = Visitor.of(services, Headers(scope=scope), address)
        try:
            known = services.authenticator.caller_at_once(visitor.headers)
            caller = known or await run_sync(visitor.caller)
        except ServiceError as refusal:
            await _refuse(refusal, scope, receive, send)
            return
        scope.setdefault("state", {}).update(visitor=visitor, caller=caller)
        await self._pages(scope, receive, _with_policy(send))


def _with_policy(send: Send) -> Send:
    async def send_with_policy(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            if headers.get("content-type", "").startswith("text/html"):
                headers.update(_HEADERS)
        await send(message)

    return send_with_policy


def _with_problems(send: Send, path: str) -> Send:
    """What frameworks refuse in words of their own, as everything else here is refused.

    Pages that say what is wrong stay as they are.
    """
    replaced = False

    async def send_problems(message: Message) -> None:
        nonlocal replaced
        if message["type"] == "http.response.start":
            status = message["status"]
            kind = Headers(raw=message["headers"]).get("content-type", "")
            replaced = status >= 400 and not kind.startswith(("text/html", MEDIA_TYPE))
            if replaced:
                answer = ProblemResponse(refusal_of(status, path), path)
                answer.headers.update(_kept(message))
                await send({**message, "status": answer.status_code, "headers": answer.raw_headers})
                await send({"type": "http.response.body", "body": answer.body})
        if not replaced:
            await send(message)

    return send_problems


def _kept(message: Message) -> dict[str, str]:
    headers = Headers(raw=message["headers"])
    return {"Allow": headers["allow"]} if "allow" in headers else {}


async def _refuse(refusal: ServiceError, scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": 1008})
        return
    is_page = not scope["path"].startswith(_SOCKET)
    if is_page and isinstance(refusal, UnauthenticatedError):
        await RedirectResponse(sign_in_address(scope), 303)(scope, receive, send)
        return
    await ProblemResponse(refusal, scope["path"])(scope, receive, send)


def sign_in_address(scope: Scope) -> str:
    """The address of the form to sign in, which leads back here."""
    query = scope.get("query_string", b"").decode("latin-1")
    wanted = scope["path"] + (f"?{query}" if query else "")
    return f"/sign-in?next={quote(wanted, safe='')}"
