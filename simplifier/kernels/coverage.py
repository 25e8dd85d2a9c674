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
from typing import TYPE_CHECKING, Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from simplifier.kernels.bit_image import lowest_one
from simplifier.kernels.compiled.intrinsic import intrinsic
from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel
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
of edges.  More pixels make triangles dearer; of a few, most triangles lie between them, and each
tells as soon as its edges do."""

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

_FACES_A_PIXEL = 4
"""At most, of a picture that is drawn by a table that is there anyway."""

_MANY_ROWS = 16
"""Of a triangle whose crossings are computed for several rows at once; behind others, too."""

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
        image: int,
    ) -> MaskArray | None:
        """Its silhouettes, ``image`` pixels a side, if they are known."""


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
        if table.worth_it:
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
    """Whether so many triangles are drawn by their contour, if few of their edges are open.

    ``there``  the table of their edges is, from other pictures.
    """
    if faces > MOST_FACES or pixels > _PIXELS_A_FACE * faces:
        return False
    if there:
        return faces <= _FACES_A_PIXEL * pixels
    return views**2 * pixels >= _LEAST_VIEWS**2 * faces  # the square of views by pixels a triangle


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


@inner_kernel
def project(vertices, projection, rows, columns, points, cells):
    """Image coordinates with pixel centres at the integers, and each vertex's packed cell.

    A cell is (first row at or above y, first column at or right of x), clamped to the image, the
    row in the upper 16 bits: all that is needed to drop a triangle between pixel centres.
    """
    a, b, c, d = projection[0]
    e, f, g, h = projection[1]
    d -= 0.5
    h -= 0.5
    for i in range(len(cells)):
        x = a * vertices[0, i] + b * vertices[1, i] + c * vertices[2, i] + d
        y = e * vertices[0, i] + f * vertices[1, i] + g * vertices[2, i] + h
        points[i, 0] = x
        points[i, 1] = y
        column = np.uint32(np.int32(np.ceil(min(max(x, 0.0), float(columns)))))
        row = np.uint32(np.int32(np.ceil(min(max(y, 0.0), float(rows)))))
        cells[i] = (row << np.uint32(16)) | column


@inline_kernel
def crossing(points, low, high, row):
    """x where the edge low -> high meets the row; low's row cell is below high's."""
    return _crossing(points[low, 0], points[low, 1], points[high, 0], points[high, 1], row)


@inline_kernel
def _crossing(low_x, low_y, high_x, high_y, row):
    return low_x + (row - low_y) / (high_y - low_y) * (high_x - low_x)


@inline_kernel
def run_of_ones(first, count):
    """``count`` (1..64) ones from bit ``first`` on, within one word."""
    return (~np.uint64(0) >> np.uint64(64 - count)) << np.uint64(first)


@inline_kernel
def columns_of_word(begin, end, word):
    """The bits of a word of a row that are columns from ``begin`` to before ``end``."""
    first, last = max(begin - 64 * word, 0), min(end - 64 * word, 64)
    return run_of_ones(first, last - first) if first < last else np.uint64(0)


@inline_kernel
def lies_between(p, q, r):
    """Whether no pixel centre is in the box of a triangle: the fate of most of a fine mesh.

    ``p``, ``q``, ``r`` are the cells of its vertices.
    """
    differ = (p ^ q) | (p ^ r)
    return (differ & np.uint32(0xFFFF)) == 0 or (differ >> np.uint32(16)) == 0


@inline_kernel
def box_columns(p, q, r):
    """(word, bits) of the columns of that box if one word holds them; else no bits."""
    low_half = np.uint32(0xFFFF)
    left = np.int64(min(p & low_half, q & low_half, r & low_half))
    right = np.int64(max(p & low_half, q & low_half, r & low_half)) - 1
    word = left >> 6
    bits = np.uint64(0)
    if word == right >> 6:
        bits = run_of_ones(left & 63, right - left + 1)
    return word, bits


@inline_kernel
def rows_of(p, q, r, i, j, k):
    """(first row, row of the bend, row end, and the vertices in that order) of a triangle.

    ``p``, ``q``, ``r`` are the cells of its vertices ``i``, ``j``, ``k``.  Sorted without branches;
    equal rows may come in any order, their edge is not used.
    """
    a = (np.uint64(p) << np.uint64(32)) | np.uint64(i)
    b = (np.uint64(q) << np.uint64(32)) | np.uint64(j)
    c = (np.uint64(r) << np.uint64(32)) | np.uint64(k)
    low = min(a, b, c)
    high = max(a, b, c)
    middle = a ^ b ^ c ^ low ^ high
    row, vertex = np.uint64(48), np.uint64(0xFFFFFFFF)
    return (
        np.int64(low >> row), np.int64(middle >> row), np.int64(high >> row),
        np.int64(low & vertex), np.int64(middle & vertex), np.int64(high & vertex),
    )  # fmt: skip


def _write_pictured(builder: Any, *given: Any) -> Any:
    from simplifier.kernels.compiled.boxes import write_pictured  # with llvmlite

    return write_pictured(builder, *given)


@intrinsic(_write_pictured)
def pictured(cells, faces, begin):
    """Which of the 64 faces from ``begin`` on do not lie between pixels, as ones of a uint64."""
    found = np.uint64(0)
    for place in range(64):
        i, j, k = faces[begin + place]
        found |= np.uint64(not lies_between(cells[i], cells[j], cells[k])) << np.uint64(place)
    return found


@inner_kernel
def draw_faces(points, cells, faces, columns, mask):
    """Set the covered bits of one view, whose vertices :func:`project` has projected."""
    spans, count = empty_spans(mask), faces.shape[0]
    for begin in range(0, count, 64):
        waiting = np.uint64(0)
        if begin + 64 <= count:
            waiting = pictured(cells, faces, begin)
        else:
            for face in range(begin, count):
                p, q, r = cells[faces[face, 0]], cells[faces[face, 1]], cells[faces[face, 2]]
                waiting |= np.uint64(not lies_between(p, q, r)) << np.uint64(face - begin)
        while waiting != 0:
            lowest, place = lowest_one(waiting)
            waiting ^= lowest
            i, j, k = faces[begin + place, 0], faces[begin + place, 1], faces[begin + place, 2]
            draw_face(points, cells, i, j, k, columns, mask, spans)


@inline_kernel
def empty_spans(mask):
    """Scratch for :func:`draw_face`: (2, rows)."""
    return np.empty((2, mask.shape[0]), np.int64)


@inline_kernel
def draw_face(points, cells, i, j, k, columns, mask, spans):
    """Draw the triangle of vertices ``i``, ``j`` and ``k``, which does not lie between pixels."""
    p, q, r = cells[i], cells[j], cells[k]
    bottom, bend, top, low, middle, high = rows_of(p, q, r, i, j, k)
    if top - bottom >= _MANY_ROWS:
        _fill_spans(points, (low, high), (low, middle), bottom, bend, columns, spans)
        _fill_spans(points, (low, high), (middle, high), bend, top, columns, spans)
        for row in range(bottom, top):
            if spans[0, row] < spans[1, row]:
                set_span(mask, row, spans[0, row], spans[1, row] - 1)
        return
    box_word, box = box_columns(p, q, r)
    for row in range(bottom, top):
        # Behind other triangles: nothing to add.  Halves the work, soups are layered.
        if box != 0 and (mask[row, box_word] & box) == box:
            continue
        x0 = crossing(points, low, high, row)
        if row < bend:
            x1 = crossing(points, low, middle, row)
        else:
            x1 = crossing(points, middle, high, row)
        first, end = _columns_between(x0, x1, columns)
        if first < end:
            set_span(mask, row, first, end - 1)


@inline_kernel
def _columns_between(x0, x1, columns):
    """The first column between two crossings, and the one after the last."""
    return (
        np.int64(np.ceil(min(max(min(x0, x1), 0.0), float(columns)))),
        np.int64(np.ceil(min(max(max(x0, x1), 0.0), float(columns)))),
    )


@inline_kernel
def _fill_spans(points, one, other, begin, end, columns, spans):
    """Fill ``spans`` (2, rows) with the columns between two edges, (low, high) each, of the rows
    ``begin`` to ``end``: a loop that divides for several rows at once."""
    ax, ay, bx, by = _ends_of(points, one)
    cx, cy, dx, dy = _ends_of(points, other)
    for row in range(begin, end):
        first, last = _columns_between(
            _crossing(ax, ay, bx, by, row), _crossing(cx, cy, dx, dy, row), columns
        )
        spans[0, np.uint64(row)] = first
        spans[1, np.uint64(row)] = last


@inline_kernel
def _ends_of(points, edge):
    low, high = edge
    return points[low, 0], points[low, 1], points[high, 0], points[high, 1]


@inline_kernel
def set_span(mask, row, first, last):
    word = first >> 6
    last_word = last >> 6
    if word == last_word:
        mask[row, word] |= run_of_ones(first & 63, last - first + 1)
    else:
        mask[row, word] |= ~np.uint64(0) << np.uint64(first & 63)
        for between in range(word + 1, last_word):
            mask[row, between] = ~np.uint64(0)
        mask[row, last_word] |= ~np.uint64(0) >> np.uint64(63 - (last & 63))
