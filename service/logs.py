"""How this service logs: lines for people, or an object of JSON a line for what collects logs.

Whatever happens for a request, in the thread that answers it or later in the one that does its job
or tells of its end, is logged with the request's id.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from datetime import UTC, datetime
from enum import StrEnum
from typing import Any

_TEXT = "%(asctime)s %(levelname)s %(name)s: %(message)s"

_request_id: ContextVar[str | None] = ContextVar("request_id", default=None)


class LogForm(StrEnum):
    """How a line of the log is written."""

    TEXT = "text"
    JSON = "json"


def request_id() -> str | None:
    """Of the request that this is done for; None where there is none."""
    return _request_id.get()


def begin_request(name: str) -> None:
    """What this task does from here to its end is done for a request: what its server logs of a
    failure comes after the last block.
    """
    _request_id.set(name)


@contextmanager
def serving_request(name: str | None) -> Iterator[None]:
    """A block that is done for a request, in this thread or task."""
    token = _request_id.set(name)
    try:
        yield
    finally:
        _request_id.reset(token)


def log_as(form: LogForm, *, text: str = _TEXT) -> None:
    """Log on standard error from now on; ``text`` is the format of lines for people."""
    handler = logging.StreamHandler()
    handler.setFormatter(JsonLines() if form is LogForm.JSON else TextLines(text))
    handler.addFilter(_add_request)
    logging.basicConfig(handlers=[handler])


class TextLines(logging.Formatter):
    """As always, with the id of the request at the end, where the line has not told it itself."""

    def formatMessage(self, record: logging.LogRecord) -> str:
        line = super().formatMessage(record)
        name = getattr(record, "request_id", None)
        return line if name is None or f"id={name}" in line else f"{line} id={name}"


class JsonLines(logging.Formatter):
    """One object a line: ``time``, ``level``, ``logger``, ``message``, ``request_id`` where there
    is one, what the caller gave as ``fields``, and ``exception`` with its traceback.
    """

    def format(self, record: logging.LogRecord) -> str:
        told: dict[str, Any] = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
        }
        if (name := getattr(record, "request_id", None)) is not None:
            told["request_id"] = name
        told |= getattr(record, "fields", {})
        if record.exc_info:
            told["exception"] = self.formatException(record.exc_info)
        return json.dumps(told, default=str)


def _add_request(record: logging.LogRecord) -> bool:
    if not hasattr(record, "request_id"):
        record.request_id = request_id()
    return True
