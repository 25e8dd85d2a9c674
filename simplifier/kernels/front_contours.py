"""Fronts of a fine mesh: of most of its triangles one look tells whether they settle their pixels.

The same counts as triangle by triangle (:mod:`simplifier.kernels.front`).  Triangles before the
occluder's limits are *near*, those behind are *far*, and most are one or the other
(:mod:`simplifier.kernels.clusters`).  Near ones settle whatever pixel they cover, so their
silhouette is all that is needed of them, and that comes of its contour
(:mod:`simplifier.kernels.contours`).  Far ones settle nothing.  The few that are left are drawn,
and only where pixels still wait.

What faces the viewer lies before what faces away.  So all of that is done for the triangles that
face the viewer, and of the others those that are not far are drawn where pixels still wait: where
the occluder stands before the mesh, and few are left there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.kernels.bit_image import lowest_one
from simplifier.kernels.clusters import (
    CLUSTER,
    block_limits,
    cluster_pixels,
    fill_blocks,
    fill_clusters,
    fill_map,
    sort_clusters,
    sort_triangles,
)
from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel
from simplifier.kernels.contours import (
    LEAST_LENGTH,
    EdgeTable,
    contour_lists,
    draw_contour,
    fill_sides,
    sight_axes,
    transpose,
)
from simplifier.kernels.coverage import MaskArray, views_at_a_time
from simplifier.kernels.faces import columns_of_word, lies_between, project
from simplifier.kernels.front import (
    count_waiting,
    draw_nearest,
    empty_spans,
    settle_face,
    settle_others,
)
from simplifier.kernels.threads import run_chunks


def count_front_by_contours(
    table: EdgeTable,
    shown: MaskArray,
    others: tuple[NDArray[np.float64], NDArray[np.int32]],
    views: NDArray[np.float64],
    image: int,
    threshold: float,
    pixels: NDArray[np.int64],
) -> None:
    """Fill ``pixels`` (V, 2) as :func:`~simplifier.kernels.front.count_front` does.

    ``table``   of the mesh; ``shown`` (V, rows, words) its silhouettes.
    ``others``  vertices (3, n) and faces (m, 3) of the occluder.
    """
    low, high = table.vertices.min(axis=0), table.vertices.max(axis=0)
    ball = np.append(0.5 * (low + high), 0.5 * np.linalg.norm(high - low))
    clusters = -(-len(table.faces) // CLUSTER)
    corners = np.empty((clusters, 9 * CLUSTER), dtype=np.float32)
    boxes = np.empty((-(-clusters // 64), 6 * 64), dtype=np.float32)
    moments = np.empty((4, 3))
    fill_clusters(table.vertices, table.faces, ball, corners, boxes, moments)
    axes = sight_axes(views[:, :2])
    turned = _turned(moments, axes, views[:, 2, :3])
    batch = views_at_a_time(len(views))
    run_chunks(
        lambda begin, end: count_fronts(
            table.vertices, table.faces, table.edges, table.planes, corners, boxes, axes, turned,
            *others, views, ball, image, threshold, batch, begin * batch,
            min(end * batch, len(views)), shown, pixels,
        ),
        -(-len(views) // batch),
        chunks_per_thread=8,
    )  # fmt: skip


def _turned(
    moments: NDArray[np.float64], axes: NDArray[np.float32], depths: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """(V,) whether triangles that are wound backwards lie nearer to the viewer: whether the sum of
    their areas, each by its distance from the far end of the ball, is larger.

    Only time depends on it.  ``depths`` (V, 3) rise away from the viewer.
    """
    away = depths / np.maximum(np.linalg.norm(depths, axis=1, keepdims=True), LEAST_LENGTH)
    near = moments[0] - away @ moments[1:]
    return np.asarray((near * axes[:, :3]).sum(axis=1) < 0.0)


@kernel(
    "float64[:, :], int32[:, :], int32[:, :], float32[:, :], float32[:, :], float32[:, :], "
    "float32[:, :], bool[:], float64[:, :], int32[:, :], float64[:, :, :], float64[:], int64, "
    "float64, int64, int64, int64, uint64[:, :, :], int64[:, :]"
)
def count_fronts(
    vertices, faces, edges, planes, corners, boxes, axes, turned, others, other_faces, projections,
    ball, image, threshold, batch, begin, end, shown, pixels,
):  # fmt: skip
    """Fill views ``begin`` to ``end`` of ``pixels``, ``batch`` views at a time, at most 64.

    ``vertices`` to ``planes``, ``axes``  as :func:`~simplifier.kernels.contours.draw_contours`
                takes them; ``corners``, ``boxes`` and ``ball`` as
                :func:`~simplifier.kernels.clusters.fill_clusters`.
    ``turned``  (V,) bool: whether triangles that are wound backwards face the viewer.
    ``shown``   (V, image, words) uint64: silhouettes of the mesh.
    """
    count, clusters, across = len(faces), len(corners), (image + 63) >> 6
    points, cells = np.empty((others.shape[1], 2)), np.empty(others.shape[1], np.uint32)
    blocks, block_steps = block_limits(image)
    kinds, mixed = np.empty(clusters, np.uint8), np.empty(clusters + 1, np.int32)
    near = np.empty((batch, (count + 63) >> 6), np.uint64)
    left = np.empty_like(near)
    facing, close = np.zeros(count + 1, np.uint64), np.zeros(count + 1, np.uint64)
    away = np.empty(clusters, np.uint64)
    limits, settled = np.empty((batch, image, image)), np.empty((batch, image, across), np.uint64)
    drawn = np.empty_like(settled)
    counts = np.zeros((image + 1, image), np.int32)
    lists, used, unsure = contour_lists(batch, image)
    maps = np.empty((batch, 3, 5), np.float32)
    for first in range(begin, end, batch):
        last = min(first + batch, end)
        views, there = projections[first:last], last - first
        fill_sides(planes, axes[first:last], facing, close)
        _choose_sides(facing, close, turned[first:last], away)
        settled[:] = 0
        for view in range(there):
            draw_nearest(
                others, other_faces, views[view], threshold, points, cells, limits[view],
                settled[view],
            )  # fmt: skip
            low, steps = fill_map(views[view], ball, maps[view])
            fill_blocks(limits[view], low, steps, blocks)
            sort_clusters(boxes, maps[view], image, block_steps, kinds)
            sort_triangles(
                corners, maps[view], image, block_steps, kinds, mixed, near[view], left[view]
            )
            pixels[first + view, 0] = settle_others(settled[view], shown[first + view])
            # At once, while the limits are at hand.
            _settle_facing(
                vertices, faces, left[view], facing, view, views[view], limits[view], settled[view]
            )
        _turn_words(near[:there], facing, close)
        unsure[:], drawn[:] = False, 0
        draw_contour(
            vertices, edges, close, views, turned[first:last], lists, used, unsure, counts, drawn
        )
        for view in range(there):
            if unsure[view]:
                _settle_facing(
                    vertices, faces, near[view], facing, view, views[view], limits[view],
                    settled[view],
                )  # fmt: skip
            else:
                settled[view] |= drawn[view]
            left[view] |= near[view]
            _settle_others(
                vertices, faces, boxes, maps[view], left[view], away, facing, view, views[view],
                limits[view], settled[view],
            )  # fmt: skip
            pixels[first + view, 1] = count_waiting(settled[view])


@inner_kernel
def _choose_sides(front, back, turned, away):
    """Leave in ``front`` the views in which a triangle faces the viewer, of ``back`` those that
    are ``turned``; fill ``away`` with the views in which one of a cluster's triangles does not."""
    flipped = np.uint64(0)
    for view in range(len(turned)):
        flipped |= np.uint64(turned[view]) << np.uint64(view)
    count = len(front) - 1
    for cluster in range(len(away)):
        away[cluster] = 0
        for face in range(CLUSTER * cluster, min(CLUSTER * (cluster + 1), count)):
            front[face] = (front[face] & ~flipped) | (back[face] & flipped)
            away[cluster] |= ~front[face]


