"""Rasterise a triangle soup under many orthographic views, 64 pixels a word.

Pixel (row, column) has its centre at x = column + 0.5, y = row + 0.5.  A triangle covers a centre
by half-open spans: row y belongs to a triangle when low <= y < high, and on it the columns from the
left crossing, included, to the right crossing, excluded.  Each crossing is computed from the lower
to the upper end of its edge, so two triangles that share an edge get the same bits for it: no
centre falls between them, and a closed mesh has no pinholes.  A centre nearer to an edge than
rounding (some 1e-12 pixels) may fall on either side of it, but on one side only.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from simplifier.kernels.compiled.kernel import kernel
from simplifier.kernels.faces import draw_faces, project
from simplifier.kernels.threads import run_chunks, thread_count
from simplifier.progress import TellShare, silent

if TYPE_CHECKING:
    from simplifier.kernels.contours import EdgeTable

MaskArray = NDArray[np.uint64]

LARGEST_IMAGE = 65535
"""Rows or columns: a vertex's row and column are packed into 16 bits each."""

_PLAIN: Sequence[Literal["C", "W", "A"]] = ("C", "W", "A")

_LEAST_VIEWS = 32
"""Of a pixel for each triangle, in which a mesh is drawn by its contour: so many pay for its table
of edges.  A smooth mesh has few edges in its contours and asks for ten, one of many parts for all.
More pixels make triangles dearer; of a few, most triangles lie between them."""

MOST_FACES = 1 << 21
"""Of a mesh that is: the table takes 120 bytes a triangle while it is made."""

VIEWS_AT_A_TIME = 32
"""In which contours are found together, a bit of a word each; fewer where there are more threads.
With more, limits of depth take too much memory; with fewer, more words are read."""

_LEAST_WORK = 25_000
"""Triangles, over several views, that are worth a hand-over to another thread: they take a tenth of
a millisecond."""

_PIXELS = 128
"""Of a picture that cost as much as a triangle: few triangles are large ones."""

_PIXELS_A_FACE = 32
"""At most, of a picture that is: what is counted by the pixel must not cost more than triangles."""

LARGEST_VALUE = 1e100
"""Of coordinates and projections: crossings then never overflow, so no span leaves its row."""


