"""What comes along with an upload: options, asset, webhook, by query or by parts of a form."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from fastapi import Request

from service.errors import FieldError, InvalidOptionsError
from service.jobs.asset import LONGEST_NAME
from service.jobs.delivery import LONGEST_URL
from service.schemas.options import OptionTable

_LABELS = ("asset", "webhook")
_FOR_UPLOADS = "filename"


@dataclass(frozen=True)
class Form:
    """What is wanted of an upload, checked.  ``options`` are all of them, by keyword."""

    options: Mapping[str, Any]
    asset: str | None
    webhook: str | None


def read_form(request: Request, parts: Mapping[str, str], table: OptionTable) -> Form:
    """From the query and from parts of text; either may say a thing, not both.

    Raises :class:`~service.errors.InvalidOptionsError` that names each wrong field.
    """
    asked = [pair for pair in request.query_params.multi_items() if pair[0] != _FOR_UPLOADS]
    options = table.from_query(pair for pair in asked if pair[0] not in _LABELS)
    more = table.from_json(parts["options"]) if parts.get("options") else {}
    labels = [pair for pair in (*asked, *parts.items()) if pair[0] in _LABELS]
    both = [name for name in options if name in more]
    both += [name for name in _LABELS if sum(one == name for one, _ in labels) > 1]
    faults = [FieldError(name, "it is given twice", "give it once") for name in both]
    said = dict(labels)
    for name, most in zip(_LABELS, (LONGEST_NAME, LONGEST_URL), strict=True):
        if name in said and not 1 <= len(said[name]) <= most:
            remedy = f"give 1 to {most} characters, or leave it out"
            faults.append(FieldError(name, f"it has {len(said[name])} characters", remedy))
    resolved = _tried(faults, lambda: table.read({**options, **more}))
    if faults:
        raise InvalidOptionsError(faults)
    return Form(resolved, said.get("asset"), said.get("webhook"))


def _tried(faults: list[FieldError], read: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """What was read; its faults go to the others, so that all are told at once."""
    try:
        return read()
    except InvalidOptionsError as error:
        faults.extend(error.errors)
        return {}
