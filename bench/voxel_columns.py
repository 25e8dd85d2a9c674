"""Voxel columns as published, which are not conservative: lines between samples.

Zaugg and Egbert, *Voxel Column Culling: Occlusion Culling for Large Terrain Models* (2001), section
4.  A tile is visible from a voxel if one line of sight from the edges of its top face to a post of
the tile is free, looked for by ever finer samples of both.  A line is a Bresenham line over whole
posts, in integers: what is between two posts it never sees.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.kernels.compiled.kernel import inner_kernel
from simplifier.kernels.threads import run_chunks
from simplifier.visibility.columns.sweep_posts import SweepPosts


@inner_kernel
def line_of_sight(heights, x0, y0, z0, x1, y1, z1):
    """Whether an integer line between two points is nowhere below the posts (section 4.2)."""
    dx, dy, dz = abs(x1 - x0), abs(y1 - y0), abs(z1 - z0)
    steps = max(dx, dy)
    sx, sy, sz = 1 if x1 > x0 else -1, 1 if y1 > y0 else -1, 1 if z1 > z0 else -1
    x, y, z = x0, y0, z0
    ex = ey = ez = steps // 2
    for _ in range(steps + 1):
        if z < heights[x, y]:
            return False
        ex, ey, ez = ex + dx, ey + dy, ez + dz
        if ex >= steps:
            ex -= steps
            x += sx
        if ey >= steps:
            ey -= steps
            y += sy
        if steps > 0:
            z += sz * (ez // steps)
            ez %= steps
    return True


@inner_kernel
def voxel_sees(heights, voxel, top, tile, first, last):
    """Whether a line is free from the edges of a voxel's top to a tile, sampled by ``first`` posts,
    then by half as many, down to ``last``; both plans are x0, x1, y0, y1.
    """
    step = first
    while step >= last:
        for x in range(voxel[0], voxel[1] + 1, step):
            for y in range(voxel[2], voxel[3] + 1, step):
                inner = voxel[0] < x < voxel[1] and voxel[2] < y < voxel[3]
                if inner or top < heights[x, y]:
                    continue
                for u in range(tile[0], tile[1] + 1, step):
                    for v in range(tile[2], tile[3] + 1, step):
                        if line_of_sight(heights, x, y, top, u, v, heights[u, v]):
                            return True
        step //= 2
    return False


@inner_kernel
def see_columns(heights, plans, tops, begin, end, first, last, visible):
    """Fill ``visible`` (c, n, v) of the columns ``begin`` to ``end``: voxels from top to bottom,
    and none below the first that does not see a tile (section 4.1).  ``tops`` (c, v) descend.
    """
    for column in range(begin, end):
        for tile in range(len(plans)):
            for voxel in range(tops.shape[1]):
                own = column == tile
                if not own and not voxel_sees(
                    heights, plans[column], tops[column, voxel], plans[tile], first, last
                ):
                    break
                visible[column, tile, voxel] = True


def published_sets(
    posts: SweepPosts, tops: NDArray[np.int64], columns: NDArray[np.int64], last: int = 1
) -> NDArray[np.bool_]:
    """(c, n, v) whether the published form says that voxels with these tops see each tile.

    ``posts``    heights are rounded to whole units; tiles are counted by :func:`plans_of`.
    ``tops``     (n, v) int64 of the voxels of each column, from above.
    ``columns``  (c,) int64 those that are looked from.
    ``last``     the finest step, posts.
    """
    heights = np.ascontiguousarray(np.rint(posts.heights), dtype=np.int64)
    plans = plans_of(posts)
    visible = np.zeros((len(plans), len(plans), tops.shape[1]), dtype=np.bool_)
    first = 1 << int(np.log2((plans[:, 1] - plans[:, 0]).max()))

    def work(begin: int, end: int) -> None:
        for column in columns[begin:end].tolist():
            see_columns(heights, plans, tops, column, column + 1, first, last, visible)

    run_chunks(work, len(columns), chunks_per_thread=16)
    return visible[columns]


def plans_of(posts: SweepPosts) -> NDArray[np.int64]:
    """(n, 4) x0, x1, y0, y1 of all tiles, in posts from the south-west; by column, then by row."""
    return np.array([
        (x0, x1, y0, y1)
        for x0, x1 in zip(posts.x.ends[:-1], posts.x.ends[1:], strict=True)
        for y0, y1 in zip(posts.y.ends[:-1], posts.y.ends[1:], strict=True)
    ], dtype=np.int64)  # fmt: skip