class Known(Protocol):
    """What was found out of a mesh that is drawn more than once.

    ``vertices`` (3, n) and ``faces`` (m, 3) are those of what is to be drawn.
    """

    def holds(self, vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> bool:
        """Whether this is the mesh, and its table of edges is there."""

    def table_of(self, vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> EdgeTable:
        """:func:`~simplifier.kernels.contours.edge_table` of it."""

    def masks_of(
        self,
        vertices: NDArray[np.float64],
        faces: NDArray[np.int32],
        projections: NDArray[np.float64],
        image: tuple[int, int],
    ) -> MaskArray | None:
        """Its silhouettes of ``image`` rows and columns, if they are known."""


def coverage_masks(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    projections: NDArray[np.float64],
    rows: int,
    columns: int,
    tell: TellShare = silent,
    known: Known | None = None,
) -> MaskArray:
    """Coverage masks: (V, rows, ceil(columns / 64)) uint64.

    ``vertices``     (n, 3), finite, below 1e100.
    ``faces``        (m, 3), m may be 0; both windings are drawn.
    ``projections``  (V, 2, 4): a view's [x, y] in pixels is A p + b with A the first three columns
                     and b the last; what falls outside of the image is clipped.
    ``tell``         hears the share of the views that are drawn.
    ``known``        of the mesh, where something is.

    Bit c % 64 of word c // 64 of a row is pixel column c; bits past the last column are 0.  Raises
    ValueError for wrong shapes, indices out of range, values that are not finite or too large,
    and images of no pixel or of more than 65535 rows or columns.
    """
    points, indices, views = drawable(vertices, faces, projections, (2, rows, columns))
    masks = np.zeros((len(views), rows, -(-columns // 64)), dtype=np.uint64)
    if len(indices) == 0:
        return masks
    there = known is not None and known.holds(points, indices)
    if by_contours(len(indices), len(views), rows * columns, there=there):
        # Here, not above: it is built on this file, and small meshes need not load it.
        from simplifier.kernels.contours import draw_by_contours, edge_table

        table = edge_table(points, indices) if known is None else known.table_of(points, indices)
        if table.pays(rows * columns):
            draw_by_contours(table, views, columns, masks, tell)
            return masks
    run_chunks(
        lambda begin, end: draw_views(points, indices, views, columns, begin, end, masks),
        len(views),
        least=-(-_LEAST_WORK // (len(indices) + rows * columns // _PIXELS)),
        chunks_per_thread=32,
        tell=tell,
    )
    return masks


def views_at_a_time(views: int) -> int:
    """In how many contours are found together, so that all threads have some."""
    return min(-(-views // thread_count()), VIEWS_AT_A_TIME)


def by_contours(faces: int, views: int, pixels: int, *, there: bool = False) -> bool:
    """Whether so many triangles are drawn by their contour, if few of their edges are listed.

    ``there``  the table of their edges is, from other pictures.
    """
    if faces > MOST_FACES or pixels > _PIXELS_A_FACE * faces:
        return False
    # The square of views by pixels a triangle.
    return there or views**2 * pixels >= _LEAST_VIEWS**2 * faces


def unpack_masks(masks: MaskArray, columns: int) -> NDArray[np.bool_]:
    """(..., rows, columns) bool from bit rows."""
    octets = np.ascontiguousarray(masks).astype("<u8", copy=False).view(np.uint8)
    return np.unpackbits(octets, axis=-1, count=columns, bitorder="little").astype(np.bool_)


def drawable(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    projections: NDArray[np.float64],
    view: tuple[int, int, int],
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.float64]]:
    """What kernels draw, as they take it: vertices (3, n), faces (m, 3), projections (V, k, 4).

    ``view``  rows of a projection, k, then rows and columns of the image.

    Raises ValueError as :func:`coverage_masks` does.
    """
    axes, rows, columns = view
    # Writable: a read-only array would be another type, and compile the kernel once more.
    points = np.require(np.asarray(vertices).T, np.float64, _PLAIN)
    indices = np.require(faces, np.int32, _PLAIN)
    views = np.require(projections, np.float64, _PLAIN)
    if points.ndim != 2 or points.shape[0] != 3:
        raise ValueError("vertices must be (n, 3)")
    if indices.ndim != 2 or indices.shape[1] != 3:
        raise ValueError("faces must be (m, 3)")
    if views.ndim != 3 or views.shape[1:] != (axes, 4):
        raise ValueError(f"projections must be (V, {axes}, 4)")
    if not (1 <= rows <= LARGEST_IMAGE and 1 <= columns <= LARGEST_IMAGE):
        raise ValueError(f"an image has 1 to {LARGEST_IMAGE} rows and columns")
    if indices.size and not (indices.min() >= 0 and indices.max() < points.shape[1]):
        raise ValueError("a face names a vertex that is not there")
    for values in (points, views):
        # Written so that NaN fails too.
        if values.size and not (values.min() > -LARGEST_VALUE and values.max() < LARGEST_VALUE):
            raise ValueError(f"vertices and projections must be finite, below {LARGEST_VALUE:g}")
    return points, indices, views


@kernel("float64[:, :], int32[:, :], float64[:, :, :], int64, int64, int64, uint64[:, :, :]")
def draw_views(vertices, faces, projections, columns, begin, end, masks):
    """Set the covered bits of ``masks[begin:end]``.

    ``vertices`` (3, n) float64, ``faces`` (m, 3) int32, ``projections`` (V, 2, 4) float64,
    ``masks`` (V, rows, words) uint64.
    """
    points = np.empty((vertices.shape[1], 2))
    cells = np.empty(vertices.shape[1], np.uint32)
    for view in range(begin, end):
        project(vertices, projections[view], masks.shape[1], columns, points, cells)
        draw_faces(points, cells, faces, columns, masks[view])
