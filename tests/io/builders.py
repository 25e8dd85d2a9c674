"""Small files made by hand, so that the readers are not tested with our own writers only."""

from __future__ import annotations

import json
import struct
from base64 import b64encode
from typing import Any

import numpy as np

from simplifier.geometry.occluder import Occluder

TETRAHEDRON_POINTS = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
TETRAHEDRON_FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]

TRIANGLE = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
FAN = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.5, 0.0]]

COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}


def tetrahedron(error_bound: float = float("inf")) -> Occluder:
    points = np.array(TETRAHEDRON_POINTS)
    return Occluder(points, np.array(TETRAHEDRON_FACES, dtype=np.int32), error_bound)


class GltfBuilder:
    """Collects accessors in one buffer; ``root`` can be edited before it is written."""

    def __init__(self) -> None:
        self.binary = b""
        self.root: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "nodes": [],
            "meshes": [],
            "accessors": [],
            "bufferViews": [],
        }

    def view(self, data: bytes, stride: int = 0) -> int:
        self.binary += b"\0" * (-len(self.binary) % 4)
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        if stride:
            view["byteStride"] = stride
        self.root["bufferViews"].append(view)
        self.binary += data
        return len(self.root["bufferViews"]) - 1

    def accessor(self, values: Any, kind: str, dtype: str, **more: Any) -> int:
        array = np.asarray(values).astype("<" + dtype)
        entry = {
            "bufferView": self.view(array.tobytes()),
            "componentType": COMPONENTS[dtype],
            "count": len(array),
            "type": kind,
            **more,
        }
        self.root["accessors"].append(entry)
        return len(self.root["accessors"]) - 1

    def raw_accessor(self, **entry: Any) -> int:
        self.root["accessors"].append(entry)
        return len(self.root["accessors"]) - 1

    def mesh(self, points: Any, faces: Any = None, mode: int | None = None) -> int:
        primitive: dict[str, Any] = {
            "attributes": {"POSITION": self.accessor(points, "VEC3", "f4")}
        }
        if faces is not None:
            primitive["indices"] = self.accessor(np.ravel(faces), "SCALAR", "u2")
        if mode is not None:
            primitive["mode"] = mode
        return self.primitives(primitive)

    def primitives(self, *primitives: dict[str, Any]) -> int:
        self.root["meshes"].append({"primitives": list(primitives)})
        return len(self.root["meshes"]) - 1

    def node(self, **entry: Any) -> int:
        self.root["nodes"].append(entry)
        return len(self.root["nodes"]) - 1

    def json(self, **buffer: Any) -> bytes:
        root = {**self.root, "buffers": [{"byteLength": len(self.binary), **buffer}]}
        return json.dumps(root).encode()

    def glb(self) -> bytes:
        text, binary = self.json(), self.binary
        text += b" " * (-len(text) % 4)
        binary += b"\0" * (-len(binary) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def tetrahedron_gltf() -> GltfBuilder:
    """One node with a tetrahedron."""
    builder = GltfBuilder()
    builder.node(mesh=builder.mesh(TETRAHEDRON_POINTS, TETRAHEDRON_FACES))
    return builder


def ply(header: str, body: bytes, encoding: str = "ascii") -> bytes:
    """``header``: the element and property lines."""
    return f"ply\nformat {encoding} 1.0\n{header}end_header\n".encode("latin-1") + body


XYZ = "property float x\nproperty float y\nproperty float z\n"
FACE_LIST = "property list uchar int vertex_indices\n"
TETRAHEDRON_PLY_HEADER = f"element vertex 4\n{XYZ}element face 4\n{FACE_LIST}"


def text_ply() -> bytes:
    rows = [" ".join(map(str, point)) for point in TETRAHEDRON_POINTS]
    rows += ["3 " + " ".join(map(str, face)) for face in TETRAHEDRON_FACES]
    return ply(TETRAHEDRON_PLY_HEADER, "\n".join([*rows, ""]).encode())


def binary_ply(order: str = "<") -> bytes:
    name = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
    body = np.array(TETRAHEDRON_POINTS).astype(order + "f4").tobytes()
    for face in TETRAHEDRON_FACES:
        body += struct.pack(order + "B3i", 3, *face)
    return ply(TETRAHEDRON_PLY_HEADER, body, name)


def text_obj() -> bytes:
    rows = ["# a tetrahedron", "o body"]
    rows += ["v " + " ".join(map(str, point)) for point in TETRAHEDRON_POINTS]
    rows += ["f " + " ".join(str(index + 1) for index in face) for face in TETRAHEDRON_FACES]
    return "\n".join([*rows, ""]).encode()


def text_off() -> bytes:
    rows = ["OFF", "4 4 6"]
    rows += [" ".join(map(str, point)) for point in TETRAHEDRON_POINTS]
    rows += ["3 " + " ".join(map(str, face)) for face in TETRAHEDRON_FACES]
    return "\n".join([*rows, ""]).encode()


def text_stl() -> bytes:
    rows = ["solid tetrahedron"]
    for face in TETRAHEDRON_FACES:
        rows += ["  facet normal 0 0 0", "    outer loop"]
        rows += ["      vertex " + " ".join(map(str, TETRAHEDRON_POINTS[index])) for index in face]
        rows += ["    endloop", "  endfacet"]
    return "\n".join([*rows, "endsolid tetrahedron", ""]).encode()


def binary_stl(header: bytes = b"made by hand") -> bytes:
    data = header.ljust(80, b" ") + struct.pack("<I", len(TETRAHEDRON_FACES))
    for face in TETRAHEDRON_FACES:
        corners = [value for index in face for value in TETRAHEDRON_POINTS[index]]
        data += struct.pack("<12fH", 0.0, 0.0, 0.0, *corners, 0)
    return data


def text_tres() -> bytes:
    points = ", ".join(str(value) for point in TETRAHEDRON_POINTS for value in point)
    faces = ", ".join(str(index) for face in TETRAHEDRON_FACES for index in face)
    return (
        '[gd_resource type="ArrayOccluder3D" format=3 uid="uid://abc"]\n\n[resource]\n'
        f"vertices = PackedVector3Array({points})\nindices = PackedInt32Array({faces})\n"
    ).encode()


def binary_occ() -> bytes:
    """One level around the origin, as ``docs/formats.md`` has it, byte by byte."""
    points = np.array(TETRAHEDRON_POINTS, "<f4").tobytes()
    indices = np.array(TETRAHEDRON_FACES, "<u2").tobytes()
    header = b"\x89OCC\r\n\x1a\n" + struct.pack("<IIQII", 1, 0, 272, 1, 128)
    header += struct.pack("<3d3f3f", 0, 0, 0, 0, 0, 0, 1, 1, 1) + struct.pack("<ddI28x", 0, 0, 0)
    level = struct.pack("<dddQQIIII8x", 0.5, float("nan"), 0.0, 192, 240, 4, 4, 2, 0)
    return header + level + points + indices.ljust(32, b"\0")


def valid_files() -> dict[str, tuple[str, bytes]]:
    """Name to (suffix, content): one tetrahedron in every kind of file that can be read."""
    gltf = tetrahedron_gltf()
    uri = "data:application/octet-stream;base64," + b64encode(gltf.binary).decode()
    return {
        "glb": (".glb", gltf.glb()),
        "gltf": (".gltf", gltf.json(uri=uri)),
        "ply text": (".ply", text_ply()),
        "ply little": (".ply", binary_ply("<")),
        "ply big": (".ply", binary_ply(">")),
        "obj": (".obj", text_obj()),
        "off": (".off", text_off()),
        "stl text": (".stl", text_stl()),
        "stl binary": (".stl", binary_stl()),
        "tres": (".tres", text_tres()),
        "occ": (".occ", binary_occ()),
    }
