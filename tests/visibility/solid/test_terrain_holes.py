"""Samples that are missing: no kernel of any method that serves a terrain ever sees one."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.camera_paths.columns import UprightScene
from simplifier.kernels.compiled.kernel import Kernel
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.checking.check import CheckOptions, check_pvs
from simplifier.visibility.columns import horizons, sweep_posts
from simplifier.visibility.cull_maps import cull_map
from simplifier.visibility.find import find_pvs
from simplifier.visibility.placing import terrain_cells
from simplifier.visibility.solid import terrain as terrain_module
from tests.visibility.solid.test_terrain import terrain_of

MODULES = (cull_map, horizons, sweep_posts, terrain_cells, terrain_module)


def arrays_in(given):
    """The tables of numbers with a point among the arguments, also in tuples.

    Arrays of one axis are left out: scratch, which holds whatever was there before.
    """
    for one in given:
        if isinstance(one, tuple):
            yield from arrays_in(one)
        elif isinstance(one, np.ndarray) and one.dtype.kind == "f" and one.ndim > 1:
            yield one


@pytest.mark.parametrize("method", ["cull-map", "voxel-column"])
def test_no_kernel_is_given_a_sample_that_is_missing(monkeypatch, method):
    called = set()

    def watched(kernel):
        def call(*given):
            for array in arrays_in(given):
                assert not np.isnan(array).any(), kernel.__name__
            called.add(kernel.__name__)
            return kernel(*given)

        return call

    for module in MODULES:
        for name, value in vars(module).copy().items():
            if isinstance(value, Kernel):
                monkeypatch.setattr(module, name, watched(value))
    x, y = np.meshgrid(np.arange(17.0), np.arange(17.0))
    heights = 12.0 * np.sin(0.5 * x + 0.2 * y)
    heights[3:5, 6], heights[12, 0] = np.nan, np.nan
    terrain = terrain_of(heights, (10.0, 10.0), 4)
    upright = UprightScene.of(terrain.scene, "z")
    options = PvsOptions(up="z", method=method, cell_size=40.0, epsilon=10.0)
    cells = terrain_cells.place_on_terrain(terrain, upright, "grid", options)
    found = find_pvs(upright, cells, options, terrain=terrain)
    assert len(called) >= 2
    holed = [index for index, hole in enumerate(terrain.holed) if hole]
    assert len(holed) >= 2
    for cell in range(len(found.pvs.cells)):
        assert found.pvs.visible(cell)[holed].all()
    check = check_pvs(upright.scene, found.pvs, CheckOptions(cells=8, views=20), terrain=terrain)
    assert not check.leaks
