"""Fixtures of the glTF tests."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from simplifier.io.load import load as load_mesh
from tests.io.builders import GltfBuilder


@pytest.fixture
def load(tmp_path: Path) -> Callable[[GltfBuilder], np.ndarray]:
    """The corners (m, 3, 3) of what a builder makes."""

    def corners(builder: GltfBuilder) -> np.ndarray:
        path = tmp_path / "scene.glb"
        path.write_bytes(builder.glb())
        mesh = load_mesh(path)
        return mesh.vertices[mesh.faces]

    return corners
