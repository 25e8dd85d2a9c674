"""Write a mesh as a GLB for viewers: as small as it can be, and told where it lies.

Vertices are float32 around the centre of the bounding sphere, which stands as float64 in the node's
translation, as in the GLB of an occluder: shown together, they fit at any distance from the origin.
"""

from __future__ import annotations

import numpy as np

from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.views import BoundingSphere
from simplifier.io.float32 import to_float32
from simplifier.io.gltf import GENERATOR
from simplifier.io.gltf_container import pack_glb

_FLOAT, _SHORT, _INT = 5126, 5123, 5125
_VERTEX_DATA, _INDEX_DATA = 34962, 34963
_TRIANGLES = 4


def encode_surface(mesh: TriangleMesh, sphere: BoundingSphere) -> bytes:
    """One node "original"; its extras hold ``bounding_sphere``: ``centre`` and ``radius``.

    Vertices that no triangle uses are left out, and there are no normals.  Raises
    :class:`OutputError` when the mesh does not fit float32.
    """
    used, faces = np.unique(mesh.faces, return_inverse=True)
    points = to_float32(mesh.vertices[used] - sphere.centre)
    vertices = points.astype("<f4").tobytes()
    indices = faces.astype("<u4").tobytes()
    document = {
        "asset": {"version": "2.0", "generator": GENERATOR},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {
                "name": "original",
                "mesh": 0,
                "translation": sphere.centre.tolist(),
                "extras": {
                    "bounding_sphere": {
                        "centre": sphere.centre.tolist(),
                        "radius": sphere.radius,
                    }
                },
            }
        ],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": _TRIANGLES}]}
        ],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": _FLOAT,
                "count": len(points),
                "type": "VEC3",
                "min": points.min(axis=0).tolist(),
                "max": points.max(axis=0).tolist(),
            },
            {
                "bufferView": 1,
                "componentType": _INT,
                "count": mesh.faces.size,
                "type": "SCALAR",
            },
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": len(vertices), "target": _VERTEX_DATA},
            {
                "buffer": 0,
                "byteOffset": len(vertices),
                "byteLength": len(indices),
                "target": _INDEX_DATA,
            },
        ],
        "buffers": [{"byteLength": len(vertices) + len(indices)}],
    }
    return pack_glb(document, vertices + indices)
