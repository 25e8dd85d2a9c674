"""Links from one page of a list to the next."""

from __future__ import annotations

from urllib.parse import urlencode

from pydantic import BaseModel

LARGEST_NUMBER = 2**63 - 1
"""That the database can hold."""


def next_page(path: str, wanted: BaseModel, cursor: int | str | None) -> str | None:
    """The same list from a cursor on; None where it ends."""
    if cursor is None:
        return None
    asked = wanted.model_dump(mode="json", exclude_unset=True)
    return f"{path}?{urlencode({**asked, 'cursor': cursor}, doseq=True)}"
