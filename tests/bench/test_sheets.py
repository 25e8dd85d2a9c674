"""The sheets of the table."""

from __future__ import annotations

import numpy as np
import pytest

from bench.sheets import kind_of, noise, sheets
from simplifier.kernels.thin import border_places


def test_every_sheet_is_open_and_the_noise_is_as_high_as_said():
    made = {name: mesh for name, mesh in sheets() if mesh is not None}
    assert len(made) >= 17
    for mesh in made.values():
        assert border_places(mesh.faces, len(mesh.vertices)).any()
    height = np.ptp(noise(1, 40, 2.5).vertices[:, 2])
    assert height == pytest.approx(6.0)
    assert {kind_of(name) for name in made} == {"terrains", "others", "grounds"}
