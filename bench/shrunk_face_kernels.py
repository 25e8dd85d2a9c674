"""Inner loops of :mod:`bench.visibility_shrunk_faces`: paths that meet, lines that are blocked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simplifier.geometry.mesh import FloatArray
from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel

_LEAF = 4  # triangles
_TOUCH = 1e-9  # of a path's extent along an axis: paths that touch do not meet
_EDGES = np.array(
    [[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]], dtype=np.int64
)
"""Of a path: corners before and after the move."""

_SIDES = np.array(
    [[0, 1, 2], [3, 4, 5], [0, 1, 3], [1, 4, 3], [1, 2, 4], [2, 5, 4], [2, 0, 5], [0, 3, 5]],
    dtype=np.int64,
)


@dataclass(frozen=True, eq=False)
class Boxed:
    """``triangles`` (m, 3, 3) along a Z-curve, padded to a power of two times four by the last one.

    ``boxes``  (2 n, 6) float64: low and high corner; below box i are 2 i and 2 i + 1, 1 is around
               all, and the last n hold four triangles each.
    """

    triangles: FloatArray
    boxes: FloatArray

    @classmethod
    def of(cls, triangles: FloatArray) -> Boxed:
        if len(triangles) == 0:
            triangles = np.full((1, 3, 3), 1e30)
        middles = triangles.mean(axis=1)
        low = middles.min(axis=0)
        places = (middles - low) / max(float(np.ptp(middles, axis=0).max()), 1e-300) * 1023.0
        code = np.zeros(len(triangles), dtype=np.int64)
        for bit in range(10):
            for axis in range(3):
                code |= (places[:, axis].astype(np.int64) >> bit & 1) << (3 * bit + axis)
        triangles = triangles[np.argsort(code, kind="stable")]
        leaves = 1
        while leaves * _LEAF < len(triangles):
            leaves *= 2
        more = np.repeat(triangles[-1:], leaves * _LEAF - len(triangles), axis=0)
        triangles = np.ascontiguousarray(np.concatenate([triangles, more]))
        boxes = np.zeros((2 * leaves, 6))
        corners = triangles.reshape(leaves, -1, 3)
        boxes[leaves:] = np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1)
        while leaves > 1:
            below = boxes[leaves : 2 * leaves].reshape(-1, 2, 6)
            leaves //= 2
            boxes[leaves : 2 * leaves, :3] = below[:, :, :3].min(axis=1)
            boxes[leaves : 2 * leaves, 3:] = below[:, :, 3:].max(axis=1)
        return cls(triangles, boxes)


@inline_kernel
def _is_parted(p, q, x, y, z):
    """Whether a plane across an axis has two paths on different sides of it."""
    least_p = least_q = np.inf
    most_p = most_q = -np.inf
    for i in range(6):
        at = p[i, 0] * x + p[i, 1] * y + p[i, 2] * z
        least_p, most_p = min(least_p, at), max(most_p, at)
        at = q[i, 0] * x + q[i, 1] * y + q[i, 2] * z
        least_q, most_q = min(least_q, at), max(most_q, at)
    touch = _TOUCH * max(most_p - least_p, most_q - least_q)
    return least_p >= most_q - touch or least_q >= most_p - touch


@inline_kernel
def _are_parted(p, q):
    """Whether any plane parts the hulls of two paths (6, 3), by their sides and pairs of edges."""
    for one in (p, q):
        for side in _SIDES:
            u, v = one[side[1]] - one[side[0]], one[side[2]] - one[side[0]]
            x, y, z = (
                u[1] * v[2] - u[2] * v[1],
                u[2] * v[0] - u[0] * v[2],
                u[0] * v[1] - u[1] * v[0],
            )
            if x * x + y * y + z * z > 0.0 and _is_parted(p, q, x, y, z):
                return True
    for a in _EDGES:
        u = p[a[1]] - p[a[0]]
        for b in _EDGES:
            v = q[b[1]] - q[b[0]]
            x, y, z = (
                u[1] * v[2] - u[2] * v[1],
                u[2] * v[0] - u[0] * v[2],
                u[0] * v[1] - u[1] * v[0],
            )
            if x * x + y * y + z * z > 1e-24 and _is_parted(p, q, x, y, z):
                return True
    return False


@inner_kernel
def drop_crossing(paths, faces, crossing):
    """Set ``crossing`` (m,) bool for faces (m, 3) without a common corner whose ``paths`` (m, 6, 3)
    meet; these ascend by their lowest x.
    """
    count = len(paths)
    low, high = np.empty((count, 3)), np.empty((count, 3))
    for i in range(count):
        for axis in range(3):
            low[i, axis], high[i, axis] = paths[i, :, axis].min(), paths[i, :, axis].max()
    for i in range(count):
        for j in range(i + 1, count):
            if low[j, 0] > high[i, 0]:
                break
            if crossing[i] and crossing[j]:
                continue
            if low[j, 1] > high[i, 1] or low[i, 1] > high[j, 1]:
                continue
            if low[j, 2] > high[i, 2] or low[i, 2] > high[j, 2]:
                continue
            common = False
            for one in faces[i]:
                for other in faces[j]:
                    common |= one == other
            if not common and not _are_parted(paths[i], paths[j]):
                crossing[i] = crossing[j] = True


@inline_kernel
def _meets_box(box, x, y, z, dx, dy, dz):
    first, last = 0.0, 1.0
    for axis in range(3):
        at = x if axis == 0 else (y if axis == 1 else z)
        towards = dx if axis == 0 else (dy if axis == 1 else dz)
        if towards == 0.0:
            if at < box[axis] or at > box[axis + 3]:
                return False
            continue
        near, far = (box[axis] - at) / towards, (box[axis + 3] - at) / towards
        first, last = max(first, min(near, far)), min(last, max(near, far))
    return first <= last + 1e-9


@inline_kernel
def _meets(t, x, y, z, dx, dy, dz):
    """Whether a line meets a triangle (3, 3) before its end (Moeller and Trumbore, 1997)."""
    ax, ay, az = t[1, 0] - t[0, 0], t[1, 1] - t[0, 1], t[1, 2] - t[0, 2]
    bx, by, bz = t[2, 0] - t[0, 0], t[2, 1] - t[0, 1], t[2, 2] - t[0, 2]
    px, py, pz = dy * bz - dz * by, dz * bx - dx * bz, dx * by - dy * bx
    whole = ax * px + ay * py + az * pz
    if whole == 0.0:
        return False
    tx, ty, tz = x - t[0, 0], y - t[0, 1], z - t[0, 2]
    u = (tx * px + ty * py + tz * pz) / whole
    if not 0.0 <= u <= 1.0:
        return False
    qx, qy, qz = ty * az - tz * ay, tz * ax - tx * az, tx * ay - ty * ax
    v = (dx * qx + dy * qy + dz * qz) / whole
    if v < 0.0 or u + v > 1.0:
        return False
    at = (bx * qx + by * qy + bz * qz) / whole
    return 0.0 < at < 1.0 - 1e-6


@inner_kernel
def blocked_lines(eye, points, boxes, triangles, blocked):
    """Set ``blocked`` (k,) bool for points (k, 3) before which a triangle of :class:`Boxed` is."""
    stack = np.empty(64, np.int64)
    leaves = len(boxes) // 2
    for index in range(len(points)):
        x, y, z = eye[0], eye[1], eye[2]
        dx, dy, dz = points[index, 0] - x, points[index, 1] - y, points[index, 2] - z
        stack[0], count = 1, 1
        while count > 0 and not blocked[index]:
            count -= 1
            node = stack[count]
            if not _meets_box(boxes[node], x, y, z, dx, dy, dz):
                continue
            if node < leaves:
                stack[count], stack[count + 1] = 2 * node, 2 * node + 1
                count += 2
                continue
            for place in range((node - leaves) * _LEAF, (node - leaves + 1) * _LEAF):
                if _meets(triangles[place], x, y, z, dx, dy, dz):
                    blocked[index] = True
                    break


@inner_kernel
def blocked_by_voxels(eye, points, solid, blocked):
    """Set ``blocked`` (k,) bool for the points (k, 3), voxels, whose lines pass a solid voxel.

    Lines are looked at each half voxel.
    """
    nx, ny, nz = solid.shape
    for index in range(len(points)):
        towards = points[index] - eye
        steps = np.int64(np.ceil(2.0 * np.abs(towards).max()))
        for step in range(1, steps):
            share = step / steps
            i = np.int64(np.floor(eye[0] + share * towards[0]))
            j = np.int64(np.floor(eye[1] + share * towards[1]))
            k = np.int64(np.floor(eye[2] + share * towards[2]))
            if 0 <= i < nx and 0 <= j < ny and 0 <= k < nz and solid[i, j, k]:
                blocked[index] = True
                break
