"""Occluders as meshes of one GLB: accessors, buffer views and the buffer that they lie in.

Vertices are float32 around the centre of the bounding box, and the centre stands as float64 in the
node's translation: so an occluder in map coordinates keeps its precision.  Normals are flat, the
material is a lit colour, double-sided unless the occluders are single-sided.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.occluder import Occluder
from simplifier.io.float32 import Float32Array, box_centre, to_float32, unit_normals

_FLOAT, _SHORT, _INT = 5126, 5123, 5125
_VERTEX_DATA, _INDEX_DATA = 34962, 34963
_ORANGE = (0.9, 0.42, 0.12, 1.0)


class GlbMeshes:
    """Collects meshes that share a buffer and a material."""

    def __init__(self) -> None:
        self.binary = b""
        self._meshes: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []
        self._views: list[dict[str, Any]] = []
        self._double_sided = False

    def add(self, occluder: Occluder, extras: dict[str, Any]) -> dict[str, Any]:
        """The members of the node that shows the occluder; none for one without a face.

        Raises :class:`OutputError` when it does not fit float32.
        """
        if len(occluder.faces) == 0:
            return {}
        self._double_sided |= not occluder.single_sided
        centre = box_centre(occluder.vertices[occluder.faces].reshape(-1, 3))
        points, normals, indices = _flat_shaded(
            occluder.vertices[occluder.faces] - centre, occluder.faces
        )
        place = {"mesh": len(self._meshes), "translation": centre.tolist()}
        primitive = self._primitive(points, normals, indices)
        self._meshes.append({"name": "occluder", "primitives": [primitive], "extras": extras})
        return place

    def document(self) -> dict[str, Any]:
        """The members of the root; none without a mesh, for the format forbids empty arrays."""
        if not self._meshes:
            return {}
        return {
            "materials": [_MATERIAL | {"doubleSided": self._double_sided}],
            "meshes": self._meshes,
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": len(self.binary)}],
        }

    def _primitive(
        self, points: Float32Array, normals: Float32Array, indices: NDArray[np.int64]
    ) -> dict[str, Any]:
        short = len(points) < 65535  # the last index means "restart" to a graphics card
        stored = indices.astype("<u2" if short else "<u4")
        vector = {"componentType": _FLOAT, "count": len(points), "type": "VEC3"}
        bounds = {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}
        index_kind = {"componentType": _SHORT if short else _INT, "count": stored.size}
        position = self._accessor(points.astype("<f4").tobytes(), _VERTEX_DATA, vector | bounds)
        normal = self._accessor(normals.astype("<f4").tobytes(), _VERTEX_DATA, vector)
        corners = self._accessor(stored.tobytes(), _INDEX_DATA, index_kind | {"type": "SCALAR"})
        return {
            "attributes": {"POSITION": position, "NORMAL": normal},
            "indices": corners,
            "material": 0,
            "mode": 4,
        }

    def _accessor(self, data: bytes, target: int, kind: dict[str, Any]) -> int:
        """Its number; the data begin at a multiple of 4 bytes."""
        self.binary += b"\0" * (-len(self.binary) % 4)
        self._accessors.append({"bufferView": len(self._views), **kind})
        self._views.append(
            {
                "buffer": 0,
                "byteOffset": len(self.binary),
                "byteLength": len(data),
                "target": target,
            }
        )
        self.binary += data
        return len(self._accessors) - 1


_MATERIAL = {
    "name": "occluder",
    "doubleSided": True,
    "pbrMetallicRoughness": {
        "baseColorFactor": _ORANGE,
        "metallicFactor": 0.0,
        "roughnessFactor": 0.9,
    },
}


def _flat_shaded(
    corners: FloatArray, faces: NDArray[np.int32]
) -> tuple[Float32Array, Float32Array, NDArray[np.int64]]:
    """Positions, normals and (3 m,) indices; triangles of one plane share their vertices."""
    normals = np.repeat(unit_normals(corners), 3, axis=0)
    positions = to_float32(corners.reshape(-1, 3))
    keys = np.column_stack([faces.reshape(-1, 1), normals.view(np.int32)])
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return positions[first], normals[first], inverse.reshape(-1)
