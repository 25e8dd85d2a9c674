"""Free space over a raster of upright columns: as runs of voxels, and the spaces they make up.

Voxels (nx, ny, nz) are cubes; x, y and z of all places in voxels.  ``bits`` (nx, ny, words) uint64:
bit z % 64 of word z // 64 is set where the surface touches the voxel.  Columns on the border of the
raster are outside of the scene and have no run.

Runs are the free voxels of each column from below: ``starts`` (nx ny + 1,) int64 where those of a
column begin in ``firsts`` and ``lasts`` (k,) int32, ends included.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.columns import TOUCH, admits
from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel
from simplifier.kernels.disjoint_sets import root_of
from simplifier.kernels.height_field import _clipped_heights

_STEEP = 1.0  # of its own area in plan: faces whose upright area is larger are walls


@kernel(
    "float64[:, :], int32[:, :], int64, int64, float64, uint64[:, :, :], int64, float64[:, :], "
    "float64[:, :]"
)
def mark_columns(vertices, faces, begin, end, flat, bits, depth, lows, walls):
    """Set the voxels of the columns ``begin`` to ``end`` along x that the triangles touch.

    ``vertices`` (n, 3) float64, ``faces`` (m, 3) int32; ``depth`` nz.  What is no higher than
    ``flat`` lies in the lowest plane, hides nothing above it, and is left out.
    ``lows``, ``walls``  (nx, ny) float64, infinite at first: the lowest point of any triangle in a
    column, and of a steep one.
    """
    ring, other = np.empty((9, 3)), np.empty((9, 3))
    ny = bits.shape[1]
    for face in range(len(faces)):
        p, q, r = vertices[faces[face, 0]], vertices[faces[face, 1]], vertices[faces[face, 2]]
        x_first = max(np.int64(np.floor(min(p[0], q[0], r[0]) - TOUCH)), begin)
        x_last = min(np.int64(np.floor(max(p[0], q[0], r[0]) + TOUCH)), end - 1)
        if x_first > x_last or max(p[2], q[2], r[2]) <= flat:
            continue
        y_first = max(np.int64(np.floor(min(p[1], q[1], r[1]) - TOUCH)), 0)
        y_last = min(np.int64(np.floor(max(p[1], q[1], r[1]) + TOUCH)), ny - 1)
        normal = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
        sign = 1.0 if normal > 0.0 else -1.0
        nx_ = (q[1] - p[1]) * (r[2] - p[2]) - (q[2] - p[2]) * (r[1] - p[1])
        ny_ = (q[2] - p[2]) * (r[0] - p[0]) - (q[0] - p[0]) * (r[2] - p[2])
        steep = nx_ * nx_ + ny_ * ny_ > _STEEP * normal * normal
        for x in range(x_first, x_last + 1):
            for y in range(y_first, y_last + 1):
                if not admits(p, q, r, sign, x, y):
                    continue
                low, high = _clipped_heights(p, q, r, float(x), float(y), ring, other)
                if low > high or high <= flat:
                    continue
                lows[x, y] = min(lows[x, y], low)
                if steep:
                    walls[x, y] = min(walls[x, y], low)
                first = min(max(np.int64(np.floor(low - TOUCH)), 0), depth - 1)
                last = min(max(np.int64(np.floor(high + TOUCH)), 0), depth - 1)
                for z in range(first, last + 1):
                    bits[x, y, z // 64] |= np.uint64(1) << np.uint64(z % 64)


@kernel("float64[:, :], int32[:, :], int64, int64, int32[:, :], float64[:, :]")
def lower_roofs(vertices, faces, begin, end, reached, roofs):
    """Lower ``roofs`` (nx, ny) float64 to the lowest point of a triangle above ``reached``.

    ``reached``  (nx, ny) int32: voxels from the bottom that are solid, none where it is 0.  A
    triangle that begins below and ends above lowers it to there.
    """
    ring, other = np.empty((9, 3)), np.empty((9, 3))
    ny = roofs.shape[1]
    for face in range(len(faces)):
        p, q, r = vertices[faces[face, 0]], vertices[faces[face, 1]], vertices[faces[face, 2]]
        x_first = max(np.int64(np.floor(min(p[0], q[0], r[0]) - TOUCH)), begin)
        x_last = min(np.int64(np.floor(max(p[0], q[0], r[0]) + TOUCH)), end - 1)
        y_first = max(np.int64(np.floor(min(p[1], q[1], r[1]) - TOUCH)), 0)
        y_last = min(np.int64(np.floor(max(p[1], q[1], r[1]) + TOUCH)), ny - 1)
        top = max(p[2], q[2], r[2])
        normal = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
        sign = 1.0 if normal > 0.0 else -1.0
        for x in range(x_first, x_last + 1):
            for y in range(y_first, y_last + 1):
                if reached[x, y] == 0 or top <= reached[x, y]:
                    continue
                if not admits(p, q, r, sign, x, y):
                    continue
                low, high = _clipped_heights(p, q, r, float(x), float(y), ring, other)
                if low <= high and high > reached[x, y]:
                    roofs[x, y] = min(roofs[x, y], max(low, float(reached[x, y])))


@inline_kernel
def _is_set(bits, x, y, z):
    return bits[x, y, z // 64] >> np.uint64(z % 64) & np.uint64(1) != 0


@kernel("uint64[:, :, :], int32[:, :], int64, int64[:]")
def count_runs(bits, earth, depth, counts):
    """Set ``counts`` (nx ny,) int64 to the free runs of each column.

    ``earth`` (nx, ny) int32: so many voxels from the bottom are ground, which is not free.
    """
    nx, ny, _ = bits.shape
    counts[:] = 0
    for x in range(1, nx - 1):
        for y in range(1, ny - 1):
            before = False
            for z in range(earth[x, y], depth):
                free = not _is_set(bits, x, y, z)
                if free and not before:
                    counts[x * ny + y] += 1
                before = free


@kernel("uint64[:, :, :], int32[:, :], int64, int64[:], int32[:], int32[:]")
def list_runs(bits, earth, depth, starts, firsts, lasts):
    """Set ``firsts`` and ``lasts`` of the runs that were counted."""
    nx, ny, _ = bits.shape
    for x in range(1, nx - 1):
        for y in range(1, ny - 1):
            place = starts[x * ny + y] - 1
            before = False
            for z in range(earth[x, y], depth):
                free = not _is_set(bits, x, y, z)
                if free:
                    if not before:
                        place += 1
                        firsts[place] = z
                    lasts[place] = z
                before = free


@kernel("int64[:], int32[:], int32[:], int64, int64[:]")
def join_runs(starts, firsts, lasts, ny, parent):
    """Number the spaces: voxels that share a face, an edge or a corner are in the same one.

    ``parent`` (k,) int64: 0 to k - 1 at first, the space of each run afterwards, in the order of
    their first runs.  Returns how many there are.
    """
    columns = len(starts) - 1
    for column in range(columns):
        y = column % ny
        for side in range(4):
            dx, dy = (0, 1) if side == 0 else (1, side - 2)
            beside = column + dx * ny + dy
            if y + dy < 0 or y + dy >= ny or beside >= columns:
                continue
            one, two = starts[column], starts[beside]
            while one < starts[column + 1] and two < starts[beside + 1]:
                if firsts[one] <= lasts[two] + 1 and firsts[two] <= lasts[one] + 1:
                    a, b = root_of(parent, one), root_of(parent, two)
                    # The earlier run is the root, so that one pass can number them.
                    parent[max(a, b)] = min(a, b)
                if lasts[one] < lasts[two]:
                    one += 1
                else:
                    two += 1
    count = 0
    for run in range(len(parent)):
        if parent[run] == run:
            parent[run] = count
            count += 1
        else:  # runs before this one hold numbers already
            parent[run] = parent[parent[run]]
    return count


@kernel("int64[:], int32[:], int32[:], int64[:], int64, int64[:, :, :], int64[:], int64[:, :]")
def measure_spaces(starts, firsts, lasts, spaces, ny, boxes, volumes, tips):
    """Boxes, volumes and a highest voxel of all spaces.

    ``spaces`` (k,) int64: of each run; ``boxes`` (m, 2, 3) int64, at first the highest and the
    lowest numbers: first and last voxel along each axis.  ``volumes`` (m,) int64, zeros at first.
    ``tips`` (m, 3) int64: a voxel of each.
    """
    for column in range(len(starts) - 1):
        x, y = column // ny, column % ny
        for run in range(starts[column], starts[column + 1]):
            space = spaces[run]
            volumes[space] += lasts[run] - firsts[run] + 1
            if lasts[run] > boxes[space, 1, 2]:
                tips[space, 0], tips[space, 1], tips[space, 2] = x, y, lasts[run]
            boxes[space, 0, 0] = min(boxes[space, 0, 0], x)
            boxes[space, 0, 1] = min(boxes[space, 0, 1], y)
            boxes[space, 0, 2] = min(boxes[space, 0, 2], firsts[run])
            boxes[space, 1, 0] = max(boxes[space, 1, 0], x)
            boxes[space, 1, 1] = max(boxes[space, 1, 1], y)
            boxes[space, 1, 2] = max(boxes[space, 1, 2], lasts[run])


@kernel(
    "int64[:, :, :], int64[:], int32[:], int32[:], int64[:], (int64, int64), bool, int64[:], "
    "int64[:], int64[:]"
)
def list_touched(windows, starts, firsts, lasts, spaces, shape, ground, stamps, cells, found):
    """List the spaces that have a voxel in each window; returns how many pairs there are.

    ``windows``  (c, 2, 3) int64: first and last voxel.  ``shape`` (nx, ny).
    ``ground``   what lies below all surfaces of its column, of which one begins in the window, is
                 below the ground, and does not count.
    ``stamps``   (m,) int64, -1 at first.
    ``cells``, ``found``  (pairs,) int64: each window's number and space; none is set beyond them.
    """
    nx, ny = shape
    count = 0
    for cell in range(len(windows)):
        (x0, y0, z0), (x1, y1, z1) = windows[cell]
        for x in range(max(x0, 0), min(x1, nx - 1) + 1):
            for y in range(max(y0, 0), min(y1, ny - 1) + 1):
                column = x * ny + y
                for run in range(starts[column], starts[column + 1]):
                    if firsts[run] > z1 or lasts[run] < z0:
                        continue
                    if ground and firsts[run] == 0 and lasts[run] < z1:
                        continue
                    space = spaces[run]
                    if stamps[space] != cell:
                        stamps[space] = cell
                        if count < len(cells):
                            cells[count], found[count] = cell, space
                        count += 1
    return count


@inline_kernel
def _run_at(starts, firsts, lasts, column, z):
    """The run of a column that holds a voxel, or -1."""
    for run in range(starts[column], starts[column + 1]):
        if firsts[run] > z:
            return -1
        if lasts[run] >= z:
            return run
    return -1


@inline_kernel
def _between(starts, firsts, lasts, spaces, shut, shape, x, y, z):
    """Whether a touched voxel has closed space beside it, and no open one."""
    beside = False
    for dx in range(-1, 2):
        for dy in range(-1, 2):
            if not (0 <= x + dx < shape[0] and 0 <= y + dy < shape[1]):
                continue
            column = (x + dx) * shape[1] + y + dy
            for run in range(starts[column], starts[column + 1]):
                if firsts[run] > z + 1 or lasts[run] < z - 1:
                    continue
                if not shut[spaces[run]]:
                    return False
                beside = True
    return beside


@kernel("int64[:], int32[:], int32[:], int64[:], bool[:], int32[:, :], int64, bool, int32[:, :]")
def stack_solid(starts, firsts, lasts, spaces, shut, earth, depth, sheets, reached):
    """Set ``reached`` (nx, ny) int32 to the voxels that are solid from the bottom to the first gap.

    ``shut``    (m,) bool: the spaces that are solid; ``earth`` (nx, ny) int32 what is below them.
    ``sheets``  whether a touched voxel is solid that has shut space among its 26 neighbours, and
                no open one.
    """
    shape = reached.shape
    for x in range(shape[0]):
        for y in range(shape[1]):
            z = np.int64(earth[x, y])
            column = x * shape[1] + y
            while z < depth:
                run = _run_at(starts, firsts, lasts, column, z)
                if run >= 0:
                    if not shut[spaces[run]]:
                        break
                    z = lasts[run] + 1
                elif sheets and _between(starts, firsts, lasts, spaces, shut, shape, x, y, z):
                    z += 1
                else:
                    break
            reached[x, y] = z


@inner_kernel
def count_solid(starts, firsts, lasts, spaces, shut, ny, kept_to):
    """Voxels of shut spaces, and those of them below ``kept_to`` (nx, ny) int32."""
    filled = kept = 0
    for column in range(len(starts) - 1):
        top = kept_to[column // ny, column % ny]
        for run in range(starts[column], starts[column + 1]):
            if shut[spaces[run]]:
                filled += lasts[run] - firsts[run] + 1
                kept += max(min(lasts[run] + 1, top) - firsts[run], 0)
    return filled, kept


@kernel("uint64[:, :, :], uint64[:, :, :]")
def thicken(bits, out):
    """Set ``out`` to ``bits`` and all voxels that share a corner with one of them."""
    nx, ny, words = bits.shape
    one, top = np.uint64(1), np.uint64(63)
    for x in range(nx):
        for y in range(ny):
            for word in range(words):
                here = before = after = np.uint64(0)
                for i in range(max(x - 1, 0), min(x + 2, nx)):
                    for j in range(max(y - 1, 0), min(y + 2, ny)):
                        here |= bits[i, j, word]
                        if word > 0:
                            before |= bits[i, j, word - 1]
                        if word + 1 < words:
                            after |= bits[i, j, word + 1]
                out[x, y, word] = here | here << one | here >> one | before >> top | after << top


@inline_kernel
def _passes_right(a, b, x, y):
    """Whether an edge crosses the line y to the right of x; the same from either end."""
    if (a[1] > y) == (b[1] > y):
        return False
    if a[1] > b[1] or (a[1] == b[1] and a[0] > b[0]):
        a, b = b, a
    return a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) > x


@kernel("float64[:, :], int32[:, :], uint64[:], int32[:, :], int32[:], int64[:], uint64[:]")
def sign_voxels(vertices, faces, keys, first_of, next_of, heights, signatures):
    """Toggle the key of each triangle that is straight above the centre of a voxel.

    ``keys``       (m,) uint64: of the triangles, 0 for those that do not count.
    ``first_of``   (nx, ny) int32: the first voxel in a column, -1 for none; ``next_of`` (v,) int32
                   the next one in the same; ``heights`` (v,) int64: z.
    ``signatures`` (v,) uint64, zeros at first.

    Shared edges are on one side for both their triangles, so closed meshes are crossed an even
    number of times from outside, whatever rounding does.
    """
    nx, ny = first_of.shape
    for face in range(len(faces)):
        if keys[face] == 0:
            continue
        p, q, r = vertices[faces[face, 0]], vertices[faces[face, 1]], vertices[faces[face, 2]]
        x_first = max(np.int64(np.floor(min(p[0], q[0], r[0]) - 0.5)), 0)
        x_last = min(np.int64(np.floor(max(p[0], q[0], r[0]))), nx - 1)
        y_first = max(np.int64(np.floor(min(p[1], q[1], r[1]) - 0.5)), 0)
        y_last = min(np.int64(np.floor(max(p[1], q[1], r[1]))), ny - 1)
        normal = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
        for i in range(x_first, x_last + 1):
            for j in range(y_first, y_last + 1):
                voxel = first_of[i, j]
                if voxel < 0:
                    continue
                x, y = i + 0.5, j + 0.5
                if not (
                    _passes_right(p, q, x, y)
                    ^ _passes_right(q, r, x, y)
                    ^ _passes_right(r, p, x, y)
                ):
                    continue
                low, high = min(p[2], q[2], r[2]), max(p[2], q[2], r[2])
                z = low
                if normal != 0.0:
                    nx_ = (q[1] - p[1]) * (r[2] - p[2]) - (q[2] - p[2]) * (r[1] - p[1])
                    ny_ = (q[2] - p[2]) * (r[0] - p[0]) - (q[0] - p[0]) * (r[2] - p[2])
                    z = p[2] - (nx_ * (x - p[0]) + ny_ * (y - p[1])) / normal
                    z = min(max(z, low), high)
                while voxel >= 0:
                    if z > heights[voxel] + 0.5:
                        signatures[voxel] ^= keys[face]
                    voxel = next_of[voxel]


@kernel("int64[:], int32[:], int32[:], int64[:], int64, int64[:], bool[:], bool[:, :, :]")
def draw_spaces(starts, firsts, lasts, spaces, ny, low, wanted, drawn):
    """Set ``drawn`` (a, b, c) bool, a window from the voxel ``low`` (3,) on, where spaces are.

    ``wanted``  (m,) bool: which of them.
    """
    for i in range(drawn.shape[0]):
        for j in range(drawn.shape[1]):
            column = (low[0] + i) * ny + low[1] + j
            for run in range(starts[column], starts[column + 1]):
                if wanted[spaces[run]]:
                    first = max(firsts[run] - low[2], 0)
                    last = min(lasts[run] - low[2], drawn.shape[2] - 1)
                    for k in range(first, last + 1):
                        drawn[i, j, k] = True


@kernel("bool[:, :, :], int32[:, :, :]")
def walk(free, distance):
    """Set ``distance`` (nx, ny, nz) int32 of free voxels to the steps from where it is 0.

    ``free`` (nx, ny, nz) bool; -1 in all other places at first, and afterwards where no way leads.
    A step leads to any of 26 neighbours.
    """
    nx, ny, nz = free.shape
    queue = np.empty((nx * ny * nz, 3), np.int32)
    end = 0
    for x in range(nx):
        for y in range(ny):
            for z in range(nz):
                if distance[x, y, z] == 0:
                    queue[end, 0], queue[end, 1], queue[end, 2] = x, y, z
                    end += 1
    begin = 0
    while begin < end:
        x, y, z = queue[begin]
        begin += 1
        for i in range(max(x - 1, 0), min(x + 2, nx)):
            for j in range(max(y - 1, 0), min(y + 2, ny)):
                for k in range(max(z - 1, 0), min(z + 2, nz)):
                    if free[i, j, k] and distance[i, j, k] < 0:
                        distance[i, j, k] = distance[x, y, z] + 1
                        queue[end, 0], queue[end, 1], queue[end, 2] = i, j, k
                        end += 1
