"""Mistakes in cull maps, and scenes that are built against each: random views of a city find none.

Each scene is judged as any other is: a thousand viewpoints in the cell, which look past corners.
From the very same viewpoints the sets of the code as it is have no leak.  Pixels are of 1 m.  An
erosion that is short across edges has its scenes in ``test_cull_map_corners.py``: what it hides
shows from so little of an edge that a viewpoint must be put there.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from simplifier.errors import BackendUnavailableError
from simplifier.geometry.view_cells import ViewCells
from simplifier.kernels import cull_map as kernels
from simplifier.visibility.checking.check import CheckOptions, check_pvs
from simplifier.visibility.cull_maps import cull_map, umbra_buffer
from simplifier.visibility.cull_maps.cull_map import CullMaps, see_by_cull_maps
from simplifier.visibility.cull_maps.cull_map_gl import OpenGLCullMaps
from simplifier.visibility.cull_maps.erosion import Window
from simplifier.visibility.solid.height_field import height_field
from tests.visibility.checking.test_check import pvs_of
from tests.visibility.scenes import puzzle
from tests.visibility.solid.test_height_field import upright

pytestmark = pytest.mark.slow  # tests of the tests: what they would miss

VIEWS = 1000


@dataclass(frozen=True)
class Trap:
    """A scene and its cell, for pieces of edge of ``half`` pixels to both sides.

    ``boxes``  by name the ranges of x and y, and the height.
    ``stone``  where the raster's pixels begin, which are then at whole metres.
    """

    boxes: dict[str, tuple[tuple[float, float], tuple[float, float], float]]
    low: tuple[float, float]
    high: tuple[float, float]
    half: float
    stone: float = -150.0

    def turned(self, turns: int) -> Trap:
        """By so many right angles about the vertical axis."""
        trap = self
        for _ in range(turns):
            boxes = {name: ((-y1, -y0), x, top) for name, (x, (y0, y1), top) in trap.boxes.items()}
            (x0, y0), (x1, y1) = trap.low, trap.high
            trap = Trap(boxes, (-y1, x0), (-y0, x1), trap.half, trap.stone)
        return trap

    def scene(self):
        at = self.stone, self.stone + 1.0
        return puzzle({"stone": (at, at, 0.1), **self.boxes}).scene

    def cells(self):
        return ViewCells.boxes(np.array([[*self.low, 0.0]]), np.array([[*self.high, 2.0]]))

    def maps(self):
        around = np.array([self.low, self.high])
        return CullMaps(height_field(upright(self.scene()), 1.0, around), 2.0 * self.half)


def leaks(trap, found=None):
    """The names of what the check finds missing in the cell's set, by default that of the rays."""
    if found is None:
        found, _ = see_by_cull_maps(trap.maps(), trap.cells())
    pvs = pvs_of(trap.scene(), trap.cells(), list(found))
    check = check_pvs(trap.scene(), pvs, CheckOptions(views=VIEWS))
    assert check.rows[0].seen > 1
    return {leak.name for leak in check.leaks}


def slit_between_pieces(half):
    """A slit opposite the point where two pieces of an edge meet, and a post far behind it.

    What looks straight through the slit is at the very ends of both pieces, as far from their
    samples as any of them reaches.
    """
    boxes = {
        "wall right": ((1.99, 8.01), (-70.0, 0.05), 20.0),
        "wall left": ((1.99, 8.01), (0.95, 70.0), 20.0),
        "post": ((70.1, 70.9), (0.2, 0.8), 9.0),
    }
    return Trap(boxes, (-1.0, 0.5 - 2.0 * half), (0.0, 0.5 + 2.0 * half), half)


@pytest.mark.parametrize("turns", range(4))
@pytest.mark.parametrize("half", [1, 2, 3, 5])
def test_an_erosion_one_pixel_short_along_edges_is_found(monkeypatch, half, turns):
    trap = slit_between_pieces(half).turned(turns)
    assert leaks(trap) == set()
    windows = cull_map._by_window

    def shorter(maps, kinds):
        for _, chosen in windows(maps, kinds):
            pixels, axis = divmod(int(kinds[chosen[0]]), 2)
            yield (Window.box(1, pixels - 1) if axis else Window.box(pixels - 1, 1)), chosen

    monkeypatch.setattr(cull_map, "_by_window", shorter)
    assert leaks(trap) == {"post"}


def step_from_the_back(side):
    """A post that one piece alone of the far edge sees: through a slit, and over a step.

    From the near edge the step hides it, as it is seen more steeply; past the slit no other piece
    looks, ``side`` -1 or 1 being that of the piece.
    """
    middle = 0.5 + 5.0 * side
    boxes = {
        "wall right": ((8.0, 28.0), (-70.0, middle - 0.45), 60.0),
        "wall left": ((8.0, 28.0), (middle + 0.45, 70.0), 60.0),
        "step": ((30.0, 50.0), (-70.0, 70.0), 5.0),
        "post": ((120.1, 120.9), (middle - 0.3, middle + 0.3), 12.0),
    }
    return Trap(boxes, (-20.0, -9.5), (0.0, 10.5), 5.0)


@pytest.mark.parametrize("turns", range(4))
@pytest.mark.parametrize("side", [-1, 1])
def test_a_sample_that_is_left_out_is_found_whichever_it_is(monkeypatch, side, turns):
    trap = step_from_the_back(side).turned(turns)
    assert leaks(trap) == set()
    back = Trap({}, (-20.0, 0.5 + 5.0 * side), (-20.0, 0.5 + 5.0 * side), 5.0).turned(turns)
    samples = cull_map._samples

    def fewer(maps, *given):
        rows, kinds, free = samples(maps, *given)
        assert len(rows) == 8
        there = maps.field.low + maps.field.cell * rows[:, :2]
        kept = np.abs(there - back.low).max(axis=1) > 1e-6
        assert kept.sum() == 7
        return rows[kept], kinds[kept], free

    monkeypatch.setattr(cull_map, "_samples", fewer)
    assert leaks(trap) == {"post"}


