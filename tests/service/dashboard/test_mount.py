"""The pages begin beside threads that are at work already."""

from __future__ import annotations

import gc
from collections.abc import Callable
from pathlib import Path

import httpx
import pytest

from service.app import create_app
from service.settings import Settings
from tests.service.routes.serving import listening


def test_they_begin_without_a_hold_on_every_object(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A cleaner that was at work then met "bad argument to internal function", or an engine "cannot
    commit transaction", for an hour."""
    looked: list[int] = []
    every: Callable[..., list[object]] = gc.get_objects
    monkeypatch.setattr(gc, "get_objects", lambda *told: looked.append(1) or every(*told))
    settings = Settings(data=tmp_path / "data", workers=1, min_free=0)
    with listening(create_app(settings)) as address:
        assert httpx.get(address, timeout=30.0).is_success
    assert looked == []