@inner_kernel
def _turn_words(near, facing, close):
    """Fill ``close``, a word a triangle, with the views of ``facing`` in which it is near, where
    ``near`` has a word a view."""
    square = np.empty(64, np.uint64)
    for word in range(near.shape[1]):
        square[:] = 0
        for view in range(len(near)):
            square[view] = near[view, word]
        transpose(square)
        for lane in range(min(64, len(facing) - 1 - 64 * word)):
            close[64 * word + lane] = facing[64 * word + lane] & square[lane]


@inner_kernel
def _settle(vertices, faces, face, projection, own, points, cells, limits, spans, settled):
    """Add to ``settled`` what a triangle settles; ``own``, ``points`` and ``cells`` are scratch."""
    for corner in range(3):
        for axis in range(3):
            own[axis, corner] = vertices[faces[face, corner], axis]
    project(own, projection, len(limits), len(limits), points, cells)
    if not lies_between(cells[0], cells[1], cells[2]):
        settle_face(own, points, cells, projection[2], 0, 1, 2, limits, spans, settled)


@inner_kernel
def _settle_facing(vertices, faces, chosen, facing, view, projection, limits, settled):
    """Add to ``settled`` what those triangles of the bits ``chosen`` settle that face the
    viewer."""
    own, points, cells = np.empty((3, 3)), np.empty((3, 2)), np.empty(3, np.uint32)
    spans, bit = empty_spans(len(limits)), np.uint64(1) << np.uint64(view)
    for word in range(len(chosen)):
        left = chosen[word]
        while left != 0:
            lowest, place = lowest_one(left)
            left ^= lowest
            face = 64 * word + place
            if face < len(faces) and facing[face] & bit != 0:
                _settle(
                    vertices, faces, face, projection, own, points, cells, limits, spans, settled
                )


@inner_kernel
def _settle_others(
    vertices, faces, boxes, sight, chosen, away, facing, view, projection, limits, settled
):
    """Add to ``settled`` what those triangles of the bits ``chosen`` settle that do not face the
    viewer."""
    own, points, cells = np.empty((3, 3)), np.empty((3, 2)), np.empty(3, np.uint32)
    spans, bit = empty_spans(len(limits)), np.uint64(1) << np.uint64(view)
    for cluster in range(len(away)):
        left = chosen[cluster // 4] >> np.uint64(CLUSTER * (cluster % 4)) & np.uint64(0xFFFF)
        if left == 0 or away[cluster] & bit == 0:
            continue
        if not _waits(settled, cluster_pixels(boxes, cluster, sight, len(limits))):
            continue
        while left != 0:
            lowest, place = lowest_one(left)
            left ^= lowest
            face = CLUSTER * cluster + place
            if face < len(faces) and facing[face] & bit == 0:
                _settle(
                    vertices, faces, face, projection, own, points, cells, limits, spans, settled
                )


@inline_kernel
def _waits(settled, rectangle):
    """Whether a pixel of a rectangle does: nothing has settled it."""
    left, right, top, bottom = rectangle
    asked = np.uint64(0)
    for word in range(left >> 6, (right + 63) >> 6):
        span = columns_of_word(left, right, word)
        for row in range(top, bottom):
            asked |= ~settled[row, word] & span
    return asked != 0
