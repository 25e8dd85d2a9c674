"""Which lines of the library a case reaches: what reaches a new one is worth changing further."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

import simplifier

_READERS = tuple(
    str(Path(simplifier.__file__).parent / name) for name in ("io", "hierarchy", "geometry")
)
"""Where inputs are read; to watch all of the library would take five times as long."""

Line = tuple[str, int]


@contextmanager
def recorded(reached: set[Line]) -> Iterator[None]:
    """Add every line of the readers that this thread runs."""
    sys.settrace(_watch_into(reached))
    try:
        yield
    finally:
        sys.settrace(None)


def _watch_into(reached: set[Line]) -> Callable[[FrameType, str, Any], Any]:
    def watch_lines(frame: FrameType, event: str, argument: Any) -> Any:
        reached.add((frame.f_code.co_filename, frame.f_lineno))
        return watch_lines

    def watch_calls(frame: FrameType, event: str, argument: Any) -> Any:
        return watch_lines if frame.f_code.co_filename.startswith(_READERS) else None

    return watch_calls
