"""The file of a scene's occluders, ``.occs``: one to map, walk and draw from.

Little-endian; every block begins at a multiple of 16 bytes, so that a program that maps the file
uses it in place.  ``docs/formats.md`` has it byte by byte, and ``integrations/c/occluder_tree.h``
reads it.  A wrong index hides at random, so a checksum over all bytes refuses any damage.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence, Sized
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.checks import as_path, check_kind
from simplifier.errors import OptionError, SceneError
from simplifier.geometry.camera import Lens
from simplifier.geometry.packed_tree import MESH, NODE, PART, PackedTree
from simplifier.io.blocks import Blocks, check_sealed, fitting, sealed
from simplifier.io.files import read_bytes, write_whole
from simplifier.io.occs_checks import check_meshes, check_parts, check_tree, check_worth
from simplifier.options.simplify import Axis

MAGIC = b"\x89OCS\r\n\x1a\n"  # as PNG's: a transfer as text damages it
OCCS_VERSION = 1

_CONSERVATIVE, _UP = 1, 8  # of the flags: a bit, and the bit at which the up axis begins
_KNOWN = _CONSERVATIVE | 3 << _UP
_BLOCKS = (
    "nodes", "parts", "order", "transforms", "meshes", "positions", "indices", "pairs", "worth",
    "names", "about",
)  # fmt: skip
_HEADER = np.dtype([
    ("magic", "S8"), ("version", "<u4"), ("flags", "<u4"), ("file_bytes", "<u8"),
    ("nodes", "<u4"), ("parts", "<u4"), ("objects", "<u4"), ("transforms", "<u4"),
    ("meshes", "<u4"), ("vertices", "<u4"), ("index_words", "<u4"), ("pairs", "<u4"),
    ("origin", "<f8", 3), ("pixel_error", "<f8"), ("fov", "<f8"), ("rows", "<u4"),
    ("about_bytes", "<u4"), ("blocks", [(name, "<u4") for name in _BLOCKS]),
    ("reserved", "<u4", 2), ("checksum", "<u4"),
])  # fmt: skip
_COUNTS = (
    "nodes", "parts", "objects", "transforms", "meshes", "vertices", "index_words", "pairs",
    "about_bytes",
)  # fmt: skip


def save_packed_tree(tree: PackedTree, path: str | Path) -> None:
    """Write the file, whole or not at all; the same tree gives the same bytes.

    Raises :class:`OutputError`.
    """
    check_kind("tree", tree, PackedTree, "what simplifier.pack_tree returns")
    write_whole(as_path("path", path), encode_occs(tree))


def load_packed_tree(path: str | Path) -> PackedTree:
    """What :func:`save_packed_tree` wrote; its arrays are views of the file's bytes.

    Every value is checked: what is returned is a tree.  Raises :class:`SceneError` for a file that
    is missing, damaged, or of another version.
    """
    path = as_path("path", path)
    where = str(path)
    return decode_occs(
        read_bytes(
            path,
            error=SceneError,
            remedy="name an .occs file, which 'occluder scene' writes",
            check_start=lambda start, size: _check_start(start, size, where),
        ),
        where,
    )


def encode_occs(tree: PackedTree) -> bytes:
    """The bytes of the file.

    What UTF-8 cannot write of a name becomes "?".  Raises :class:`OutputError` for what the format
    has no room for.
    """
    about = json.dumps(tree.about, separators=(",", ":"), sort_keys=True).encode()
    header = np.zeros((), dtype=_HEADER)
    header["magic"], header["version"] = MAGIC, OCCS_VERSION
    header["flags"] = _CONSERVATIVE * tree.conservative | "xyz".index(tree.up) << _UP
    several: tuple[Sized, ...] = (
        tree.nodes, tree.parts, tree.objects, tree.transforms, tree.meshes, tree.positions,
        tree.indices, tree.pairs, about,
    )  # fmt: skip
    for name, some in zip(_COUNTS, several, strict=True):
        header[name] = _u32(len(some), name.replace("_", " "))
    header["origin"], header["pixel_error"] = tree.origin, tree.pixel_error
    header["fov"], header["rows"] = tree.fov, tree.rows
    return sealed(header, _encode_blocks(tree, about), _u32)


def _encode_blocks(tree: PackedTree, about: bytes) -> dict[str, bytes]:
    """By name; what is optional is left out where there is none of it."""
    names = [name.encode("utf-8", "replace").replace(b"\0", b"?") + b"\0" for name in tree.objects]
    ends = np.cumsum([0, *map(len, names)])
    _u32(int(ends[-1]), "bytes of names")
    blocks = {
        "nodes": tree.nodes.astype(NODE).tobytes(),
        "parts": tree.parts.astype(PART).tobytes(),
        "order": tree.order.astype("<u4").tobytes(),
        "transforms": tree.transforms.astype("<f8").tobytes(),
        "meshes": tree.meshes.astype(MESH).tobytes(),
        "positions": tree.positions.astype("<f4").tobytes(),
        "indices": tree.indices.astype("<u4").tobytes(),
        "pairs": tree.pairs.astype("<u4").tobytes(),
        "worth": b"" if tree.worth is None else tree.worth.astype("<f4").tobytes(),
        "names": ends.astype("<u4").tobytes() + b"".join(names),
        "about": about,
    }
    optional = ("pairs", "worth")
    return {name: block for name, block in blocks.items() if block or name not in optional}


_u32 = partial(fitting, where="packed scene", remedy="split the scene")


def decode_occs(data: bytes, where: str) -> PackedTree:
    """The tree of a file's bytes; messages name it ``where``.

    Nothing is made room for that the bytes do not bear out.  Raises :class:`SceneError`.
    """
    header = _checked_header(data, where)
    file = Blocks(data, header["blocks"], _HEADER.itemsize, partial(_damage, where=where))
    count = {name: int(header[name]) for name in _COUNTS}
    tree = PackedTree(
        _decode_names(file, count["objects"]),
        _up(header, file),
        bool(header["flags"] & _CONSERVATIVE),
        float(header["pixel_error"]),
        int(header["rows"]),
        float(header["fov"]),
        header["origin"].astype(np.float64),
        file.array("nodes", NODE, count["nodes"]),
        file.array("parts", PART, count["parts"]),
        file.array("order", "<u4", count["parts"]),
        file.array("transforms", "<f8", 12 * count["transforms"]).reshape(-1, 3, 4),
        file.array("meshes", MESH, count["meshes"]),
        file.array("positions", "<f4", 3 * count["vertices"]).reshape(-1, 3),
        file.array("indices", "<u4", count["index_words"]),
        _pairs(file, count["pairs"]),
        file.array("worth", "<f4", count["nodes"]) if header["blocks"]["worth"] else None,
        _decode_about(file, count["about_bytes"]),
    )
    try:
        check_tree(tree)
        check_parts(tree)
        check_meshes(tree)
        check_worth(tree)
    except ValueError as error:
        raise file.damage(str(error)) from None
    return tree


def _pairs(file: Blocks, count: int) -> NDArray[np.uint32]:
    found = file.array("pairs", "<u4", 2 * count) if count else np.empty(0, dtype=np.uint32)
    return found.reshape(-1, 2)


def _check_start(start: bytes, size: int, where: str) -> None:
    if size < _HEADER.itemsize or not start.startswith(MAGIC):
        raise _damage("this is no packed scene (.occs): it does not begin as one", where)


def _checked_header(data: bytes, where: str) -> np.void:
    """The header of bytes that are those that were written, as far as a checksum can tell."""
    _check_start(data, len(data), where)
    header: np.void = np.frombuffer(data, dtype=_HEADER, count=1)[0]
    if header["version"] != OCCS_VERSION:
        raise _unknown(f"version {header['version']} of the format is", where)
    if int(header["flags"]) & ~_KNOWN:
        raise _unknown(f"what it holds besides occluders (flags {header['flags']}) is", where)
    check_sealed(header, data, partial(_damage, where=where))
    if not np.isfinite(header["origin"]).all():
        raise _damage("its origin is not finite", where)
    if not 0.0 < float(header["pixel_error"]) < math.inf:
        raise _damage(f"it is for an error of {header['pixel_error']} pixels", where)
    try:
        Lens(int(header["rows"]), float(header["fov"]))
    except OptionError as error:
        raise _damage(f"it was made for an impossible screen ({error})", where) from None
    return header


def _up(header: np.void, file: Blocks) -> Axis:
    axes: Sequence[Axis] = ("x", "y", "z")
    axis = int(header["flags"]) >> _UP & 3
    if axis >= len(axes):
        raise file.damage("its up axis is none of x, y and z")
    return axes[axis]


def _decode_names(file: Blocks, objects: int) -> tuple[str, ...]:
    """Each ends with a 0, which is in none of them."""
    offsets = file.ascending("names", objects)
    text = file.raw("names", int(offsets[-1]), 4 * len(offsets))
    ends = offsets[1:] - 1
    zeros = np.flatnonzero(np.frombuffer(text, np.uint8) == 0)
    if not np.array_equal(zeros, ends):
        raise file.damage("the name of an object does not end where it should")
    try:
        return tuple(text.decode("utf-8").split("\0")[:-1])
    except UnicodeDecodeError:
        raise file.damage("the name of an object is no UTF-8") from None


def _decode_about(file: Blocks, count: int) -> dict[str, Any]:
    try:
        about = json.loads(file.raw("about", count))
    except (ValueError, RecursionError):
        raise file.damage("what it says about itself is not JSON") from None
    if not isinstance(about, dict):
        raise file.damage("what it says about itself is not a JSON object")
    return about


def _unknown(what: str, where: str) -> SceneError:
    return SceneError(
        f"{what} not known",
        where=where,
        remedy=f"write version {OCCS_VERSION}, or use a newer release",
    )


def _damage(what: str, where: str) -> SceneError:
    return SceneError(what, where=where, remedy="copy it, or build the scene again")
