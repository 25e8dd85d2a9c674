"""Small files made by hand, so that the readers are not tested with our own writers only."""

from __future__ import annotations

import io
import json
import struct
import zipfile
from base64 import b64encode
from typing import Any

import numpy as np

from simplifier.geometry.occluder import Occluder
from tests.solids import box

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


MODEL_3MF = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"\n'
    ' xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06">\n'
    "<resources>\n{resources}</resources>\n<build>\n{build}</build>\n</model>\n"
)
_RELATIONSHIPS = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="rel0"'
    ' Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)


def mesh_3mf(points: Any, faces: Any) -> str:
    """The element of a 3MF object with such triangles."""
    vertices = "".join(f'<vertex x="{x!r}" y="{y!r}" z="{z!r}"/>\n' for x, y, z in points)
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>\n' for a, b, c in faces)
    return (
        f"<mesh>\n<vertices>\n{vertices}</vertices>\n"
        f"<triangles>\n{triangles}</triangles>\n</mesh>\n"
    )


def zipped(parts: dict[str, str | bytes], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    """A ZIP archive, the same bytes every time."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as archive:
        for name, content in parts.items():
            info = zipfile.ZipInfo(name)
            info.compress_type = method
            archive.writestr(info, content)
    return file.getvalue()


def package_3mf(resources: str, build: str, **others: str) -> bytes:
    """A 3MF file; ``others`` are models beside the main one, by their names."""
    parts: dict[str, str | bytes] = {
        "_rels/.rels": _RELATIONSHIPS,
        "3D/3dmodel.model": MODEL_3MF.format(resources=resources, build=build),
    }
    parts |= {f"3D/{name}.model": content for name, content in others.items()}
    return zipped(parts)


def tetrahedron_3mf() -> bytes:
    mesh = mesh_3mf(TETRAHEDRON_POINTS, TETRAHEDRON_FACES)
    body = f'<object id="1" name="body" type="model">{mesh}</object>\n'
    return package_3mf(body, '<item objectid="1"/>\n')


def collada(geometries: str, nodes: str, libraries: str = "") -> bytes:
    """A COLLADA file with one scene."""
    return (
        '<?xml version="1.0" encoding="utf-8"?>\n'
        '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">\n'
        '<asset><unit meter="0.01" name="centimeter"/><up_axis>Z_UP</up_axis></asset>\n'
        f"<library_geometries>\n{geometries}</library_geometries>\n{libraries}"
        f'<library_visual_scenes><visual_scene id="scene">\n{nodes}</visual_scene>\n'
        "</library_visual_scenes>\n"
        '<scene><instance_visual_scene url="#scene"/></scene>\n</COLLADA>\n'
    ).encode()


def geometry_dae(name: str, points: Any, primitives: str) -> str:
    """A geometry with positions alone, whose primitives name ``#NAME-vertices``."""
    numbers = " ".join(repr(float(value)) for point in points for value in point)
    return (
        f'<geometry id="{name}" name="{name}"><mesh>\n<source id="{name}-positions">\n'
        f'<float_array id="{name}-array" count="{3 * len(points)}">{numbers}</float_array>\n'
        f'<technique_common><accessor source="#{name}-array" count="{len(points)}" stride="3">'
        '<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>'
        f'</accessor></technique_common>\n</source>\n<vertices id="{name}-vertices">'
        f'<input semantic="POSITION" source="#{name}-positions"/></vertices>\n'
        f"{primitives}\n</mesh></geometry>\n"
    )


def triangles_dae(name: str, faces: Any) -> str:
    """Triangles of a geometry."""
    corners = " ".join(str(index) for face in faces for index in face)
    return (
        f'<triangles count="{len(faces)}" material="stone">'
        f'<input semantic="VERTEX" source="#{name}-vertices" offset="0"/>\n'
        f"<p>{corners}</p></triangles>"
    )


def tetrahedron_dae() -> bytes:
    body = triangles_dae("body", TETRAHEDRON_FACES)
    return collada(
        geometry_dae("body", TETRAHEDRON_POINTS, body),
        '<node id="node"><instance_geometry url="#body"/></node>\n',
    )


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
        "3mf": (".3mf", tetrahedron_3mf()),
        "dae": (".dae", tetrahedron_dae()),
    }


def cubes(*materials):
    """A scene of a unit cube for each glTF material, side by side along x: a glb's bytes."""
    builder, solid = GltfBuilder(), box()
    builder.root["materials"] = list(materials)
    primitives = [
        {
            "attributes": {
                "POSITION": builder.accessor(
                    solid.vertices + np.array([3.0 * number, 0, 0]), "VEC3", "f4"
                )
            },
            "indices": builder.accessor(solid.faces.ravel(), "SCALAR", "u2"),
            "material": number,
        }
        for number in range(len(materials))
    ]
    builder.node(mesh=builder.primitives(*primitives))
    return builder.glb()
