"""Transforms of glTF nodes, all of a file at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simplifier.geometry.mesh import FloatArray
from simplifier.io.gltf_json import JsonObject

_PROJECTION = 1e-6  # what rounding may leave in the last row of a matrix
_MATRIX_OF_NONE = [float(i % 5 == 0) for i in range(16)]


def local_transforms(nodes: Sequence[JsonObject], *, lenient: bool) -> FloatArray:
    """(n, 4, 4) float64 of nodes by matrix, by translation, rotation and scale, or by neither.

    Raises ``UnreadableMeshError`` for arrays of a wrong length, and unless ``lenient`` for matrices
    that are not affine and for values that are no finite numbers, which become NaN otherwise.
    """
    result = np.empty((len(nodes), 4, 4))
    parts: dict[int, list[float]] = {}
    for place, node in enumerate(nodes):
        matrix = _numbers(node, "matrix", 16, lenient)
        if matrix is not None and not lenient and not _is_affine(matrix):
            raise node.fail(
                f"the last row of its matrix is {matrix[3::4]}, not 0 0 0 1",
                "take the projection out of the node",
            )
        if matrix is None and any(node.has(key) for key in ("translation", "rotation", "scale")):
            parts[place] = [
                *(_numbers(node, "translation", 3, lenient) or (0.0, 0.0, 0.0)),
                *(_numbers(node, "rotation", 4, lenient) or (0.0, 0.0, 0.0, 1.0)),
                *(_numbers(node, "scale", 3, lenient) or (1.0, 1.0, 1.0)),
            ]
        result[place].flat = matrix or _MATRIX_OF_NONE
    result = result.transpose(0, 2, 1)  # stored by columns
    if parts:
        values = np.array(list(parts.values()))
        result[list(parts)] = transforms_of(values[:, :3], values[:, 3:7], values[:, 7:])
    return result


def _is_affine(matrix: Sequence[float]) -> bool:
    rest = (matrix[3], matrix[7], matrix[11], matrix[15] - 1.0)
    return max(map(abs, rest)) <= _PROJECTION


def _numbers(node: JsonObject, key: str, length: int, lenient: bool) -> list[float] | None:
    if not node.has(key):
        return None
    return node.numbers_or_nan(key, length) if lenient else node.numbers(key, length)


def transforms_of(
    translations: FloatArray, rotations: FloatArray, scales: FloatArray
) -> FloatArray:
    """(n, 4, 4): scale (n, 3), then rotate by quaternions x y z w (n, 4), then translate (n, 3).

    Quaternions are normalized here, and one of length 0 does not rotate.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        lengths = np.linalg.norm(rotations, axis=1, keepdims=True)
        x, y, z, w = (rotations / np.where(lengths == 0.0, 1.0, lengths)).T
        rows = [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
        ]
        result = np.zeros((len(translations), 4, 4))
        result[:, :3, :3] = np.array(rows).transpose(2, 0, 1) * scales[:, None, :]
    result[:, :3, 3] = translations
    result[:, 3, 3] = 1.0
    return result


def world_transforms(local: FloatArray, parents: Sequence[int]) -> FloatArray:
    """(n, 4, 4): each after that of its parent, an earlier place, or -1 for none."""
    depth = np.zeros(len(local), dtype=np.int64)
    for place, parent in enumerate(parents):
        if parent >= 0:
            depth[place] = depth[parent] + 1
    by_depth = np.argsort(depth, kind="stable")
    levels = np.split(by_depth, np.cumsum(np.bincount(depth))[:-1]) if len(local) else []
    world, above = local.copy(), np.asarray(parents, dtype=np.int64)
    with np.errstate(invalid="ignore", over="ignore"):
        for places in levels[1:]:
            world[places] = world[above[places]] @ local[places]
    return world
