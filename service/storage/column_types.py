"""How values are kept, the same in both databases.

SQLite takes any text and counts in 64 bits by itself.  PostgreSQL is told to: numbers are BIGINT,
texts are ordered byte by byte (``COLLATE "C"``), and what it cannot hold, a NUL or half of a
surrogate pair, becomes U+FFFD, in both.
"""

from __future__ import annotations

import re
from typing import Any

from sqlalchemy import JSON, BigInteger, Dialect, Integer, String, TypeDecorator
from sqlalchemy.types import TypeEngine

_UNKEPT = re.compile("[\0\ud800-\udfff]")


def kept_text(value: str) -> str:
    """The text as it is stored."""
    return _UNKEPT.sub("\ufffd", value)


class Text(TypeDecorator[str]):
    """A text, of any length unless one is given."""

    impl = String
    cache_ok = True

    def load_dialect_impl(self, dialect: Dialect) -> TypeEngine[Any]:
        length = self.impl_instance.length  # type: ignore[attr-defined]
        collation = "C" if dialect.name == "postgresql" else None
        return dialect.type_descriptor(String(length, collation=collation))

    def process_bind_param(self, value: str | None, dialect: Dialect) -> str | None:
        return None if value is None else kept_text(value)


class Document(TypeDecorator[dict[str, Any]]):
    """What JSON can hold; its keys stay in order."""

    impl = JSON
    cache_ok = True

    def __init__(self) -> None:
        super().__init__(none_as_null=True)

    def coerce_compared_value(self, op: Any, value: Any) -> Any:
        return self.impl_instance.coerce_compared_value(op, value)

    def process_bind_param(self, value: Any, dialect: Dialect) -> Any:
        return _kept(value)


def whole() -> TypeEngine[int]:
    """A whole number of 64 bits."""
    return BigInteger().with_variant(Integer(), "sqlite")


def _kept(value: Any) -> Any:
    match value:
        case str():
            return kept_text(value)
        case dict():
            return {_kept(name): _kept(one) for name, one in value.items()}
        case list() | tuple():
            return [_kept(one) for one in value]
        case _:
            return value
