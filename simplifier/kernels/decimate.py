"""Edge collapse by quadric error, down to a number of triangles.

Garland and Heckbert, "Surface Simplification Using Quadric Error Metrics" (1997), with planes
weighted by area and planes across the open borders.  What differs: nothing protects the topology,
because an occluder needs none.  Handles close, the sides of a thin part meet and count once, and
small components vanish, each when its error is the least; so any number of triangles is reached, on
any input.  A collapse that would take a face out of the room costs more.  And an *outline*, a
border around all of a sheet, may be firm, because it is the silhouette in nearly all views: there
the distance to the lines along the border counts as well.  Planes across it lean with the faces
beside it, and push corners outwards where these rise and fall.

``vertices`` (n, 3) float64 and ``faces`` (m, 3) int32 are changed in place.  The faces at a vertex
are a list of corners, 3 * face + place: ``heads`` (n,) int64 the first, ``links`` (3 m,) int64 the
next, -1 at the end.
"""

from __future__ import annotations

from heapq import heapify, heappop, heappush

import numpy as np

from simplifier.kernels.compiled.kernel import inner_kernel, kernel
from simplifier.kernels.disjoint_sets import root_of
from simplifier.kernels.voxelize import ROOM, is_contained

_BORDER = 10.0  # weight of a plane across a border, in squares of its edge
_AROUND = 4.0  # times the area: the square of an outline; that of a flat sheet has 4 pi or more
_FOLDED = 100.0  # how much dearer a collapse is that turns a face over
_FIRMLY = 1e-3  # the pull to the middle where a weaker one lets a vertex leave its edge by far
_LEAVES = 10.0  # and one that takes a face out of the room; more stops too many


@kernel(f"float64[:, :], int32[:, :], {ROOM}, int64, bool[:], float64, float64, bool[:], float64")
def decimate(vertices, faces, room, budget, alive, to_middle, short, outline, firmness):
    """Collapse edges until at most ``budget`` faces are left, which ``alive`` (m,) bool tells.

    ``room``       where faces should be, as :func:`~.voxelize.is_contained` takes it: a collapse
                   that leaves it waits longer.
    ``to_middle``  pull towards the middle of the edge, in what the planes weigh together: where all
                   of them agree nothing else says where along them the vertex is to be.
    ``short``      cost of an edge, a squared voxel of its length.  Without it flat parts, where
                   nothing else costs, collapse into one vertex with thousands of faces, and each
                   collapse walks them all.
    ``outline``    (n,) bool: vertices of borders that are firm.
    ``firmness``   weight of the lines along these, in their lengths.

    The smaller ``to_middle`` and ``short`` are the nearer is the result; the larger, the more even
    are its triangles.

    Faces have three different vertices and no two faces the same three.  Cost: n log n, and a
    microsecond a face.
    """
    heads, links = _corner_lists(faces, len(vertices))
    quadrics = _quadrics(vertices, faces, heads, links, outline, firmness)
    queue = _edges(vertices, faces, heads, links, quadrics, to_middle, short)
    versions = np.zeros(len(vertices), np.int64)  # counts moves; -1 for a vertex that is gone
    moved = np.zeros(len(vertices), np.int64)  # the collapse that moved it last, counted from 1
    offers = np.full(len(vertices), -1, np.int64)  # the other end of its edge in the queue
    marks = np.full(len(vertices), -1, np.int64)
    place = np.zeros(3)
    for face in range(len(faces)):
        alive[face] = True
    count, step, mark = len(faces), 0, 0
    while count > budget:
        cost, u, v, stamp = heappop(queue)
        # What was weighed already has the complement of its stamp.
        version = stamp if stamp >= 0 else ~stamp
        times = np.inf
        if versions[u] >= 0 and versions[v] >= 0 and versions[u] + versions[v] == version:
            _cost(vertices, quadrics, u, v, place, to_middle, short)
            times = 1.0
            if stamp >= 0:
                times = _weight(vertices, faces, heads, links, u, v, place, room)
                if times > 1.0:
                    heappush(queue, (cost * times, u, v, ~stamp))
        if times == 1.0:
            count -= _collapse(faces, heads, links, alive, u, v, marks, mark + 1)
            versions[u] = -1
            versions[v] += 1
            for k in range(3):
                vertices[v, k] = place[k]
            for k in range(10):
                quadrics[v, k] += quadrics[u, k]
            step += 1
            moved[v] = step
            cost, u = -1.0, -1  # its first edge is next
        elif stamp < 0 or offers[v] != u or versions[v] < 0:
            continue
        mark += 2
        _offer(
            vertices, faces, heads, links, quadrics, versions, moved, v, cost, u, place, marks,
            mark, offers, queue, to_middle, short,
        )  # fmt: skip


