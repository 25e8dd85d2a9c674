"""Headers that tell browsers to trust an answer with as little as it needs.

Reports are made from what users upload.  They are pages without scripts that carry their pictures
within; were one to hold a script after all, the sandbox takes away its right to run, and the origin
whose pages may call the service.
"""

from __future__ import annotations

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.settings import Settings

_BARE = "default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"

_OF_DATA = _BARE
_OF_REPORTS = f"{_BARE}; img-src data:; style-src 'unsafe-inline'; sandbox"
_OF_OWN_PAGES = (
    f"{_BARE}; connect-src 'self'; font-src 'self'; img-src 'self' data:; script-src 'self'; "
    "style-src 'self' 'unsafe-inline'"
)

_ALWAYS = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Permissions-Policy": "camera=(), display-capture=(), geolocation=(), microphone=(), "
    "payment=(), serial=(), usb=()",
}
_HSTS = "max-age=31536000"

_MARKUP = ("text/html", "application/xhtml+xml", "image/svg+xml", "text/xml", "application/xml")
_KEYED = "/v1/"


class SecurityHeaders:
    """Adds to every answer what its route has not set itself."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        self._always_https = settings.public_url.startswith("https://")

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        https = self._always_https or scope["scheme"] == "https"
        keyed = scope["path"].startswith(_KEYED)

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                _complete(MutableHeaders(scope=message), keyed=keyed, https=https)
            await send(message)

        await self._app(scope, receive, send_with_headers)


def _complete(headers: MutableHeaders, *, keyed: bool, https: bool) -> None:
    for name, value in _ALWAYS.items():
        headers.setdefault(name, value)
    policy = _policy(headers.get("content-type", ""), keyed=keyed)
    headers.setdefault("Content-Security-Policy", policy)
    if keyed:
        headers.setdefault("Cache-Control", "private, no-cache")
        headers.add_vary_header("Authorization, X-API-Key")
    if https:
        headers.setdefault("Strict-Transport-Security", _HSTS)


def _policy(content_type: str, *, keyed: bool) -> str:
    if content_type.partition(";")[0].strip().lower() not in _MARKUP:
        return _OF_DATA
    return _OF_REPORTS if keyed else _OF_OWN_PAGES
