"""Write an occluder, or a chain of levels, as a GLB that any viewer shows properly.

The bytes depend on the occluders alone.  Levels follow the extension MSFT_lod: the finest node, the
only one of the scene, names the coarser ones, so that a viewer without it shows the finest.

Occluders as meshes of one GLB: accessors, buffer views and the buffer that they lie in.

Vertices are float32 around the centre of the bounding box, and the centre stands as float64 in the
node's translation: so an occluder in map coordinates keeps its precision.  Normals are flat, the
material is a lit colour, double-sided unless the occluders are single-sided.

Write a mesh as a GLB for viewers: as small as it can be, and told where it lies.

Vertices are float32 around the centre of the bounding sphere, which stands as float64 in the node's
translation, as in the GLB of an occluder: shown together, they fit at any distance from the origin.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.occluder import LodChain, Occluder
from simplifier.geometry.views import BoundingSphere
from simplifier.io.float32 import Float32Array, box_centre, to_float32, unit_normals
from simplifier.io.gltf import GENERATOR
from simplifier.io.gltf_container import pack_glb
from simplifier.io.gltf_levels import EXTENSION


def encode(occluder: Occluder) -> bytes:
    """A GLB with one node "occluder" and, unless there is no face, one mesh.

    The extras of node and mesh hold the generator, the number of triangles and, when finite, the
    error bound.  Raises :class:`OutputError` when the occluder does not fit float32.
    """
    extras, meshes = occluder_extras(occluder), GlbMeshes()
    node = {"name": "occluder", "extras": extras, **meshes.add(occluder, extras)}
    return pack_glb(_root([node]) | meshes.document(), meshes.binary)


def encode_lods(chain: LodChain) -> bytes:
    """A GLB with a node a level, finest first, "occluder_lod0" and so on.

    The extras of a node also hold its level, resolution, deviation, switch distance, and the screen
    and pixel error that this is for; those of the finest the screen coverages too.  Raises
    :class:`OutputError` when an occluder does not fit float32.
    """
    meshes = GlbMeshes()
    nodes = [
        {
            "name": f"occluder_lod{index}",
            "extras": _level_extras(chain, index),
            **meshes.add(level.occluder, occluder_extras(level.occluder)),
        }
        for index, level in enumerate(chain.levels)
    ]
    root = _root(nodes)
    if len(nodes) > 1:
        nodes[0]["extensions"] = {EXTENSION: {"ids": list(range(1, len(nodes)))}}
        nodes[0]["extras"]["MSFT_screencoverage"] = screen_coverages(chain)
        root["extensionsUsed"] = [EXTENSION]
    return pack_glb(root | meshes.document(), meshes.binary)


def screen_coverages(chain: LodChain) -> list[float]:
    """The least share of the screen's height from which each level is shown; 0 for the last.

    It is that of the finest occluder's bounding sphere where its near side is at the distance from
    which the next level is good enough: what a viewer that has only this file can find out itself.
    """
    occluder = chain.levels[0].occluder
    corners = occluder.vertices[occluder.faces].reshape(-1, 3)
    if len(corners) == 0:
        return [0.0] * len(chain.levels)
    centre = corners.min(axis=0) / 2.0 + corners.max(axis=0) / 2.0
    radius = float(np.linalg.norm(corners - centre, axis=1).max())
    distances = [chain.switch_distance(index) for index in range(1, len(chain.levels))]
    return [*(_coverage(chain, radius, distance) for distance in distances), 0.0]


def _coverage(chain: LodChain, radius: float, distance: float) -> float:
    """The outline of a sphere, ``distance`` from its near side, in screen heights, at most 1."""
    tangent = math.sqrt(distance) * math.sqrt(distance + 2.0 * radius)
    diameter = 2.0 * radius * chain.lens.focal
    return diameter / (tangent * chain.lens.rows) if diameter < tangent * chain.lens.rows else 1.0


def _root(nodes: list[dict[str, Any]]) -> dict[str, Any]:
    """A scene of the first node."""
    return {
        "asset": {"version": "2.0", "generator": GENERATOR},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": nodes,
    }


def occluder_extras(occluder: Occluder) -> dict[str, Any]:
    """What a node tells of its occluder."""
    extras: dict[str, Any] = {"generator": GENERATOR, "triangles": len(occluder.faces)}
    if math.isfinite(occluder.error_bound):
        extras["error_bound"] = float(occluder.error_bound)
    return extras


def _level_extras(chain: LodChain, index: int) -> dict[str, Any]:
    level, distance = chain.levels[index], chain.switch_distance(index)
    extras = occluder_extras(level.occluder) | {
        "level": index,
        "resolution": level.resolution,
        "deviation": float(level.deviation),
        "lens": {
            "screen_height": chain.lens.rows,
            "fov": float(chain.lens.fov),
            "pixel_error": float(chain.pixel_error),
        },
    }
    if math.isfinite(distance):
        extras["switch_distance"] = distance
    return extras


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