@kernel("float64[:, :], int32[:, :], bool[:]")
def mark_outline(vertices, faces, outline):
    """Mark the vertices of each border that is long enough to be around all of the faces.

    The square of its length is more than a third of what a flat sheet of their area has at least,
    by the isoperimetric inequality; a box without a lid has less.  ``outline`` (n,) bool is
    written.
    """
    heads, links = _corner_lists(faces, len(vertices))
    parents = np.arange(len(vertices))
    lengths = np.zeros(len(vertices))  # of border edges, at their first vertex
    area = 0.0
    for face in range(len(faces)):
        corners = faces[face]
        nx, ny, nz = _normal(vertices[corners[0]], vertices[corners[1]], vertices[corners[2]])
        area += 0.5 * np.sqrt(nx * nx + ny * ny + nz * nz)
        for k in range(3):
            a, b = corners[k], corners[(k + 1) % 3]
            if _is_border(faces, heads, links, a, b):
                p, q = vertices[a], vertices[b]
                lengths[a] += np.sqrt((p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2)
                parents[root_of(parents, a)] = root_of(parents, b)
    around = np.zeros(len(vertices))
    for vertex in range(len(vertices)):
        around[root_of(parents, vertex)] += lengths[vertex]
    for vertex in range(len(vertices)):
        outline[vertex] = around[root_of(parents, vertex)] ** 2 > _AROUND * area


@inner_kernel
def _edges(vertices, faces, heads, links, quadrics, to_middle, short):
    """A queue of (cost, vertex, vertex, sum of their versions), each edge once."""
    place = np.zeros(3)
    queue = [(0.0, 0, 0, 0) for _ in range(0)]
    for face in range(len(faces)):
        for k in range(3):
            a, b = np.int64(faces[face, k]), np.int64(faces[face, (k + 1) % 3])
            if _first_with(faces, heads, links, a, b) == face:
                queue.append((_cost(vertices, quadrics, a, b, place, to_middle, short), a, b, 0))
    heapify(queue)
    return queue


@inner_kernel
def _offer(
    vertices, faces, heads, links, quadrics, versions, moved, v, cost, u, place, marks, mark,
    offers, queue, to_middle, short,
):  # fmt: skip
    """Queue the next edge of a vertex: the cheapest after that to ``u``, which costs ``cost``.

    Of the edges to vertices that have not moved since it has.  Only one of its edges is queued at a
    time, as most are moved before it is their turn.
    """
    least, other = np.inf, np.int64(-1)
    corner = heads[v]
    while corner >= 0:
        for k in range(1, 3):
            w = np.int64(faces[corner // 3, (corner % 3 + k) % 3])
            if moved[w] < moved[v] and marks[w] != mark:
                marks[w] = mark
                price = _cost(vertices, quadrics, w, v, place, to_middle, short)
                later = price > cost or (price == cost and w > u)
                first = other < 0 or price < least or (price == least and w < other)
                if later and first:
                    least, other = price, w
        corner = links[corner]
    offers[v] = other
    if other >= 0:
        heappush(queue, (least, other, v, versions[other] + versions[v]))


@inner_kernel
def _weight(vertices, faces, heads, links, u, v, place, room):
    """By how much a collapse is dearer for the faces that it turns over or takes outside."""
    times = 1.0
    if _folds(vertices, faces, heads, links, u, v, place) or _folds(
        vertices, faces, heads, links, v, u, place
    ):
        times *= _FOLDED
    if _leaves(vertices, faces, heads, links, u, v, place, room) or _leaves(
        vertices, faces, heads, links, v, u, place, room
    ):
        times *= _LEAVES
    return times


@inner_kernel
def _leaves(vertices, faces, heads, links, moved, partner, place, room):
    """Whether a face of ``moved`` that ``partner`` has not is outside with it at ``place``."""
    p = (place[0], place[1], place[2])
    corner = heads[moved]
    while corner >= 0:
        face = corner // 3
        if not _has(faces, face, partner):
            b, c = _others(faces, corner)
            q = (vertices[b, 0], vertices[b, 1], vertices[b, 2])
            r = (vertices[c, 0], vertices[c, 1], vertices[c, 2])
            if not is_contained(p, q, r, room):
                return True
        corner = links[corner]
    return False


@inner_kernel
def _others(faces, corner):
    """The two vertices of a corner's face that follow it."""
    face, k = corner // 3, corner % 3
    return faces[face, (k + 1) % 3], faces[face, (k + 2) % 3]


@inner_kernel
def _corner_lists(faces, count):
    heads = np.full(count, -1, np.int64)
    links = np.full(3 * len(faces), -1, np.int64)
    for corner in range(3 * len(faces) - 1, -1, -1):
        vertex = faces[corner // 3, corner % 3]
        links[corner] = heads[vertex]
        heads[vertex] = corner
    return heads, links


@inner_kernel
def _has(faces, face, vertex):
    return faces[face, 0] == vertex or faces[face, 1] == vertex or faces[face, 2] == vertex


@inner_kernel
def _first_with(faces, heads, links, a, b):
    """The first face in the list of ``a`` that has ``b`` too, -1 if none."""
    corner = heads[a]
    while corner >= 0:
        if _has(faces, corner // 3, b):
            return corner // 3
        corner = links[corner]
    return -1


@inner_kernel
def _normal(p, q, r):
    """Twice the area as a vector."""
    ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    vx, vy, vz = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@inner_kernel
def _add_plane(quadric, nx, ny, nz, point, weight):
    """Add ``weight`` times the squared distance to the plane through a point; n has length 1."""
    d = -(nx * point[0] + ny * point[1] + nz * point[2])
    quadric[0] += weight * nx * nx
    quadric[1] += weight * nx * ny
    quadric[2] += weight * nx * nz
    quadric[3] += weight * ny * ny
    quadric[4] += weight * ny * nz
    quadric[5] += weight * nz * nz
    quadric[6] += weight * nx * d
    quadric[7] += weight * ny * d
    quadric[8] += weight * nz * d
    quadric[9] += weight * d * d


@inner_kernel
def _add_line(quadric, ex, ey, ez, point, weight):
    """Add ``weight`` times the squared distance to the line through a point; e has length 1."""
    along = ex * point[0] + ey * point[1] + ez * point[2]
    x, y, z = point[0] - along * ex, point[1] - along * ey, point[2] - along * ez
    quadric[0] += weight * (1.0 - ex * ex)
    quadric[1] -= weight * ex * ey
    quadric[2] -= weight * ex * ez
    quadric[3] += weight * (1.0 - ey * ey)
    quadric[4] -= weight * ey * ez
    quadric[5] += weight * (1.0 - ez * ez)
    quadric[6] -= weight * x
    quadric[7] -= weight * y
    quadric[8] -= weight * z
    quadric[9] += weight * (x * x + y * y + z * z)


@inner_kernel
def _quadrics(vertices, faces, heads, links, outline, firmness):
    """(n, 10) float64: the upper triangle of the symmetric matrix, the vector, the constant."""
    quadrics = np.zeros((len(vertices), 10))
    for face in range(len(faces)):
        corners = faces[face]
        nx, ny, nz = _normal(vertices[corners[0]], vertices[corners[1]], vertices[corners[2]])
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        if length == 0.0:
            continue
        nx, ny, nz = nx / length, ny / length, nz / length
        for k in range(3):
            a, b = corners[k], corners[(k + 1) % 3]
            _add_plane(quadrics[a], nx, ny, nz, vertices[a], 0.5 * length)
            if _is_border(faces, heads, links, a, b):
                firm = firmness if outline[a] and outline[b] else 0.0
                _add_border(quadrics, vertices, a, b, nx, ny, nz, firm)
    return quadrics


@inner_kernel
def _is_border(faces, heads, links, a, b):
    """Whether one face only has the edge."""
    found = 0
    corner = heads[a]
    while corner >= 0:
        if _has(faces, corner // 3, b):
            found += 1
        corner = links[corner]
    return found == 1


@inner_kernel
def _add_border(quadrics, vertices, a, b, nx, ny, nz, firm):
    p, q = vertices[a], vertices[b]
    ex, ey, ez = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    mx, my, mz = ey * nz - ez * ny, ez * nx - ex * nz, ex * ny - ey * nx
    squared = mx * mx + my * my + mz * mz
    if squared == 0.0:
        return
    length = np.sqrt(squared)
    for vertex in (a, b):
        _add_plane(quadrics[vertex], mx / length, my / length, mz / length, p, _BORDER * squared)
        if firm > 0.0:
            _add_line(quadrics[vertex], ex / length, ey / length, ez / length, p, firm * length)


@inner_kernel
def _cost(vertices, quadrics, u, v, place, to_middle, short):
    """What a collapse of the edge costs; writes into ``place`` (3,) where its vertex goes."""
    p, q = vertices[u], vertices[v]
    s, t = quadrics[u], quadrics[v]
    middle = 0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1]), 0.5 * (p[2] + q[2])
    length = (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2
    if _solve(s, t, middle, to_middle, place) > length and to_middle < _FIRMLY:
        _solve(s, t, middle, _FIRMLY, place)
    return max(_error(s, place) + _error(t, place), 0.0) + short * length


@inner_kernel
def _solve(s, t, middle, to_middle, place):
    """Write into ``place`` (3,) where the error of both quadrics is least; return how far that is
    from the middle, squared."""
    pull = to_middle * (s[0] + t[0] + s[3] + t[3] + s[5] + t[5]) + 1e-30
    a, b, c = s[0] + t[0] + pull, s[1] + t[1], s[2] + t[2]
    d, e, f = s[3] + t[3] + pull, s[4] + t[4], s[5] + t[5] + pull
    x, y = pull * middle[0] - s[6] - t[6], pull * middle[1] - s[7] - t[7]
    z = pull * middle[2] - s[8] - t[8]
    # The matrix is symmetric and, by the pull, positive definite: cofactors will do.
    ca, cb, cc = d * f - e * e, c * e - b * f, b * e - c * d
    determinant = a * ca + b * cb + c * cc
    place[0] = (ca * x + cb * y + cc * z) / determinant
    place[1] = (cb * x + (a * f - c * c) * y + (b * c - a * e) * z) / determinant
    place[2] = (cc * x + (b * c - a * e) * y + (a * d - b * b) * z) / determinant
    away = (place[0] - middle[0]) ** 2 + (place[1] - middle[1]) ** 2
    return away + (place[2] - middle[2]) ** 2


@inner_kernel
def _error(quadric, point):
    x, y, z = point
    return (
        quadric[0] * x * x + quadric[3] * y * y + quadric[5] * z * z + quadric[9]
        + 2.0 * (quadric[1] * x * y + quadric[2] * x * z + quadric[4] * y * z)
        + 2.0 * (quadric[6] * x + quadric[7] * y + quadric[8] * z)
    )  # fmt: skip


@inner_kernel
def _folds(vertices, faces, heads, links, moved, partner, place):
    """Whether a face of ``moved`` that ``partner`` has not turns over when it goes to ``place``."""
    corner = heads[moved]
    while corner >= 0:
        face = corner // 3
        if not _has(faces, face, partner):
            b, c = _others(faces, corner)
            q, r = vertices[b], vertices[c]
            ax, ay, az = _normal(vertices[moved], q, r)
            bx, by, bz = _normal(place, q, r)
            if ax * bx + ay * by + az * bz < 0.0:
                return True
        corner = links[corner]
    return False


@inner_kernel
def _collapse(faces, heads, links, alive, u, v, marks, mark):
    """Give the faces of ``u`` to ``v``; return how many die, by the collapse or as twins."""
    corner = heads[v]
    while corner >= 0:
        face = corner // 3
        for k in range(3):
            marks[faces[face, k]] = mark
        corner = links[corner]
    died = 0
    corner = heads[u]
    last = -1
    while corner >= 0:
        face = corner // 3
        b, c = _others(faces, corner)
        twin = marks[b] == mark and marks[c] == mark and _has_face(faces, heads, links, v, b, c)
        if b == v or c == v or twin:
            alive[face] = False
            died += 1
            _unlink(heads, links, alive, b)
            _unlink(heads, links, alive, c)
        else:
            faces[face, corner % 3] = v
        last = corner
        corner = links[corner]
    links[last] = heads[v]
    heads[v] = heads[u]
    heads[u] = -1
    _unlink(heads, links, alive, v)
    return died


@inner_kernel
def _has_face(faces, heads, links, v, b, c):
    """Whether a face at ``v`` has ``b`` and ``c`` too."""
    corner = heads[v]
    while corner >= 0:
        if _has(faces, corner // 3, b) and _has(faces, corner // 3, c):
            return True
        corner = links[corner]
    return False


@inner_kernel
def _unlink(heads, links, alive, v):
    """Take dead faces out of the list of a vertex, or it would be walked ever longer."""
    last = -1
    corner = heads[v]
    while corner >= 0:
        following = links[corner]
        if alive[corner // 3]:
            last = corner
        elif last < 0:
            heads[v] = following
        else:
            links[last] = following
        corner = following
