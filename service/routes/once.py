"""Whatever changes something is done once under an ``Idempotency-Key``.

A route of a router with :class:`OnceRoute` has nothing to do for it: what it returns is kept, and
given again.  Uploads are too large to be compared byte by byte, and see to it themselves
(:mod:`service.routes.submission`), by the same store.
"""

from __future__ import annotations

import hashlib
import inspect
import json
from collections.abc import Callable, Mapping
from functools import wraps
from typing import Any, get_type_hints

from fastapi import Request, Response
from pydantic import BaseModel

from service.headers import idempotency_key
from service.idempotency import Answer, KeyedRequest
from service.routes.docs import IDEMPOTENCY_KEY, refusals
from service.uploads.body import SmallBodyRoute

REPLAYED = "Idempotent-Replayed"
"""The header of an answer that was given before."""

_CHANGING = {"POST", "PUT", "PATCH", "DELETE"}
_WRAPPED = "done_once"

Endpoint = Callable[..., Any]


class OnceRoute(SmallBodyRoute):
    """A route whose function takes ``services`` and ``caller``, and returns a model or nothing.

    The function is called in a thread, within one transaction, if it changes something and the
    request has a key.
    """

    def __init__(self, path: str, endpoint: Endpoint, **options: Any) -> None:
        # A router that takes in another makes its routes anew, of functions that are wrapped.
        if _CHANGING & set(options.get("methods") or ()) and not hasattr(endpoint, _WRAPPED):
            endpoint = _done_once(endpoint, options.get("status_code") or 200)
            extra = dict(options.get("openapi_extra") or {})
            extra["parameters"] = [*extra.get("parameters", ()), IDEMPOTENCY_KEY]
            responses = {**(options.get("responses") or {}), **refusals(409)}
            options |= {"openapi_extra": extra, "responses": responses}
        super().__init__(path, endpoint, **options)


def kept_response(answer: Answer) -> Response:
    """An answer as it was given before, and told to be that."""
    return _response(answer, {REPLAYED: "true"})


def _response(answer: Answer, more: Mapping[str, str]) -> Response:
    return Response(answer.body, answer.status, {**answer.headers, **more})


def _done_once(endpoint: Endpoint, status: int) -> Endpoint:
    """A function with the signature of another, and the request and response beside."""
    signature = inspect.signature(endpoint)
    hints = get_type_hints(endpoint, include_extras=True)
    wanted = [one.replace(annotation=hints[one.name]) for one in signature.parameters.values()]
    added = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, annotation=kind)
        for name, kind in (("request", Request), ("response", Response))
        if name not in signature.parameters
    ]

    @wraps(endpoint)
    def run(**given: Any) -> Any:
        values = {name: given[name] for name in signature.parameters}
        request, services, caller = given["request"], given["services"], given["caller"]
        key = idempotency_key(request.headers)
        if key is None:
            return endpoint(**values)
        shown: list[Answer] = []

        def work() -> Answer:
            shown.clear()  # of a try that the database has undone
            result = endpoint(**values)
            shown.append(_answer_of(result, given["response"], status))
            to_keep = getattr(result, "to_keep", None)
            return _answer_of(to_keep(), given["response"], status) if to_keep else shown[0]

        keyed = KeyedRequest(caller.tenant, key, _fingerprint(request))
        kept, replayed = services.answers.once(keyed, work)
        return kept_response(kept) if replayed else _response(shown[0], {})

    returned = None if hints["return"] is type(None) else hints["return"]
    run.__signature__ = signature.replace(  # type: ignore[attr-defined]
        parameters=[*wanted, *added], return_annotation=returned
    )
    setattr(run, _WRAPPED, True)
    return run


def _answer_of(result: BaseModel | None, response: Response, status: int) -> Answer:
    headers = dict(response.headers)
    if result is None:
        return Answer(response.status_code or status, headers)
    headers["Content-Type"] = "application/json"
    return Answer(response.status_code or status, headers, result.model_dump_json().encode())


def _fingerprint(request: Request) -> str:
    asked = [request.method, request.url.path, request.url.query, request.state.body_digest]
    return hashlib.sha256(json.dumps(asked).encode()).hexdigest()
