"""Files that no exporter should have written, and what has to come of each."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from simplifier.errors import EmptyMeshError, MeshError, UnreadableMeshError
from tests.io.builders import (
    TETRAHEDRON_FACES,
    TETRAHEDRON_POINTS,
    TRIANGLE,
    XYZ,
    ply,
    tetrahedron_gltf,
    text_obj,
    text_off,
    valid_files,
)


@dataclass(frozen=True)
class Refused:
    """``words``: a pattern of the message, which also names the file and says what to do."""

    suffix: str
    data: bytes
    words: str
    error: type[MeshError] = UnreadableMeshError


@dataclass(frozen=True)
class Usable:
    """``triangles`` are left; ``dropped`` by reason are not."""

    suffix: str
    data: bytes
    triangles: int = 4
    dropped: dict[str, int] = field(default_factory=dict)


# --- coordinates and indices


def obj(*lines: str) -> bytes:
    """The tetrahedron, then more."""
    return text_obj() + "\n".join([*lines, ""]).encode()


def with_vertex(x: str) -> bytes:
    """The tetrahedron, and a triangle to a fifth vertex."""
    return obj(f"v {x} 0.5 0.5", "f 1 2 5")


def of_scale(number: float) -> bytes:
    """Nothing but a tetrahedron of that size."""
    rows = [f"v {' '.join(repr(c * number) for c in point)}" for point in TETRAHEDRON_POINTS]
    rows += [f"f {' '.join(str(corner + 1) for corner in face)}" for face in TETRAHEDRON_FACES]
    return "\n".join(rows).encode()


def ply_of_indices(kind: str, code: str, last: int) -> bytes:
    """A triangle whose list is of 64-bit numbers."""
    header = f"element vertex 3\n{XYZ}element face 1\nproperty list uchar {kind} vertex_indices\n"
    body = np.array(TRIANGLE, "<f4").tobytes() + struct.pack(f"<B3{code}", 3, 0, 1, last)
    return ply(header, body, "binary_little_endian")


COORDINATES: dict[str, Usable | Refused] = {
    "a corner that is not a number": Usable(".obj", with_vertex("nan"), 4, {"non_finite": 1}),
    "an infinite corner": Usable(".obj", with_vertex("-inf"), 4, {"non_finite": 1}),
    "a corner beyond all floats": Usable(".obj", with_vertex("1e400"), 4, {"non_finite": 1}),
    "a corner at 1e300": Usable(".obj", with_vertex("1e300"), 4, {"non_finite": 1}),
    "a corner at 1e30": Usable(".obj", with_vertex("1e30"), 4, {"far_away": 1}),
    "a corner at 1e6": Usable(".obj", with_vertex("1e6"), 5),
    "a corner just off the origin": Usable(".obj", with_vertex("5e-324"), 5),
    "nothing but numbers of 1e30": Usable(".obj", of_scale(1e30)),
    "nothing but NaN": Refused(
        ".obj", b"v nan 0 0\nv 0 nan 0\nv 0 0 nan\nf 1 2 3\n", "none of the 1 tri", EmptyMeshError
    ),
    "nothing but flat triangles": Refused(
        ".obj", b"v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\nf 3 2 1\n", "none of the 2", EmptyMeshError
    ),
    "nothing but repeated corners": Refused(
        ".obj", b"v 0 0 0\nv 1 0 0\nf 1 1 2\nf 2 2 2\n", "none of the 2 triangles", EmptyMeshError
    ),
    "an index of 64 bits": Usable(".ply", ply_of_indices("int64", "q", 2), 1),
    "an unsigned index of 64 bits": Usable(".ply", ply_of_indices("uint64", "Q", 2), 1),
    "an index of 2**63 - 1": Refused(
        ".ply", ply_of_indices("int64", "q", 2**63 - 1), "names vertex 9223372036854775807"
    ),
    "an index of 2**64 - 1": Refused(
        ".ply", ply_of_indices("uint64", "Q", 2**64 - 1), "18446744073709551615 is not the index"
    ),
}

# --- text

_FILES = valid_files()
TEXT_KINDS = ("gltf", "obj", "off", "ply text", "stl text", "tres")


def respelt(kind: str, old: str, new: str) -> bytes:
    data = _FILES[kind][1]
    assert old.encode() in data
    return data.replace(old.encode(), new.encode())


def encoded(kind: str, encoding: str) -> bytes:
    return _FILES[kind][1].decode().encode(encoding)


def _texts() -> dict[str, Usable | Refused]:
    cases: dict[str, Usable | Refused] = {}
    for kind in TEXT_KINDS:
        suffix, data = _FILES[kind]
        cases |= {
            f"{kind} in UTF-16": Refused(suffix, encoded(kind, "utf-16"), "UTF-16"),
            f"{kind} in UTF-32": Refused(suffix, encoded(kind, "utf-32"), "UTF-32"),
            f"{kind} in EBCDIC": Refused(suffix, encoded(kind, "cp500"), "mesh"),
            f"{kind} of mixed line ends": Usable(suffix, mixed(data)),
        }
        if kind == "ply text":  # where the header ends has to be sure: bytes may follow
            cases[f"{kind} of mixed line ends"] = Refused(suffix, mixed(data), "end_header")
        if kind != "stl text":  # whose 80 bytes of binary header may be anything
            for order in ("le", "be"):
                name = f"{kind} in UTF-16 {order} without a mark"
                cases[name] = Refused(suffix, encoded(kind, f"utf-16-{order}"), "UTF-16")
        if kind not in ("gltf", "tres"):
            cases[f"{kind} with decimal commas"] = Refused(
                suffix, data.replace(b".0", b",0"), "line .*'0,0' is not a number; write decimals"
            )
            cases[f"{kind} with form feeds and tabs"] = Usable(
                suffix, data.replace(b" ", b"\f") if kind == "obj" else data.replace(b" ", b"\t")
            )
    return cases


def mixed(data: bytes) -> bytes:
    """Lines that end in LF, CR and CR LF by turns."""
    ends = (b"\n", b"\r", b"\r\n")
    lines = data.split(b"\n")
    return b"".join(line + ends[k % 3] for k, line in enumerate(lines[:-1])) + lines[-1]


LONG = 1 << 20

TEXTS = {
    **_texts(),
    "obj with a line of a megabyte": Usable(".obj", text_obj() + b"#" + b"x" * LONG + b"\n"),
    "obj with a name of a megabyte": Usable(".obj", b"o " + b"x" * LONG + b"\n" + text_obj()),
    "obj with comments behind numbers": Usable(".obj", respelt("obj", "0.0\n", "0.0 # 1,5\n")),
    "off with comments behind numbers": Usable(".off", respelt("off", "0.0\n", "0.0 # 1,5\n")),
    "off behind 100,000 comments": Usable(".off", b"# nothing\n" * 100_000 + text_off()),
    "ply with comments in its header": Usable(
        ".ply", respelt("ply text", "element face", "comment caf\u00e9, 1,5\nelement face")
    ),
    "tres with comments behind arrays": Usable(".tres", respelt("tres", ")\n", ") ; drawn\n")),
    "obj with zeros behind its end": Usable(".obj", text_obj() + b"\0" * 512),
    "obj with zeros between words": Refused(".obj", respelt("obj", " ", "\0"), "no text"),
    "off with zeros between words": Refused(".off", respelt("off", " ", "\0"), "not a number"),
    "ply with zeros between words": Refused(".ply", respelt("ply text", " ", "\0"), "header line"),
    "obj with unbreakable blanks": Refused(".obj", respelt("obj", " ", "\u00a0"), "no vertex"),
    "obj with another alphabet's digits": Refused(
        ".obj", respelt("obj", "1.0", "\u0661.0"), "not a number"
    ),
    "obj with another minus": Refused(".obj", respelt("obj", "v 0.0", "v \u22120.0"), "a number"),
    "other text under .obj": Refused(".obj", b"lorem ipsum\n" * 10_000, "no vertex and no face"),
}

# --- glTF


def scene(change: Callable[[dict[str, Any]], object]) -> bytes:
    """A GLB of the tetrahedron, its JSON changed."""
    builder = tetrahedron_gltf()
    change(builder.root)
    return builder.glb()


def requiring(*names: str) -> bytes:
    return scene(lambda root: root.update(extensionsRequired=list(names)))


def with_stride(stride: int) -> bytes:
    return scene(lambda root: root["bufferViews"][0].update(byteStride=stride))


def with_node(**members: Any) -> bytes:
    return scene(lambda root: root["nodes"][0].update(members))


def chained(count: int) -> bytes:
    """As many nodes, each the child of the next."""
    builder = tetrahedron_gltf()
    for index in range(count):
        builder.node(children=[index])
    return builder.glb()


def instanced(count: int) -> bytes:
    builder = tetrahedron_gltf()
    for index in range(1, count):
        builder.node(mesh=0, translation=[2.0 * index, 0.0, 0.0])
    return builder.glb()


def gltf_text(text: str) -> bytes:
    return f'{{"asset": {{"version": "2.0"}}, {text}}}'.encode()


PROJECTION = [1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]

GLTF: dict[str, Usable | Refused] = {
    "an extension of positions": Refused(".glb", requiring("CESIUM_RTC"), "'CESIUM_RTC', which"),
    "an extension that cannot be printed": Refused(".glb", requiring("\ud800\n"), "ud800"),
    "an extension of looks": Usable(
        ".glb", requiring("KHR_materials_unlit", "EXT_texture_webp", "KHR_technique_webgl")
    ),
    "draco": Refused(".glb", requiring("KHR_draco_mesh_compression"), "draco.*save it uncompr"),
    "meshopt": Refused(".glb", requiring("EXT_meshopt_compression"), "meshopt.*save it uncompr"),
    "elements that overlap": Refused(".glb", with_stride(3), "overlap: .* byteStride of 3"),
    "elements apart": Refused(".glb", with_stride(10**9), "reach beyond"),
    "a stride of 0": Usable(".glb", with_stride(0)),
    "a projection": Refused(".glb", with_node(matrix=PROJECTION), "take the projection out"),
    "a scale that overflows": Refused(
        ".glb", with_node(scale=[1e300] * 3), "none of the 4", EmptyMeshError
    ),
    "a scale of 0": Refused(".glb", with_node(scale=[0, 0, 0]), "none of the 4", EmptyMeshError),
    "a rotation of length 0": Usable(".glb", with_node(rotation=[0, 0, 0, 0])),
    "a newer least version": Refused(
        ".glb", scene(lambda root: root["asset"].update(minVersion="2.1")), "minVersion is '2.1'"
    ),
    "keys that stand twice": Refused(".gltf", gltf_text('"nodes": [], "nodes": []'), "twice"),
    "NaN in a matrix": Refused(".gltf", gltf_text('"nodes": [{"scale": [NaN, 1, 1]}]'), "numbers"),
    "a number of 100,000 digits": Refused(".gltf", gltf_text(f'"scene": {"9" * 100_000}'), "JSON"),
    "a scene of a whole number too large": Refused(
        ".gltf", gltf_text(f'"nodes": [{{}}], "scene": {"9" * 400}'), "'scene' is not a whole"
    ),
    "objects in objects": Refused(
        ".gltf", gltf_text('"extras": ' + '{"a":' * 200_000 + "1" + "}" * 200_000), "recursion"
    ),
    "data that are not base64": Refused(
        ".gltf", tetrahedron_gltf().json(uri="data:,plain"), "not stated in base64"
    ),
    "a buffer beside that is not there": Refused(
        ".gltf", tetrahedron_gltf().json(uri="absent.bin"), r"absent\.bin': there is no such file"
    ),
    "20,000 nodes, each within the next": Usable(".glb", chained(20_000)),
    "a thousand instances": Usable(".glb", instanced(1000), 4000),
}

CASES = {**COORDINATES, **TEXTS, **GLTF}
