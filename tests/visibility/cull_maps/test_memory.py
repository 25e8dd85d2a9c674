"""Memory of finding sets: foretold, and refused with an epsilon that fits."""

from __future__ import annotations

import re
import subprocess
import sys

import numpy as np
import pytest

from bench.visibility_city import generated_city, scene_of_boxes, street_cells
from simplifier.camera_paths.columns import UprightScene
from simplifier.errors import MemoryLimitError
from simplifier.geometry.view_cells import ViewCells
from simplifier.memory.need import BASE_BYTES
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.cull_maps.memory import check_memory, need_of_sets
from simplifier.visibility.find import find_pvs
from simplifier.visibility.placing.terrain_cells import place_on_terrain
from simplifier.visibility.solid.terrain import Terrain
from tests.allocating import most_allocated
from tests.visibility.solid.test_terrain import terrain_of


def city():
    scene = generated_city(5)
    upright = UprightScene.of(scene, "z")
    cells = street_cells(scene, 8)
    return upright, ViewCells.boxes(cells.low - upright.origin, cells.high - upright.origin), None


def terrain():
    random = np.random.default_rng(0)
    posts: Terrain = terrain_of(random.uniform(0.0, 9.0, (65, 65)), (10.0, 10.0), 8)
    upright = UprightScene.of(posts.scene, "z")
    options = PvsOptions(up="z", cell_size=10.0)
    return upright, place_on_terrain(posts, upright, "grid", options).some(np.arange(2)), posts


def test_the_arrays_of_a_terrain_take_less_than_is_foretold_and_not_much():
    (upright, cells, posts), epsilon = terrain(), 3.5
    options = PvsOptions(up="z", epsilon=epsilon)
    peak = most_allocated(lambda: find_pvs(upright, cells, options, terrain=posts))
    need = need_of_sets(upright, cells, 0.2 * epsilon, 0.2, terrain=True)
    # Libraries are no arrays, and neither is what any process takes.
    arrays = need.peak - BASE_BYTES - 60 * 2**20
    assert 0.5 * arrays < peak < arrays


FIND = """
import sys, numpy as np
from bench.point import resident_mib
from simplifier.camera_paths.columns import UprightScene
from simplifier.memory.need import MIB
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.cull_maps.memory import need_of_sets
from simplifier.visibility.find import find_pvs
from tests.visibility.cull_maps.test_memory import wide_city, eight_ways
from tests.visibility.scenes import street_cell
upright, cells = UprightScene.of(wide_city(), "z"), globals()[sys.argv[1]]()
need = need_of_sets(upright, cells, 0.28, 0.2)
find_pvs(upright, cells, PvsOptions(up="z", epsilon=1.4))
own = resident_mib("VmHWM") - resident_mib("RssFile")
print((own + float(sys.argv[2])) / (need.peak / MIB))
"""

LIBRARIES = 85.0  # MiB of their files, as Linux maps them where they were not written just now


def wide_city():
    """Few boxes, far apart: the raster is most of what is held."""
    low = np.array([(75.0 * x, 75.0 * y, 0.0) for x in range(9) for y in range(9)])
    return scene_of_boxes(np.stack([low, low + 8.0], axis=1), [f"box {i}" for i in range(len(low))])


def eight_ways():
    """Triangles whose edges lie in every sector of directions."""
    turns = 0.25 * np.pi * np.arange(2)[:, None] + np.array([0.0, 0.375, 0.75]) * np.pi
    corners = 40.0 + 8.0 * np.stack([np.cos(2.0 * turns), np.sin(2.0 * turns)], axis=2)
    return ViewCells.prisms(corners, np.zeros(2), np.full(2, 2.0))


@pytest.mark.parametrize("cells", ["street_cell", "eight_ways"])
def test_the_whole_process_takes_what_is_foretold(cells):
    """With the files of libraries as they are at most times: of one that was written just before,
    as by an installation, Linux maps more at once, and the process seems 60 MiB larger."""
    done = subprocess.run(
        [sys.executable, "-c", FIND, cells, str(LIBRARIES)],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert 0.8 < float(done.stdout) < 1.1


def test_too_much_is_refused_before_and_the_epsilon_that_is_told_fits():
    upright, cells, _ = city()
    options = PvsOptions(up="z", epsilon=0.05, memory_limit=0.4, method="cull-map")
    with pytest.raises(MemoryLimitError, match=r"and the limit is 0\.4 GiB") as caught:
        find_pvs(upright, cells, options)
    told = re.search(r"choose an epsilon of at least ([\d.]+), or set a memory", str(caught.value))
    assert told is not None
    fitting = float(told[1])
    check_memory(upright, cells, 0.2 * fitting, 0.2, 0.4)
    with pytest.raises(MemoryLimitError):
        check_memory(upright, cells, 0.16 * fitting, 0.2, 0.4)


def test_sets_alone_can_be_too_much():
    upright, cells, _ = city()
    with pytest.raises(MemoryLimitError, match="choose larger cells, or set a memory limit"):
        check_memory(upright, cells, 0.2, 0.2, 0.1)
