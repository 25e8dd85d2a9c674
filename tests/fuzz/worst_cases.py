"""Files that are meant to cost a reader more than their length, one maker a way.

A maker is given a number of bytes and returns a file of about as many.  What is repeated is what a
reader may look at again for each other thing in the file: corners of one face, groups of a face,
parts of a key, numbers that many meshes share.
"""

from __future__ import annotations

import io
import json
import math
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simplifier.io.camera_path import load_camera_path
from simplifier.io.elevation import load_elevation
from simplifier.io.load import load
from simplifier.io.overrides import load_overrides
from simplifier.io.scene import load_scene
from simplifier.io.toml import read_toml
from tests.io import builders

Maker = Callable[[int], bytes]


@dataclass(frozen=True)
class WorstCase:
    """``suffix`` of the file and how it is read."""

    name: str
    suffix: str
    read: Callable[[Path], object]
    make: Maker


def _lines(size: int, line: Callable[[int], str], share: float = 1.0) -> str:
    """Lines until they take so much; numbered, for those that have to differ."""
    count = max(int(size * share) // max(len(line(10**5)), 1), 1)
    return "".join(map(line, range(count)))


_POINTS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\n"


def _one_face(corners: Callable[[int], list[int]], points: str = _POINTS) -> Maker:
    def make(size: int) -> bytes:
        return f"{points}f {' '.join(map(str, corners(size // 2)))}\n".encode()

    return make


def _outline(shape: Callable[[np.ndarray], np.ndarray], suffix: str = ".obj") -> Maker:
    """One face around all vertices; ``shape`` (n,) shares of the way around to (n, 2)."""

    def make(size: int) -> bytes:
        count = max(size // 32, 8)
        rows = [f"{x:.9f} {y:.9f} 0" for x, y in shape(np.arange(count) / count).tolist()]
        if suffix == ".off":
            face = " ".join(map(str, (count, *range(count))))
            return "\n".join(["OFF", f"{count} 1 0", *rows, face, ""]).encode()
        face = " ".join(map(str, range(1, count + 1)))
        return ("v " + "\nv ".join(rows) + f"\nf {face}\n").encode()

    return make


def _star(way: np.ndarray) -> np.ndarray:
    radius = np.random.default_rng(7).uniform(0.1, 1.0, len(way))
    return radius[:, None] * np.column_stack([np.cos(math.tau * way), np.sin(math.tau * way)])


def _spiral(way: np.ndarray) -> np.ndarray:
    out = np.minimum(way, 1.0 - way)
    turns = math.tau * math.sqrt(len(way)) / 4.0
    radius = 1.0 + 2.0 * turns * out + np.where(way < 0.5, 0.0, 2.5)
    return radius[:, None] * np.column_stack([np.cos(turns * out * 2), np.sin(turns * out * 2)])


def _anywhere(way: np.ndarray) -> np.ndarray:
    return np.random.default_rng(3).uniform(0.0, 1.0, (len(way), 2))


def _teeth(way: np.ndarray) -> np.ndarray:
    count = len(way)
    x = np.minimum(np.arange(count), count - np.arange(count))
    return np.column_stack([x, np.where(np.arange(count) < count / 2, x % 2 * 1e3, 1e4)])


def _sizes_of_faces(size: int) -> bytes:
    """As many faces as have different numbers of corners."""
    most = int(math.sqrt(size))
    faces = [" ".join(str(1 + k % 4) for k in range(corners)) for corners in range(3, most)]
    return (_POINTS + "".join(f"f {face}\n" for face in faces)).encode()


def _obj(line: Callable[[int], str], before: Callable[[int], str] = lambda size: "") -> Maker:
    """Half of the file is before, half is lines."""

    def make(size: int) -> bytes:
        head = before(size // 2)
        return (_POINTS + head + _lines(size - len(head), line) + "f 1 2 3\n").encode()

    return make


_OBJ: Mapping[str, Maker] = {
    "corners in turn": _one_face(lambda room: [1, 2, 3] * (room // 3)),
    "corners anywhere": _one_face(
        lambda room: np.random.default_rng(5).integers(1, 5, room).tolist()
    ),
    "one corner": _one_face(lambda room: [1, *[2] * room, 3]),
    "there and back": _one_face(lambda room: [1, 2, 3, 4, 3, 2] * (room // 6)),
    "star": _outline(_star),
    "spiral": _outline(_spiral),
    "crossing itself": _outline(_anywhere),
    "teeth": _outline(_teeth),
    "sizes of faces": _sizes_of_faces,
    "materials": _obj(lambda k: f"usemtl m{k}\nf 1 2 3\n"),
    "one material": _obj(lambda k: "usemtl m\nf 1 2 3\n"),
    "objects": _obj(lambda k: f"o part{k}\nf 1 2 3\n"),
    "groups and materials": _obj(
        lambda k: f"usemtl m{k}\nf 1 2 3\n",
        lambda room: "g " + " ".join(f"g{k}" for k in range(room // 7)) + "\n",
    ),
    "a long name": _obj(lambda k: "usemtl m\nf 1 2 3\n", lambda room: f"o {'n' * room}\n"),
    "libraries": _obj(lambda k: f"mtllib m{k}.mtl\n"),
    "joined lines": _obj(lambda k: "\\\n"),
    "comments": _obj(lambda k: "#\n"),
    "a long number": lambda size: f"v 0.{'1' * size} 0 0\n{_POINTS}f 1 2 3\n".encode(),
    "a long index": lambda size: f"{_POINTS}f 1 2 3/{'1' * size}\n".encode(),
    "hard numbers": _obj(lambda k: "v 1e-400 inf 1.#INF\n"),
}


def _toml(line: Callable[[int], str]) -> Maker:
    return lambda size: _lines(size, line).encode()


_TOML: Mapping[str, Maker] = {
    "parts of a key": lambda size: ("a." * (size // 2) + "a = 1\n").encode(),
    "parts of a header": lambda size: ("[" + "a." * (size // 2) + "a]\n").encode(),
    "keys of many parts": _toml(lambda k: "a." * 50 + f"k{k} = 1\n"),
    "tables of many parts": _toml(lambda k: "[" + "a." * 50 + f"k{k}]\n"),
    "inline tables": _toml(lambda k: f"k{k} = {{" + "a." * 50 + "b = {c = 1}}\n"),
    "arrays of tables": lambda size: ("[[a]]\n" + "[[a.b]]\nc = 1\n" * (size // 14)).encode(),
    "brackets": lambda size: ("a = " + "[" * (size // 2) + "]" * (size // 2)).encode(),
    "quotes": lambda size: b'"' * size,
    "open quotes": lambda size: b'"""\\' * (size // 4),
    "digits": lambda size: b"a = " + b"1" * size,
    "backslashes": lambda size: b'a = """' + b"x\\\n" * (size // 3) + b'"""',
}


def _ply(header: Callable[[int], str], body: Callable[[int], str] = lambda size: "") -> Maker:
    return lambda size: builders.ply(header(size), body(size).encode())


_PLY: Mapping[str, Maker] = {
    "properties": _ply(
        lambda size: "element vertex 0\n" + _lines(size, lambda k: f"property float p{k}\n")
    ),
    "elements": _ply(lambda size: _lines(size, lambda k: f"element e{k} 0\n")),
    "one face": _ply(
        lambda size: (
            f"element vertex 4\n{builders.XYZ}element face 1\nproperty list uint int"
            " vertex_indices\n"
        ),
        lambda size: "0 0 0\n1 0 0\n0 1 0\n1 1 1\n" + f"{size // 6 * 3} " + "0 1 2 " * (size // 6),
    ),
    "strips": _ply(
        lambda size: (
            f"element vertex 3\n{builders.XYZ}element tristrips 1\n"
            "property list uint int vertex_indices\n"
        ),
        lambda size: "0 0 0\n1 0 0\n0 1 0\n" + f"{size // 9 * 4} " + "0 1 2 -1 " * (size // 9),
    ),
}


def _dae_primitives(primitive: Callable[[int], str], before: str = "") -> Maker:
    """One geometry with many lists of triangles, after as many points."""

    def make(size: int) -> bytes:
        rest = before + _lines(size, primitive, 0.5)
        points = [[k % 7, k % 5, k % 3] for k in range(max(size // 24, 3))]
        return builders.collada(
            builders.geometry_dae("body", points, rest),
            '<node id="node"><instance_geometry url="#body"/></node>\n',
        )

    return make


_PRIMITIVE = (
    '<triangles material="m{k}" count="1"><input semantic="VERTEX" source="#{source}" offset="0"/>'
    "<p>0 1 2</p></triangles>\n"
)


def _dae_effects(size: int) -> bytes:
    """An effect of many elements that many materials have."""
    names = range(size // 600)
    effect = "<x/>" * (size // 8)
    materials = "".join(
        f'<material id="m{k}"><instance_effect url="#effect"/></material>\n' for k in names
    )
    bound = "".join(f'<instance_material symbol="m{k}" target="#m0"/>' for k in names)
    body = "".join(_PRIMITIVE.format(k=k, source="body-vertices") for k in names)
    return builders.collada(
        builders.geometry_dae("body", builders.TRIANGLE, body),
        f'<node id="n"><instance_geometry url="#body">{bound}</instance_geometry></node>\n',
        f'<library_effects><effect id="effect">{effect}</effect></library_effects>\n{materials}',
    )


def _dae_nodes(size: int) -> bytes:
    """A node of many transforms that stands in many places."""
    inside = "<translate>1 0 0</translate>" * (size // 56)
    places = '<instance_node url="#one"/>' * min(size // 54, 90_000)
    return builders.collada(
        builders.geometry_dae(
            "body", builders.TRIANGLE, builders.triangles_dae("body", [[0, 1, 2]])
        ),
        f'<node id="n">{places}<instance_geometry url="#body"/></node>\n',
        f'<library_nodes><node id="one">{inside}</node></library_nodes>\n',
    )


def _dae_shared(size: int) -> bytes:
    """Meshes that all have the points of the first."""
    points = [[k % 7, k % 5, k % 3] for k in range(max(size // 24, 3))]
    body = builders.triangles_dae("a", [[0, 1, 2]])
    others = "".join(
        f'<geometry id="g{k}"><mesh>{body}</mesh></geometry>\n' for k in range(size // 400)
    )
    return builders.collada(builders.geometry_dae("a", points, body) + others, "").replace(
        b'<instance_visual_scene url="#scene"/>', b""
    ).replace(b"<visual_scene", b"<other").replace(b"</visual_scene", b"</other")  # fmt: skip


_DAE: Mapping[str, Maker] = {
    "primitives": _dae_primitives(lambda k: _PRIMITIVE.format(k=k, source="body-vertices")),
    "lists of vertices": _dae_primitives(
        lambda k: (
            f'<vertices id="w{k}"><input semantic="POSITION" source="#body-positions"/>'
            "</vertices>" + _PRIMITIVE.format(k=k, source=f"w{k}")
        )
    ),
    "effects": _dae_effects,
    "nodes": _dae_nodes,
    "shared points": _dae_shared,
    "a long namespace": lambda size: (
        f'<COLLADA xmlns="{"u" * (size // 2)}">{"<a/>" * (size // 8)}</COLLADA>'.encode()
    ),
    "a long attribute": lambda size: f'<COLLADA version="{"1" * size}"/>'.encode(),
    "attributes": lambda size: ("<COLLADA " + _lines(size, lambda k: f'a{k}="" ') + "/>").encode(),
    "tags without an end": lambda size: b"<COLLADA>" + b"<node " * (size // 6),
}


def _3mf(model: Callable[[int], str]) -> Maker:
    """Not packed, so that its length is that of the text."""

    def make(size: int) -> bytes:
        parts = {"3D/3dmodel.model": model(size)}
        return builders.zipped(parts, 0)

    return make


def _3mf_parts(size: int) -> str:
    """Objects of many components, one in the other."""
    mesh = builders.mesh_3mf(builders.TETRAHEDRON_POINTS, builders.TETRAHEDRON_FACES)
    inner = '<component objectid="1"/>' * (size // 60)
    outer = '<component objectid="2"/>' * (size // 60)
    return builders.MODEL_3MF.format(
        resources=f'<object id="1">{mesh}</object><object id="2"><components>{inner}</components>'
        f'</object><object id="3"><components>{outer}</components></object>',
        build='<item objectid="3"/>',
    )


_3MF: Mapping[str, Maker] = {
    "tags without an end": _3mf(lambda size: "<model><item " + "<item " * (size // 6)),
    "components": _3mf(_3mf_parts),
    "a long attribute": _3mf(lambda size: f'<model unit="{"m" * size}"/>'),
    "materials": _3mf(
        lambda size: builders.MODEL_3MF.format(
            resources='<object id="1"><mesh><vertices><vertex x="0" y="0" z="0"/>'
            '<vertex x="1" y="0" z="0"/><vertex x="0" y="1" z="0"/></vertices><triangles>'
            + _lines(size, lambda k: f'<triangle v1="0" v2="1" v3="2" pid="{k}" p1="0"/>')
            + "</triangles></mesh></object>",
            build='<item objectid="1"/>',
        )
    ),
}


def _gltf(fill: Callable[[builders.GltfBuilder, int], None]) -> Maker:
    def make(size: int) -> bytes:
        builder = builders.tetrahedron_gltf()
        fill(builder, size)
        return builder.glb()

    return make


def _nodes_in_line(builder: builders.GltfBuilder, size: int) -> None:
    for number in range(1, size // 24):
        builder.node(children=[number + 1])
    builder.node(mesh=0)


def _nodes_of_one_name(builder: builders.GltfBuilder, size: int) -> None:
    for _ in range(size // 26):
        builder.node(mesh=0, name="a")


def _names_that_are_taken(builder: builders.GltfBuilder, size: int) -> None:
    for number in range(size // 56):
        builder.node(mesh=0, name="a")
        builder.node(mesh=0, name=f"a.{number}")


def _primitives(builder: builders.GltfBuilder, size: int) -> None:
    one = builder.root["meshes"][0]["primitives"][0]
    builder.root["meshes"][0]["primitives"] = [one] * (size // 60)


def _children(builder: builders.GltfBuilder, size: int) -> None:
    builder.root["nodes"] += [{}] * (size // 12)
    builder.node(children=list(range(1, size // 12)))


_GLB: Mapping[str, Maker] = {
    "nodes in line": _gltf(_nodes_in_line),
    "nodes of one name": _gltf(_nodes_of_one_name),
    "names that are taken": _gltf(_names_that_are_taken),
    "primitives": _gltf(_primitives),
    "children": _gltf(_children),
}


def _gltf_text(middle: Callable[[int], str]) -> Maker:
    return lambda size: f'{{"asset": {{"version": "2.0"}}, {middle(size)}}}'.encode()


_GLTF: Mapping[str, Maker] = {
    "brackets": _gltf_text(lambda size: '"x": ' + "[" * (size // 2) + "]" * (size // 2)),
    "digits": _gltf_text(lambda size: '"x": ' + "1" * size),
    "a long address": _gltf_text(
        lambda size: f'"buffers": [{{"byteLength": 1, "uri": "data:{"%20" * (size // 3)}"}}]'
    ),
    "extensions": _gltf_text(
        lambda size: (
            '"extensionsRequired": ['
            + _lines(size, lambda k: f'"KHR_materials_{k}", ')
            + '"KHR_texture_transform"]'
        )
    ),
}


def _stl(size: int) -> bytes:
    facet = "facet normal 0 0 0\nouter loop\n" + "vertex 1 2 3\n" * 3 + "endloop\nendfacet\n"
    return ("solid a\n" + facet * (size // len(facet)) + "endsolid\n").encode()


_OTHERS: tuple[WorstCase, ...] = (
    WorstCase("stl: facets", ".stl", load, _stl),
    WorstCase(
        "stl: words", ".stl", load,
        lambda size: b"solid a\nfacet\n" + b"vertex " * (size // 7),
    ),
    WorstCase("stl: solids", ".stl", load, lambda size: b"solid a\nendsolid\n" * (size // 17)),
    WorstCase("off: crossing itself", ".off", load, _outline(_anywhere, ".off")),
    WorstCase("off: star", ".off", load, _outline(_star, ".off")),
    WorstCase("off: comments", ".off", load, lambda size: b"OFF\n" + b"#\n" * (size // 2)),
    WorstCase(
        "tres: arrays", ".tres", load,
        lambda size: b'[gd_resource type="ArrayOccluder3D"]\n'
        + b"vertices = PackedVector3Array(" * (size // 30),
    ),
    WorstCase(
        "tres: spaces", ".tres", load,
        lambda size: b'[gd_resource type="ArrayOccluder3D"' + b" " * size + b"]\n",
    ),
)  # fmt: skip


def _npy(size: int) -> bytes:
    file = io.BytesIO()
    np.save(file, np.zeros((2, max(size // 16, 2))))
    return file.getvalue()


def _npy_header(size: int) -> bytes:
    header = ("{'descr': '<f8', 'shape': " + "(" * (size - 40) + ")}\n").encode()
    return b"\x93NUMPY\x02\x00" + struct.pack("<I", len(header)) + header


def _tiff(entries: Callable[[int, int], list[tuple[int, int, int, int]]]) -> Maker:
    """A grid of 2 by 2, and tags of ``entries(room, where the bytes behind them begin)``."""

    def make(size: int) -> bytes:
        fixed = [
            (256, 3, 1, 2), (257, 3, 1, 2), (258, 3, 1, 8), (259, 3, 1, 1), (262, 3, 1, 1),
            (273, 4, 1, 8), (277, 3, 1, 1), (278, 3, 1, 2), (279, 4, 1, 4),
        ]  # fmt: skip
        count = min(size // 24, 65_000)
        begin = 12 + 2 + 12 * count + 4
        rows = (fixed + entries(count - len(fixed), begin))[:count]
        directory = struct.pack("<H", len(rows))
        directory += b"".join(struct.pack("<HHII", *row) for row in sorted(rows)) + b"\0\0\0\0"
        head = b"II*\0" + struct.pack("<I", 12) + b"\1\2\3\4"
        return (head + directory).ljust(begin, b"\0") + b"<Item " * (size // 12)

    return make


def _shared_tags(count: int, begin: int) -> list[tuple[int, int, int, int]]:
    return [(40_000 + k % 25_000, 3, 6 * count, begin) for k in range(count)]


def _tiff_pages(size: int) -> bytes:
    pages = size // 18
    data = b"II*\0" + struct.pack("<I", 8)
    for page in range(pages):
        after = len(data) + 18 if page + 1 < pages else 0
        data += struct.pack("<HHHIII", 1, 256, 3, 1, 2, after)
    return data


def _elevation(path: Path) -> object:
    return load_elevation(path, spacing=(1.0, 1.0))


_GRIDS: tuple[WorstCase, ...] = (
    WorstCase("npy: heights", ".npy", _elevation, _npy),
    WorstCase("npy: header", ".npy", _elevation, _npy_header),
    WorstCase("tif: tags of the same bytes", ".tif", _elevation, _tiff(_shared_tags)),
    WorstCase(
        "tif: metadata", ".tif", _elevation,
        _tiff(lambda count, begin: [(42112, 2, 6 * count, begin)]),
    ),
    WorstCase("tif: pages", ".tif", _elevation, _tiff_pages),
)  # fmt: skip


def _frames(size: int) -> bytes:
    frame = {"position": [0, 0, 0], "forward": [1, 0, 0], "up": [0, 0, 1], "fov": 60}
    frames = [frame] * (size // len(json.dumps(frame)))
    return json.dumps({"schema_version": 1, "name": "a", "frames": frames}).encode()


def _read_scene(path: Path) -> object:
    return load_scene(path)


def _of(
    title: str, suffix: str, read: Callable[[Path], object], makers: Mapping[str, Maker]
) -> tuple[WorstCase, ...]:
    return tuple(WorstCase(f"{title}: {name}", suffix, read, one) for name, one in makers.items())


WORST_CASES = {
    case.name: case
    for case in (
        *_of("obj", ".obj", load, _OBJ), *_of("toml", ".toml", read_toml, _TOML),
        *_of("overrides", ".toml", load_overrides, {
            "names": lambda size: b"[ignore]\nmeshes = [" + b'"*a*b*c",' * (size // 9) + b"]\n",
            "boxes": _toml(lambda k: "[[box]]\ncenter = [0, 0, 0]\nsize = [1, 1, 1]\n"),
        }),
        *_of("ply", ".ply", load, _PLY), *_of("dae", ".dae", load, _DAE),
        *_of("3mf", ".3mf", load, _3MF), *_of("glb", ".glb", load, _GLB),
        *_of("scene", ".glb", _read_scene, _GLB), *_of("gltf", ".gltf", load, _GLTF),
        *_OTHERS, *_GRIDS,
        WorstCase("camera path: frames", ".json", load_camera_path, _frames),
        WorstCase(
            "camera path: brackets", ".json", load_camera_path,
            lambda size: b"[" * (size // 2) + b"]" * (size // 2),
        ),
    )
}  # fmt: skip