RING = 32  # of plain rays, which are slow: the scenes below are no larger
COMPILERS = "from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel\n"
PLAIN = """
inline_kernel = inner_kernel = lambda function: function
kernel = lambda takes: inner_kernel
"""


def plain_kernels(before="", after=""):
    """``see_from_cells`` in plain Python, with one mistake: ``after`` in place of ``before``."""
    source = Path(kernels.__file__).read_text()
    changes = {
        COMPILERS: PLAIN,
        f"FIRST_RING = {kernels.FIRST_RING}": f"FIRST_RING = {RING}",
        **({before: after} if before else {}),
    }
    for old, new in changes.items():
        assert source.count(old) == 1, f"{old!r} is to be found once"
        source = source.replace(old, new)
    names = {"__name__": "plain_cull_map"}
    exec(compile(source, kernels.__file__, "exec"), names)
    return names["see_from_cells"]


DOT = (0.4, 0.4), (0.6, 0.6)
"""A cell whose samples are all in the middle of one pixel."""


def past_empty_squares():
    """Posts behind empty squares: whichever way they are turned, one is the first in its own."""
    boxes = {
        f"post {index}": ((x + 0.4, x + 0.6), (y + 0.4, y + 0.6), 9.0)
        for index, (x, y) in enumerate([(11.0, -4.0), (13.0, 6.0)])
    }
    return Trap(boxes, *DOT, 1.0, stone=-20.0)


def at_arms_length():
    """A post in the pixel beside that of the cell, and a house all around."""
    around = {"house": ((9.0, 14.0), (-9.0, 9.0), 12.0)}
    return Trap({"post": ((1.4, 1.6), (0.4, 0.6), 1.0), **around}, *DOT, 1.0, stone=-20.0)


def two_in_a_pixel():
    """A post against the front of a house, in whose pixels the post is the first object."""
    boxes = {
        "post": ((12.1, 12.2), (0.4, 0.6), 9.0),
        "house": ((12.2, 16.0), (-4.0, 4.0), 9.0),
    }
    return Trap(boxes, *DOT, 1.0, stone=-20.0)


def between_two_rays():
    """A post that one ray of two alone comes to."""
    return Trap({"post": ((28.4, 28.6), (1.4, 1.6), 9.0)}, *DOT, 1.0, stone=-20.0)


PIXELS = {
    "the one after a square that is crossed": (
        "            step += left\n", "            step += left + 1\n", past_empty_squares,
    ),
    "the first": ("    step = took = 0\n", "    step = took = 1\n", at_arms_length),
    "for its first object": (
        "        for item in range(starts[place], starts[place + 1]):\n            if codes",
        "        for item in range(starts[place] + 1, starts[place + 1]):\n            if codes",
        two_in_a_pixel,
    ),
    "that of every second ray": (
        "            for index in range(2 * ring + 1):\n                if count < 0",
        "            for index in range(0, 2 * ring + 1, 2):\n                if count < 0",
        between_two_rays,
    ),
}  # fmt: skip


@pytest.mark.parametrize("turns", range(4))
@pytest.mark.parametrize("pixel", PIXELS)
def test_a_pixel_that_is_not_visited_is_found(monkeypatch, pixel, turns):
    before, after, make = PIXELS[pixel]
    trap = make().turned(turns)
    assert leaks(trap) == set()
    monkeypatch.setattr(cull_map, "see_from_cells", plain_kernels())
    assert leaks(trap) == set()
    monkeypatch.setattr(cull_map, "see_from_cells", plain_kernels(before, after))
    assert any(name.startswith("post") for name in leaks(trap))


def past_an_end():
    """A post that stands beside the end of a wall, close behind it: most of the cell sees it."""
    boxes = {
        "wall": ((1.99, 8.01), (-70.0, 1.01), 20.0),
        "post": ((8.3, 8.8), (1.2, 1.6), 9.0),
    }
    return Trap(boxes, (-1.0, -0.5), (0.0, 1.5), 1.0)


@pytest.mark.parametrize(("turns", "end"), [(0, "line.z + "), (2, "line.y - ")])
def test_a_drawn_shadow_three_pixels_too_wide_at_one_end_is_found(monkeypatch, turns, end):
    trap = past_an_end().turned(turns)
    assert leaks(trap, drawn(trap)) == set()
    wider = umbra_buffer._SHADOW_VERTEX.replace(" * across;", " * 4.0 * across;")
    too_wide = umbra_buffer._SHADOW_FRAGMENT.replace(f"{end}0.0625", f"{end}3.0")
    assert wider != umbra_buffer._SHADOW_VERTEX
    assert too_wide != umbra_buffer._SHADOW_FRAGMENT
    monkeypatch.setattr(umbra_buffer, "_SHADOW_VERTEX", wider)
    assert leaks(trap, drawn(trap)) == set()  # the rasterizer only proposes pixels
    monkeypatch.setattr(umbra_buffer, "_SHADOW_FRAGMENT", too_wide)
    assert leaks(trap, drawn(trap)) == {"post"}


def drawn(trap):
    try:
        with OpenGLCullMaps(trap.maps()) as maps:
            return maps.see(trap.cells())[0]
    except BackendUnavailableError as error:
        pytest.skip(str(error))
