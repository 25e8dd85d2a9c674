"""The form that takes an API key and gives a cookie, and the way out.

A page without scripts: it is open to all, and the only one where a key is typed.
"""

from __future__ import annotations

import gzip
import re
from functools import cache
from hashlib import sha256
from html import escape
from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Form, Request
from fastapi.responses import HTMLResponse, RedirectResponse, Response

from service.access.session import COOKIE, SESSION_SECONDS
from service.errors import ServiceError, TooManyAttemptsError
from service.routes.services import TheServices, address_of
from service.uploads.body import SmallBodyRoute

STYLE = "/dashboard/style.css"

_HERE = re.compile(r"/(?![/\\])[\x21-\x5b\x5d-\x7e]*", re.ASCII)
"""A path of this service: no host, no backslash, nothing that browsers leave out."""

_HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'none'; base-uri 'none'; frame-ancestors 'none'; "
    "form-action 'self'; img-src data:; style-src 'self'",
    # Without an origin, the form would be taken for another site's.
    "Referrer-Policy": "same-origin",
}
_PAGE = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>Sign in - planar-occluder</title>
<link rel="icon" href="data:,">
<link rel="stylesheet" href="{style}">
<main class="sign-in">
<h1>Sign in</h1>
{message}
<form method="post" action="/sign-in">
<label for="key">API key</label>
<input id="key" name="key" type="password" autocomplete="current-password" spellcheck="false"
 required autofocus{described}>
<input name="next" type="hidden" value="{next}">
<button type="submit">Sign in</button>
</form>
<p class="quiet">A key begins with <code>occ_</code>. Whoever runs the service makes one:
<code>occluder keys create</code>.</p>
</main>
</html>
"""

# Nobody has shown a key yet: the form is read as any small body is, and no further.
router = APIRouter(include_in_schema=False, route_class=SmallBodyRoute)


@router.get(STYLE)
async def style(request: Request) -> Response:
    """Asked for by every page, so it is compressed once."""
    tag, plain, packed = _style()
    headers = {"Cache-Control": "no-cache", "Vary": "Accept-Encoding", "ETag": tag}
    if request.headers.get("if-none-match") == tag:
        return Response(None, 304, headers)
    if "gzip" in request.headers.get("accept-encoding", ""):
        return Response(packed, 200, {**headers, "Content-Encoding": "gzip"}, "text/css")
    return Response(plain, 200, headers, "text/css")


@cache
def _style() -> tuple[str, bytes, bytes]:
    """The style sheet: its tag, its bytes, and these compressed."""
    plain = Path(__file__).with_name("style.css").read_bytes()
    return f'"{sha256(plain).hexdigest()}"', plain, gzip.compress(plain, mtime=0)


@router.get("/sign-in")
async def sign_in_form(next: str = "/") -> HTMLResponse:
    return _form(next)


# Not async: a key is looked up in the database.
@router.post("/sign-in")
def sign_in(
    request: Request,
    services: TheServices,
    key: Annotated[str, Form(max_length=200)],
    next: Annotated[str, Form()] = "/",
) -> Response:
    """Give the cookie of a session and go on to the page that was asked for."""
    try:
        token = services.authenticator.sign_in(key.strip(), address_of(request))
    except TooManyAttemptsError as refusal:
        return _form(next, f"Too many keys were tried. {_sentence(refusal.remedy)}", refusal)
    except ServiceError as refusal:
        return _form(next, "This key is not known, was revoked or has expired.", refusal)
    answer = RedirectResponse(_within(next), 303, headers=_HEADERS)
    answer.set_cookie(
        COOKIE,
        token,
        max_age=SESSION_SECONDS,
        secure=request.url.scheme == "https" or services.settings.public_url.startswith("https:"),
        httponly=True,
        samesite="strict",
    )
    return answer


# Not async: what was signed out is noted in the database.
@router.post("/sign-out")
def sign_out(request: Request, services: TheServices) -> Response:
    """End the session: the cookie opens nothing from now on, whoever has a copy of it."""
    services.authenticator.sign_out(request.headers, address_of(request))
    answer = RedirectResponse("/sign-in", 303, headers=_HEADERS)
    answer.delete_cookie(COOKIE, httponly=True, samesite="strict")
    return answer


def _form(wanted: str, message: str = "", refusal: ServiceError | None = None) -> HTMLResponse:
    told = f'<p id="fault" class="fault" role="alert">{escape(message)}</p>' if message else ""
    page = _PAGE.format(
        style=STYLE,
        message=told,
        described=' aria-describedby="fault" aria-invalid="true"' if message else "",
        next=escape(_within(wanted)),
    )
    headers = {**_HEADERS, **(refusal.headers if refusal else {})}
    headers.pop("WWW-Authenticate", None)  # a browser would ask in its own way
    return HTMLResponse(page, refusal.status if refusal else 200, headers)


def _within(wanted: str) -> str:
    """The page to go on to, if it is one of ours."""
    return wanted if _HERE.fullmatch(wanted) else "/"


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."
