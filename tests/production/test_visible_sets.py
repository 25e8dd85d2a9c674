"""Visible sets by the face: those of the steps."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import pytest

import simplifier
from bench.visibility_city import generated_city
from simplifier.camera_paths.columns import UprightScene
from simplifier.io.scene_writer import write_scene
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.find import find_pvs
from simplifier.visibility.placing.cells import place_cells


@pytest.fixture
def town(tmp_path: Path) -> Path:
    write_scene(generated_city(2), tmp_path / "town.glb")
    return tmp_path / "town.glb"


@pytest.mark.slow  # what the service's acceptance test says of the command
def test_the_sets_are_those_of_the_steps(town: Path) -> None:
    told: list[tuple[int, int]] = []
    made = simplifier.find_visible_sets(
        town, up="z", ground=True, cell_size=20.0, tell=lambda *now: told.append(now)
    )
    upright = UprightScene.of(simplifier.load_scene(town), "z")
    options = PvsOptions(up="z", ground=True, cell_size=20.0, skip_buried=True)
    pvs = find_pvs(upright, place_cells(upright, "walkable", options), options).pvs
    assert (made.pvs.rows.data, made.pvs.settings) == (pvs.rows.data, pvs.settings)
    assert np.array_equal(made.pvs.row_of, pvs.row_of)
    assert made.set_sizes().tolist() == [pvs.visible(cell).sum() for cell in range(len(pvs.cells))]
    assert made.report()["cells"] == len(pvs.cells) == told[-1][0]


def test_a_cancel_before_the_first_cell_leaves_nothing(town: Path) -> None:
    cancel = threading.Event()
    cancel.set()
    with pytest.raises(simplifier.CancelledError):
        simplifier.find_visible_sets(town, up="z", cancel=cancel)
