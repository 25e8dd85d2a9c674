"""Write an occluder as a GLB that any viewer shows properly.

Vertices are float32 around the centre of the bounding box, and the centre stands as float64 in the
node's translation: so an occluder in map coordinates keeps its precision.  Normals are flat, the
material is a lit colour and double-sided.  The bytes depend on the occluder alone.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import OutputError
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.occluder import Occluder
from simplifier.io.float32 import Float32Array, to_float32, unit_normals
from simplifier.io.gltf import GENERATOR
from simplifier.io.gltf_container import pack_glb

_FLOAT, _SHORT, _INT = 5126, 5123, 5125
_VERTEX_DATA, _INDEX_DATA = 34962, 34963
_ORANGE = (0.9, 0.42, 0.12, 1.0)


def encode(occluder: Occluder) -> bytes:
    """A GLB with one node "occluder" and, unless there is no face, one mesh.

    The extras of node and mesh hold the generator, the number of triangles and, when finite, the
    error bound.  Raises :class:`OutputError` when the occluder does not fit float32.
    """
    extras: dict[str, Any] = {"generator": GENERATOR, "triangles": len(occluder.faces)}
    if math.isfinite(occluder.error_bound):
        extras["error_bound"] = float(occluder.error_bound)
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": GENERATOR},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "occluder", "extras": extras}],
    }
    binary = b""
    if len(occluder.faces):
        centre = _centre(occluder)
        document["nodes"][0] |= {"mesh": 0, "translation": centre.tolist()}
        mesh, binary = _mesh(occluder.vertices[occluder.faces] - centre, occluder.faces)
        document |= mesh
        document["meshes"][0]["extras"] = extras
    return pack_glb(document, binary)


def _centre(occluder: Occluder) -> FloatArray:
    """Middle of the bounding box of the vertices that are used."""
    corners = occluder.vertices[occluder.faces].reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    with np.errstate(over="ignore"):
        extent = high - low
    if not np.isfinite(extent).all():
        raise OutputError("the occluder is too large for 64-bit numbers", remedy="scale it down")
    return np.asarray(low + extent / 2.0)


def _mesh(corners: FloatArray, faces: NDArray[np.int32]) -> tuple[dict[str, Any], bytes]:
    """The JSON of mesh, material, accessors and buffer, and the buffer's bytes."""
    points, normals, indices = _flat_shaded(corners, faces)
    short = len(points) < 65535  # the last index means "restart" to a graphics card
    stored = indices.astype("<u2" if short else "<u4")
    parts = [points.astype("<f4").tobytes(), normals.astype("<f4").tobytes(), stored.tobytes()]
    offsets = [0, len(parts[0]), len(parts[0]) + len(parts[1])]
    vector = {"componentType": _FLOAT, "count": len(points), "type": "VEC3"}
    material = {
        "name": "occluder",
        "doubleSided": True,
        "pbrMetallicRoughness": {
            "baseColorFactor": _ORANGE,
            "metallicFactor": 0.0,
            "roughnessFactor": 0.9,
        },
    }
    primitive = {"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2, "material": 0, "mode": 4}
    bounds = {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}
    index_kind = {"componentType": _SHORT if short else _INT, "count": stored.size}
    document = {
        "materials": [material],
        "meshes": [{"name": "occluder", "primitives": [primitive]}],
        "accessors": [
            {"bufferView": 0, **vector, **bounds},
            {"bufferView": 1, **vector},
            {"bufferView": 2, **index_kind, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": offset, "byteLength": len(part), "target": target}
            for offset, part, target in zip(
                offsets, parts, (_VERTEX_DATA, _VERTEX_DATA, _INDEX_DATA), strict=True
            )
        ],
        "buffers": [{"byteLength": sum(map(len, parts))}],
    }
    return document, b"".join(parts)


def _flat_shaded(
    corners: FloatArray, faces: NDArray[np.int32]
) -> tuple[Float32Array, Float32Array, NDArray[np.int64]]:
    """Positions, normals and (3 m,) indices; triangles of one plane share their vertices."""
    normals = np.repeat(unit_normals(corners), 3, axis=0)
    positions = to_float32(corners.reshape(-1, 3))
    keys = np.column_stack([faces.reshape(-1, 1), normals.view(np.int32)])
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return positions[first], normals[first], inverse.reshape(-1)
