"""A small packed scene, and each way in which a file of one can be wrong.

All readers, the library's and those of ``integrations/``, are held to them.
"""

from __future__ import annotations

import struct
import zlib

import numpy as np

from simplifier.geometry.packed_tree import MESH, NODE, NONE, PART, PackedTree

HEADER = 160
BLOCKS = {
    name: 104 + 4 * place
    for place, name in enumerate(
        (
            "nodes",
            "parts",
            "order",
            "transforms",
            "meshes",
            "positions",
            "indices",
            "pairs",
            "worth",
            "names",
            "about",
        )
    )
}
"""Where the header says where each block begins."""

_NODES = [
    ((0, 0, 0), (9, 2, 2), 2, NONE, 0.5, 0.75, 3.0, 0.0, 1, 2, 0, 3),
    ((0, 0, 0), (5, 2, 2), NONE, NONE, 0.0, 0.0, 0.0, 0.0, 3, 2, 0, 2),
    ((7, 0, 0), (9, 2, 2), 1, 0, 0.125, 0.25, 1.0, 1.5, 0, 0, 2, 1),
    ((0, 0, 0), (2, 2, 2), 1, 0, 0.125, 0.25, 1.0, 1.5, 0, 0, 0, 1),
    ((3, 0, 0), (5, 2, 2), NONE, 0, 0.0, 0.0, 0.0, 1.5, 0, 0, 1, 1),
]
_PARTS = [(0, 0, 4), (1, 1, 3), (1, 2, 2)]
_MESHES = [
    ((1, 1, 1), 0, 4, 0, 4, 0, 6),
    ((1, 1, 1), 4, 3, 6, 1, 6, 0),
    ((0, 0, 0), 7, 3, 8, 1, 6, 0),
]
_PAIRS = [(0, 5), (1, 11), (2, 6), (3, 10), (4, 8), (7, 9)]
_TETRAHEDRON = [(-1, -1, -1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]


def town(**changes) -> PackedTree:
    """Three parts of two objects: a tree of five nodes, a tetrahedron and two triangles."""
    transforms = np.zeros((3, 3, 4))
    transforms[:, range(3), range(3)] = 1.0
    transforms[:, 0, 3] = (5e6 + 3.0, 5e6, 5e6 + 7.0)
    corners = np.array([0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2, 0, 1, 2, 0, 0, 1, 2, 0], "<u2")
    members = {
        "objects": ("Häuser", "b"), "up": "z", "conservative": True, "pixel_error": 0.5,
        "rows": 180, "fov": 60.0, "origin": np.array([5e6, 0.0, 0.0]),
        "nodes": np.array(_NODES, NODE), "parts": np.array(_PARTS, PART),
        "order": np.array([1, 0, 2], np.uint32), "transforms": transforms,
        "meshes": np.array(_MESHES, MESH),
        "positions": np.array(_TETRAHEDRON + 2 * _TETRAHEDRON[1:], np.float32),
        "indices": corners.view("<u4"), "pairs": np.array(_PAIRS, np.uint32),
        "worth": np.array([1.0, 0.0, 2.0, 0.5, 1.0], np.float32), "about": {"made by": "hand"},
    }  # fmt: skip
    return PackedTree(**{**members, **changes})


def signed(data: bytes) -> bytes:
    """With the checksum of what the bytes now are."""
    whole = bytearray(data)
    whole[156:160] = bytes(4)
    whole[156:160] = struct.pack("<I", zlib.crc32(whole))
    return bytes(whole)


def patched(data: bytes, offset: int, patch: bytes) -> bytes:
    return signed(data[:offset] + patch + data[offset + len(patch) :])


def block(data: bytes, name: str) -> int:
    """Where a block begins."""
    return 16 * struct.unpack_from("<I", data, BLOCKS[name])[0]


def _in(name: str, offset: int = 0):
    return lambda data: block(data, name) + offset


def _at(offset: int):
    return lambda data: offset


def _u32(*values: int) -> bytes:
    return struct.pack(f"<{len(values)}I", *values)


def _f32(value: float) -> bytes:
    return struct.pack("<f", value)


def _f64(value: float) -> bytes:
    return struct.pack("<d", value)


_HUGE = 2**32 - 1
DAMAGES = {
    "another version": (_at(8), _u32(2), "version 2 .* newer release"),
    "a flag of later": (_at(12), _u32(1 | 2 | 2 << 8), "not known; .* newer release"),
    "no up axis": (_at(12), _u32(1 | 3 << 8), "up axis"),
    "a longer file": (_at(16), struct.pack("<Q", 1 << 40), "should have 1099511627776 bytes"),
    "many nodes": (_at(24), _u32(_HUGE), "nodes, .* not in the file"),
    "no node": (_at(24), _u32(0), "no node"),
    "fewer nodes": (_at(24), _u32(4), "order of their parents"),
    "many parts": (_at(28), _u32(_HUGE), "parts, .* not in the file"),
    "fewer parts": (_at(28), _u32(2), "not those of its children"),
    "many objects": (_at(32), _u32(_HUGE), "names, .* not in the file"),
    "fewer objects": (_at(32), _u32(1), "does not end where it should"),
    "many transforms": (_at(36), _u32(_HUGE), "transforms, .* not in the file"),
    "fewer transforms": (_at(36), _u32(2), "transform that is not there"),
    "many occluders": (_at(40), _u32(_HUGE), "meshes, .* not in the file"),
    "fewer occluders": (_at(40), _u32(2), "occluder that is not there"),
    "many vertices": (_at(44), _u32(_HUGE), "positions, .* not in the file"),
    "fewer vertices": (_at(44), _u32(9), "does not begin where"),
    "many indices": (_at(48), _u32(_HUGE), "indices, .* not in the file"),
    "fewer indices": (_at(48), _u32(9), "does not begin where"),
    "many pairs": (_at(52), _u32(_HUGE), "pairs, .* not in the file"),
    "fewer pairs": (_at(52), _u32(5), "does not begin where"),
    "an origin of NaN": (_at(64), _f64(np.nan), "origin is not finite"),
    "an infinite origin": (_at(56), _f64(np.inf), "origin is not finite"),
    "no pixel error": (_at(80), _f64(0.0), "error of 0.0 pixels"),
    "an endless pixel error": (_at(80), _f64(np.inf), "error of inf pixels"),
    "no field of view": (_at(88), _f64(0.0), "an impossible screen"),
    "all of the view": (_at(88), _f64(180.0), "an impossible screen"),
    "no rows": (_at(96), _u32(0), "an impossible screen"),
    "many rows": (_at(96), _u32(_HUGE), "an impossible screen"),
    "much about itself": (_at(100), _u32(_HUGE), "about, .* not in the file"),
    "a block in the header": (_at(BLOCKS["order"]), _u32(9), "not in the file"),
    "a block behind the end": (_at(BLOCKS["indices"]), _u32(_HUGE), "not in the file"),
    "pairs that are not there": (_at(BLOCKS["pairs"]), _u32(0), "pairs, .* not in the file"),
    "a worth behind the end": (_at(BLOCKS["worth"]), _u32(_HUGE), "worth, .* not in the file"),
    "a box of NaN": (_in("nodes", 4), _f32(np.nan), "box is not finite"),
    "an endless box": (_in("nodes", 12), _f32(np.inf), "box is not finite"),
    "a turned box": (_in("nodes", 12), _f32(-1.0), "above its highest"),
    "no such far occluder": (_in("nodes", 24), _u32(3), "occluder that is not there"),
    "no such near occluder": (_in("nodes", 2 * 64 + 28), _u32(3), "occluder that is not there"),
    "a near occluder within": (_in("nodes", 28), _u32(0), "inner node has a near"),
    "an error of NaN": (_in("nodes", 32), _f32(np.nan), "far error of a node is not finite"),
    "an error below 0": (_in("nodes", 32), _f32(-0.5), "far error of a node is below 0"),
    "a switch error below 0": (_in("nodes", 36), _f32(-0.5), "switch error of a node is below"),
    "an endless radius": (_in("nodes", 40), _f32(np.inf), "far radius of a node is not finite"),
    "a radius below 0": (_in("nodes", 44), _f32(-1.0), "near radius of a node is below 0"),
    "a cycle": (_in("nodes", 64 + 48), _u32(0), "order of their parents"),
    "its own child": (_in("nodes", 48), _u32(0), "order of their parents"),
    "children of another": (_in("nodes", 64 + 48), _u32(1), "order of their parents"),
    "many children": (_in("nodes", 52), _u32(_HUGE), "order of their parents"),
    "a child too few": (_in("nodes", 64 + 52), _u32(1), "order of their parents"),
    "children before their parent": (
        _in("nodes", 48), _u32(0, 0), "order of their parents",
    ),
    "a leaf with a first child": (_in("nodes", 2 * 64 + 48), _u32(1), "after its children"),
    "parts of another": (_in("nodes", 2 * 64 + 56), _u32(1), "not those of its children"),
    "many parts below": (_in("nodes", 60), _u32(_HUGE), "not those of its children"),
    "parts that wrap around": (_in("nodes", 64 + 60), _u32(_HUGE), "not those of its children"),
    "a leaf without a part": (_in("nodes", 3 * 64 + 60), _u32(0), "not those of its children"),
    "no such object": (_in("parts", 24), _u32(2), "order of the objects"),
    "objects that fall": (_in("parts", 0), _u32(1), "order of the objects"),
    "no such transform": (_in("parts", 4), _u32(3), "transform that is not there"),
    "another leaf": (_in("parts", 8), _u32(3), "name its leaf"),
    "no such leaf": (_in("parts", 8), _u32(_HUGE), "name its leaf"),
    "no such part": (_in("order"), _u32(3), "one that is not there"),
    "a part twice": (_in("order"), _u32(0), "name its leaf"),
    "a transform of NaN": (_in("transforms", 8), _f64(np.nan), "transform is not finite"),
    "an occluder's origin of NaN": (_in("meshes"), _f64(np.nan), "position is not finite"),
    "vertices of another": (_in("meshes", 48 + 24), _u32(3), "does not begin where"),
    "a vertex too many": (_in("meshes", 96 + 28), _u32(4), "does not begin where"),
    "many vertices of one": (_in("meshes", 28), _u32(_HUGE), "does not begin where"),
    "indices of another": (_in("meshes", 48 + 32), _u32(5), "does not begin where"),
    "many triangles": (_in("meshes", 96 + 36), _u32(_HUGE), "does not begin where"),
    "pairs of another": (_in("meshes", 48 + 40), _u32(5), "does not begin where"),
    "many pairs of one": (_in("meshes", 44), _u32(_HUGE), "does not begin where"),
    "a position of NaN": (_in("positions", 12 * 9 + 8), _f32(np.nan), "position is not finite"),
    "no such vertex": (_in("indices"), struct.pack("<H", 4), "vertex that it does not have"),
    "a vertex of another": (_in("indices", 38), struct.pack("<H", 3), "vertex that it does"),
    "no such corner": (_in("pairs", 44), _u32(12), "corner that it does not have"),
    "a worth of NaN": (_in("worth"), _f32(np.nan), "worth of a node is not finite"),
    "a worth below 0": (_in("worth", 16), _f32(-1.0), "worth of a node is below 0"),
    "names that begin late": (_in("names"), _u32(1), "not ascend"),
    "names behind the end": (_in("names", 8), _u32(_HUGE), "not in the file"),
    "names that fall": (_in("names", 4), _u32(11), "not ascend"),
    "a name that ends early": (_in("names", 4), _u32(7), "does not end where it should"),
    "an empty name without its end": (_in("names", 4), _u32(0), "does not end where it should"),
    "a name within a name": (_in("names", 14), b"\0", "does not end where it should"),
    "a name that does not end": (_in("names", 21), b"c", "does not end where it should"),
    "a name that is no text": (_in("names", 13), b"\xff", "no UTF-8"),
}  # fmt: skip

FOR_PYTHON = {
    "something else about itself": (_in("about"), b"[", "not JSON"),
    "a list about itself": (_in("about"), b'["made by","hand"]', "not a JSON object"),
}
"""What engines do not read."""
