"""Write a scene as a GLB: every mesh once, a node for each object.

Positions are float32 and the transforms of the nodes float64.  A mesh whose coordinates float32
would round is stored around the centre of its bounding box, and the nodes make up for it, so that
a mesh in map coordinates keeps its precision.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.checks import as_path
from simplifier.errors import OutputError
from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.io.files import write_whole
from simplifier.io.float32 import Float32Array, to_float32
from simplifier.io.gltf import GENERATOR
from simplifier.io.gltf_container import pack_glb

_FLOAT, _INT = 5126, 5125
_VERTEX_DATA, _INDEX_DATA = 34962, 34963
_SQUARE = 1e-12  # cosine between axes that still counts as a right angle
_MATERIAL = {
    "doubleSided": True,
    "pbrMetallicRoughness": {
        "baseColorFactor": (0.7, 0.7, 0.68, 1.0),
        "metallicFactor": 0.0,
        "roughnessFactor": 0.9,
    },
}


def write_scene(scene: Scene, path: str | Path) -> None:
    """Write ``.glb``; the file appears whole or not at all.

    An object's node has its name.  A transform with shear, which one node cannot hold, becomes that
    of an unnamed node around it.  Raises :class:`OutputError`, also for another suffix.
    """
    path = as_path("path", path)
    if path.suffix.lower() != ".glb":
        raise OutputError(
            f"scenes cannot be written as '{path.suffix}'", where=str(path), remedy="use .glb"
        )
    if not len(scene):
        raise OutputError("the scene has no object", where=str(path), remedy="load or make one")
    try:
        data = encode_scene(scene)
    except OutputError as error:
        raise OutputError(error.what, where=str(path), remedy=error.remedy) from None
    write_whole(path, data)


def encode_scene(scene: Scene) -> bytes:
    """The content of the file.  Raises :class:`OutputError` where it does not fit float32."""
    stored = [_store_vertices(mesh) for mesh in scene.meshes]
    centres = np.array([centre for _, centre in stored]).reshape(-1, 3)[scene.mesh_of]
    transforms = scene.transforms.copy()
    transforms[:, :3, 3] += np.einsum("nij,nj->ni", transforms[:, :3, :3], centres)
    nodes, roots = _nodes(scene, transforms)
    accessors, views, binary = _geometry([points for points, _ in stored], scene.meshes)
    document = {
        "asset": {"version": "2.0", "generator": GENERATOR},
        "scene": 0,
        "scenes": [{"nodes": roots}],
        "nodes": nodes,
        "materials": [_MATERIAL],
        "meshes": [
            {
                "primitives": [
                    {"attributes": {"POSITION": 2 * i}, "indices": 2 * i + 1, "material": 0}
                ]
            }
            for i in range(len(stored))
        ],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(binary)}],
    }
    return pack_glb(document, binary)


def _store_vertices(mesh: TriangleMesh) -> tuple[Float32Array, FloatArray]:
    """The vertices as they are where float32 holds them, else around a centre; and that centre."""
    with np.errstate(over="ignore", under="ignore"):
        rounded = mesh.vertices.astype(np.float32)
    if (mesh.vertices == rounded).all():
        return rounded, np.zeros(3)
    centre = mesh.bounds.mean(axis=0)
    return to_float32(mesh.vertices - centre), centre


def _geometry(
    points: Sequence[Float32Array], meshes: Sequence[TriangleMesh]
) -> tuple[list[dict[str, Any]], list[dict[str, Any]], bytes]:
    """Accessors, two for each mesh, the two buffer views, and the bytes of these."""
    accessors: list[dict[str, Any]] = []
    place = [0, 0]
    for mesh, corners in zip(meshes, points, strict=True):
        accessors += [
            {
                "bufferView": 0,
                "byteOffset": place[0],
                "componentType": _FLOAT,
                "count": len(corners),
                "type": "VEC3",
                "min": corners.min(axis=0).tolist(),
                "max": corners.max(axis=0).tolist(),
            },
            {
                "bufferView": 1,
                "byteOffset": place[1],
                "componentType": _INT,
                "count": mesh.faces.size,
                "type": "SCALAR",
            },
        ]
        place = [place[0] + corners.size * 4, place[1] + mesh.faces.size * 4]
    views = [
        {"buffer": 0, "byteLength": place[0], "byteStride": 12, "target": _VERTEX_DATA},
        {"buffer": 0, "byteOffset": place[0], "byteLength": place[1], "target": _INDEX_DATA},
    ]
    parts = [corners.astype("<f4").tobytes() for corners in points]
    return (
        accessors,
        views,
        b"".join(parts + [mesh.faces.astype("<u4").tobytes() for mesh in meshes]),
    )


def _nodes(scene: Scene, transforms: FloatArray) -> tuple[list[dict[str, Any]], list[int]]:
    """The nodes, and which of them stand in the scene itself."""
    nodes: list[dict[str, Any]] = []
    roots: list[int] = []
    sheared = _are_sheared(transforms[:, :3, :3])
    for name, mesh, transform, split in zip(
        scene.names, scene.mesh_of.tolist(), transforms, sheared.tolist(), strict=True
    ):
        roots.append(len(nodes))
        own = transform
        if split:
            outer, own = _without_shear(transform)
            nodes.append({**_place(outer), "children": [len(nodes) + 1]})
        nodes.append({"name": name, "mesh": mesh, **_place(own)})
    return nodes, roots


def _are_sheared(linear: FloatArray) -> NDArray[np.bool_]:
    """(n,) whether the axes do not stay at right angles, which a glTF node asks for."""
    axes = linear / np.abs(linear).max(axis=(1, 2), keepdims=True)  # squares must not vanish
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    cosines = axes.transpose(0, 2, 1) @ axes - np.eye(3)
    return np.asarray((np.abs(cosines) > _SQUARE).any(axis=(1, 2)))


def _without_shear(transform: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two transforms without shear, the outer and the inner, that make up this one."""
    turn, stretch, inner_turn = np.linalg.svd(transform[:3, :3])
    outer, inner = transform.copy(), np.eye(4)
    outer[:3, :3] = turn * stretch
    inner[:3, :3] = inner_turn
    return outer, inner


def _place(transform: FloatArray) -> dict[str, list[float]]:
    """The members of a node that tell its transform, none where it has none."""
    if (transform == np.eye(4)).all():
        return {}
    return {"matrix": [float(value) for value in transform.T.ravel()]}
