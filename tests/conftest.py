"""Fixtures that all tests share: where the real assets are, and a skip that says why."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

ASSETS = Path(os.environ.get("OCCLUDER_ASSETS", Path(__file__).parents[2] / "shared" / "assets"))


@pytest.fixture(scope="session")
def asset() -> Callable[[str], Path]:
    """``asset("bunny_4968.ply")``: the path of a real mesh, or a skip where it is absent."""

    def find(name: str) -> Path:
        path = ASSETS / name
        if not path.exists():
            pytest.skip(f"{name} is not there (set OCCLUDER_ASSETS to the folder of real meshes)")
        return path

    return find
