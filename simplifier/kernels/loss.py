"""Where on a mesh an occluder fails to cover it: pixels of many views, counted in cells of space.

Centres are covered as in :mod:`simplifier.kernels.coverage`, bit for bit.  A pixel that the mesh
covers belongs to the cell that holds the nearest point of the mesh there.
"""

from __future__ import annotations

from threading import Lock

import numpy as np
from numpy.typing import NDArray

from simplifier.kernels.compiled.kernel import kernel
from simplifier.kernels.coverage import drawable
from simplifier.kernels.front import draw_nearest
from simplifier.kernels.threads import run_chunks


def count_losses(
    mesh: tuple[NDArray[np.float64], NDArray[np.int32]],
    occluder: tuple[NDArray[np.float64], NDArray[np.int32]],
    projections: NDArray[np.float64],
    image: int,
    cells: int,
) -> NDArray[np.int64]:
    """(2, n, n, n) int64 by x, y and z: pixels seen, and those of them that are not covered.

    ``mesh``, ``occluder``  vertices (v, 3) and faces (m, 3) each, of a mesh within the unit sphere;
                            both windings are drawn.
    ``projections``  (V, 3, 4): a view's [x, y, depth] is A p + b with A the first three columns and
                     b the last: x and y in pixels, the depth rising away from the viewer.  The rows
                     of A are orthogonal, the third one of length 1.
    ``image``        pixels a side; what falls outside is clipped.
    ``cells``        n, along each side of the cube around the unit sphere.

    Raises ValueError as :func:`~simplifier.kernels.coverage.coverage_masks` does.
    """
    points, faces, views = drawable(*mesh, projections, (3, image, image))
    other_points, other_faces, _ = drawable(*occluder, projections, (3, image, image))
    total = np.zeros((2, cells, cells, cells), dtype=np.int64)
    lock = Lock()

    def count(begin: int, end: int) -> None:
        nonlocal total
        own = np.zeros_like(total)
        add_losses(points, faces, other_points, other_faces, views, image, begin, end, own)
        with lock:  # whole numbers: the order does not matter
            total += own

    run_chunks(count, len(views))
    return total


@kernel(
    "float64[:, :], int32[:, :], float64[:, :], int32[:, :], float64[:, :, :], int64, int64, "
    "int64, int64[:, :, :, :]"
)
def add_losses(
    vertices, faces, other_vertices, other_faces, projections, image, begin, end, counts
):
    """Add views ``begin`` to ``end`` to ``counts`` as :func:`count_losses` says.

    ``vertices``, ``other_vertices``  (3, n) float64, ``faces``, ``other_faces`` (m, 3) int32.
    """
    cells = counts.shape[1]
    most = max(vertices.shape[1], other_vertices.shape[1])
    points, corners = np.empty((most, 2)), np.empty(most, np.uint32)
    depths, spare = np.empty((image, image)), np.empty((image, image))
    words = (image + 63) >> 6
    shown, hidden = np.empty((image, words), np.uint64), np.empty((image, words), np.uint64)
    place, offset = np.empty(3), np.empty(3)
    for view in range(begin, end):
        shown[:] = 0
        hidden[:] = 0
        axes = projections[view]
        draw_nearest(other_vertices, other_faces, axes, 0.0, points, corners, spare, hidden)
        draw_nearest(vertices, faces, axes, 0.0, points, corners, depths, shown)
        # Rows of A over their squared lengths turn offsets back into points.
        across = axes[0, 0] ** 2 + axes[0, 1] ** 2 + axes[0, 2] ** 2
        upright = axes[1, 0] ** 2 + axes[1, 1] ** 2 + axes[1, 2] ** 2
        for row in range(image):
            for column in range(image):
                if not depths[row, column] < np.inf:
                    continue
                offset[0] = (column + 0.5 - axes[0, 3]) / across
                offset[1] = (row + 0.5 - axes[1, 3]) / upright
                offset[2] = depths[row, column] - axes[2, 3]
                for axis in range(3):
                    value = (
                        offset[0] * axes[0, axis]
                        + offset[1] * axes[1, axis]
                        + offset[2] * axes[2, axis]
                    )
                    place[axis] = min(max(0.5 * (value + 1.0) * cells, 0.0), cells - 1.0)
                x, y, z = np.int64(place[0]), np.int64(place[1]), np.int64(place[2])
                counts[0, x, y, z] += 1
                covered = (hidden[row, column >> 6] >> np.uint64(column & 63)) & np.uint64(1)
                if covered == 0:
                    counts[1, x, y, z] += 1
