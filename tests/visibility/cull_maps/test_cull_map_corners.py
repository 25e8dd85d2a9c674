"""Scenes built against an erosion that is a pixel short across the edge that a sample stands for.

A sample looks along an edge of the cell rather than away from it, past the corner of a block, at a
post of a fiftieth of a pixel.  The true line passes a hair beside that corner.  The only ray to the
post's pixel ends at the other side of it, so that it passes up to a pixel further in, and the last
column of the block must not hide.  The block keeps samples further back on the edge from seeing the
post, and a second one at the cell those further ahead.  Both end a hair past borders of pixels,
since a pixel is solid only where all of it is covered.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from bench.visibility_city import scene_of_boxes
from simplifier.geometry.view_cells import ViewCells
from simplifier.visibility.cull_maps import cull_map
from simplifier.visibility.cull_maps.cull_map import CullMaps, see_by_cull_maps
from simplifier.visibility.cull_maps.erosion import Window
from simplifier.visibility.solid.height_field import height_field
from tests.visibility.cull_maps.test_cull_map import proven
from tests.visibility.solid.test_height_field import upright

HAIR = 0.01


def past_a_corner(half, seed, turned):
    """A scene of pixels of 1 m with the post as its last object, the cell, and who sees the post.

    ``half`` pixels to both sides are what a sample stands for.  Two scenes with one seed differ by
    which axis is which.
    """
    random = np.random.default_rng(seed)
    side, tall = random.uniform(0.0, 1.0), 16.0 * half
    top = tall + random.uniform(0.0, 1.0)
    along, share = random.uniform(190.0, 246.0), random.uniform(0.75, 0.96)
    # How far a line leads aside a pixel: with more, it leaves the column next to the corner
    # before it is past what the block is eroded by along the edge.
    slant = random.uniform(0.3, 0.8) if half == 1 else random.uniform(0.27, 0.855) / half
    begin = random.uniform(0.35, 0.65) * tall
    # The post stands where its pixel begins across, and ends along the edge.
    post = np.add(np.floor([side + slant * along, begin + along]), [0.05, 0.95])
    end = math.floor(begin + share * along)
    corner = math.floor(post[0] - slant * (post[1] - end))
    slant = (post[0] - corner + 2.0 * HAIR) / (post[1] - end)
    viewer = [side, post[1] - (post[0] - side) / slant, 2.0]
    near = math.ceil(top + 0.1)
    while near <= top + 6.0 and not HAIR < (post[0] - slant * (post[1] - near)) % 1.0 < 0.16:
        near += 1
    last = math.floor(post[0] - slant * (post[1] - near) - HAIR)
    around, hair = 0.01, 0.5 * HAIR
    boxes = np.array([
        [(-100.0, -100.0, 0.0), (-99.0, -99.0, 0.1)],  # the raster's pixels begin at whole metres
        [(-80.0, near - hair, 0.0), (last + hair, near + 40.0, 20.0)],
        [(corner - hair, end - 30.0, 0.0), (corner + 120.0, end + hair, 20.0)],
        [(*(post - around), 0.0), (*(post + around), 9.0)],
    ])  # fmt: skip
    corners = np.array([[[side - 2.0, top - tall, 0.0], [side, top, 2.0]], [viewer, viewer]])
    if turned:
        boxes, corners = boxes[..., [1, 0, 2]], corners[..., [1, 0, 2]]
    cell = ViewCells.boxes(corners[0, :1], corners[0, 1:])
    return scene_of_boxes(boxes, ["stone", "near", "corner", "post"]), cell, corners[1, :1]


def short_across(monkeypatch):
    """Erode by no pixel across edges."""
    windows = cull_map._by_window

    def shorter(maps, kinds):
        for _, chosen in windows(maps, kinds):
            pixels, axis = divmod(int(kinds[chosen[0]]), 2)
            yield (Window.box(0, pixels) if axis else Window.box(pixels, 0)), chosen

    monkeypatch.setattr(cull_map, "_by_window", shorter)


def sees_the_post(scene, cell, half):
    around = np.array([cell.low[0, :2], cell.high[0, :2]])
    maps = CullMaps(height_field(upright(scene), 1.0, around), 2.0 * half)
    return see_by_cull_maps(maps, cell)[0][0, -1]


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(("half", "seed"), [(1, 45), (1, 53), (2, 53), (5, 84)])
def test_what_shows_past_a_corner_is_in_the_set_and_no_pixel_less_will_do(
    monkeypatch, half, seed, turned
):
    """Of 390 scenes these are those in which no other sample makes up for what is missing."""
    scene, cell, viewer = past_a_corner(half, seed, turned)
    assert proven(scene, viewer, 2000)[-1]
    assert sees_the_post(scene, cell, half)
    short_across(monkeypatch)
    assert not sees_the_post(scene, cell, half)
