"""A process that tries cases, for all tests of a file."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.fuzz.watched import Watched


@pytest.fixture(scope="module")
def watched() -> Iterator[Watched]:
    with Watched() as process:
        yield process
