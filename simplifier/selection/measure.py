"""The total occlusion measure (section 3 of the paper), exact and as bits.

The measure of a direction is the integral over the projected shape of the distance to its boundary
(equation 3), which equals the integral over r of the area left after erosion by a disc of radius r
(equation 1).  The *exact* form sums the Euclidean distance transform of an image of any size.  The
*bit* form erodes 64 x 64 images by octagons, about a hundred times faster: searches use it, figures
and near-ties the exact one.

Solid -> projections: where the search looks from, and how its pictures are framed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from simplifier.device.device import PROCESSOR, Device
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.solid import BoolArray, Solid
from simplifier.geometry.views import (
    from_above,
    hemisphere_axes,
    hemisphere_directions,
    image_axes,
)
from simplifier.kernels.bit_image import SIZE
from simplifier.kernels.measure import distance_sum, score_each, widen_ranges
from simplifier.kernels.threads import run_chunks
from simplifier.options.stages import Options
from simplifier.progress import TellShare, silent

_PRODUCTS = 1 << 18
"""Products of numbers at once.  Of more, OpenBLAS makes a second thread work, which then waits for
the next ones at full speed, for some 20 milliseconds, on a processor that others could use."""


def directional_measures(masks: BoolArray, pixel: float = 1.0) -> FloatArray:
    """(n,) M(d) of (n, rows, columns) masks by equation (3), in cubes of the unit of ``pixel``.

    ``pixel`` is the edge of a pixel.  A disc of radius R has pi R^3 / 3, a square of side a has
    a^3 / 6.
    """
    sums = np.zeros(len(masks))

    def work(begin: int, end: int) -> None:
        for index in range(begin, end):
            sums[index] = distance_sum(masks[index])

    run_chunks(work, len(masks))
    return np.asarray(sums * pixel**3)


def bit_measure(image: NDArray[np.uint64], pixel: float = 1.0) -> float:
    """M(d) of one 64 x 64 bit image (64,) uint64 by equation (1), in cubes of ``pixel``'s unit."""
    return bit_measures(image.reshape(1, SIZE), [pixel])[0]


def bit_measures(images: NDArray[np.uint64], pixels: Sequence[float]) -> list[float]:
    """:func:`bit_measure` of each of (n, 64) images with pixels of its own size."""
    scores = np.empty(len(images), dtype=np.int64)
    score_each(images, scores)
    return [score / 2.0 * pixel**3 for score, pixel in zip(scores.tolist(), pixels, strict=True)]


def silhouettes(
    vertices: FloatArray,
    faces: IntArray,
    projections: FloatArray,
    tell: TellShare = silent,
    device: Device = PROCESSOR,
) -> NDArray[np.uint64]:
    """(views, 64) uint64 bit images of a triangle soup; ``projections`` (views, 2, 4).

    ``tell`` hears the share of the views that are drawn.
    """
    return np.ascontiguousarray(
        device.coverage_masks(vertices, faces, projections, SIZE, SIZE, tell)[:, :, 0]
    )


def fitted_projections(axes: FloatArray, points: FloatArray, half: float) -> FloatArray:
    """(views, 2, 4) affine maps that show cubes as large as 64 x 64 images with a frame allow.

    ``axes`` (views, 3, 3) rows u, v, d; ``points`` (n, 3), n >= 1, the cubes' centres and ``half``
    of their edge.  The pixel of a point p is ``A[:, :3] @ p + A[:, 3]``; the frame is one pixel
    wide.  Each view has its own scale, the same in both axes.
    """
    # (n, 2 views): the frame of each view is found from the extremes of its two columns.
    rows = axes[:, :2, :].reshape(-1, 3)
    least, most = np.full(len(rows), np.inf), np.full(len(rows), -np.inf)
    step = max(_PRODUCTS // (3 * len(rows)), 1)
    for begin in range(0, len(points), step):
        widen_ranges(points[begin : begin + step] @ rows.T, least, most)
    reach = half * np.abs(rows).sum(axis=1)
    low, high = (least - reach).reshape(-1, 2), (most + reach).reshape(-1, 2)
    scale = (SIZE - 2) / (high - low).max(axis=1)
    linear = axes[:, :2, :] * scale[:, None, None]
    offset = SIZE / 2.0 - (low + high) / 2.0 * scale[:, None]
    return np.ascontiguousarray(np.concatenate([linear, offset[:, :, None]], axis=2))


_RADIUS_VIEWS = 16


def hiding_radius(occluder: Occluder) -> float:
    """Radius of the disc that hides as much, in the mean over all directions; 0 without faces.

    From the total occlusion measure M by M = pi R^3 / 3 (section 3 of the paper).
    """
    if len(occluder.faces) == 0:
        return 0.0
    # From a corner of the box: far from the origin pictures would have no digits left.  In units of
    # a power of two near the size, which changes no bit: cubes neither vanish nor overflow then.
    low, high = occluder.vertices.min(axis=0), occluder.vertices.max(axis=0)
    _, exponent = np.frexp((high - low).max())
    points = np.ldexp(occluder.vertices - low, -exponent)
    projections = fitted_projections(hemisphere_axes(_RADIUS_VIEWS), points, 0.0)
    images = silhouettes(points, occluder.faces, projections)
    pixels = 1.0 / np.linalg.norm(projections[:, 0, :3], axis=1)
    measures = bit_measures(images, pixels.tolist())
    return float(np.ldexp(np.cbrt(3.0 * np.mean(measures) / np.pi), exponent))


_SEEN = 1.5  # voxels about a voxel's centre that pictures show: triangles may reach that far


def search_projections(
    solid: Solid, options: Options, count: int, margin: float = 0.0
) -> FloatArray:
    """(count, 2, 4) maps from grid space, shifted by ``margin``, to 64 x 64 pictures."""
    axes = hemisphere_axes(count)
    if options.solid.viewers == "above":
        up = "xyz".index(options.solid.up)
        axes = image_axes(from_above(hemisphere_directions(count), up))
    return fitted_projections(axes, solid.filled.column_ends + margin, _SEEN)
