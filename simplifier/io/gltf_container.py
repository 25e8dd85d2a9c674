"""A glTF file as its JSON and its binary chunk."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from typing import Any

from simplifier.errors import OutputError, UnreadableMeshError
from simplifier.io.claim import Peek
from simplifier.io.gltf_json import JsonObject, check_object, parse_json
from simplifier.io.text import shown

GLB_MAGIC = b"glTF"
JSON_CHUNK = 0x4E4F534A
BINARY_CHUNK = 0x004E4942
_UNDERSTOOD = ("KHR_mesh_quantization", "EXT_mesh_gpu_instancing", "MSFT_lod")
# Of looks, sound and metadata: they move no vertex and hide no node.
_OF_NO_SHAPE = re.compile(
    r"[A-Z]+_(materials|texture|lights|packing|techniques|animation|audio|xmp|mesh_features"
    r"|instance_features|structural_metadata|feature_metadata)"
)
_COMPRESSION = ("KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression")


@dataclass(frozen=True, eq=False)
class GltfDocument:
    """``binary``: the BIN chunk of a GLB file, None without one."""

    root: JsonObject
    binary: bytes | None


def check_container(start: bytes, size: int, where: str) -> None:
    """Raises :class:`UnreadableMeshError` for what begins neither a whole GLB file nor JSON."""
    if start[:4] == GLB_MAGIC:
        _check_header(start, size, where)
    else:
        check_object(start, where)


def open_document(data: bytes, where: str) -> GltfDocument:
    """Either form, told by the first bytes; raises :class:`UnreadableMeshError`."""
    if data[:4] == GLB_MAGIC:
        text, binary = _split_chunks(data, where)
    else:
        text, binary = data, None
    root = parse_json(text, where)
    _check_version(root)
    _check_extensions(root)
    return GltfDocument(root, binary)


def peek_document(peek: Peek) -> GltfDocument:
    """The JSON alone, without what it refers to; raises as :func:`open_document`."""
    head = peek.read(0, 20)
    if head[:4] == GLB_MAGIC and int.from_bytes(head[16:20], "little") == JSON_CHUNK:
        text = peek.read(20, int.from_bytes(head[12:16], "little"))
    else:
        text = peek.read(0, peek.size)
    return GltfDocument(parse_json(text, str(peek.path)), None)


def pack_glb(root: dict[str, Any], binary: bytes) -> bytes:
    """A GLB file of a JSON document and, unless it is empty, its binary chunk.

    Raises :class:`OutputError` beyond the 4 GiB that its header can state.
    """
    text = json.dumps(root, separators=(",", ":"), allow_nan=False).encode("ascii")
    chunks = [(JSON_CHUNK, _padded(text, b" "))]
    if binary:
        chunks.append((BINARY_CHUNK, _padded(binary, b"\0")))
    length = 12 + sum(8 + len(chunk) for _, chunk in chunks)
    if length >= 1 << 32:
        raise OutputError("the scene is too large for a GLB file", remedy="split it")
    parts = [GLB_MAGIC, _word(2), _word(length)]
    for kind, chunk in chunks:
        parts += [_word(len(chunk)), _word(kind), chunk]
    return b"".join(parts)


def _word(value: int) -> bytes:
    return value.to_bytes(4, "little")


def _padded(chunk: bytes, filler: bytes) -> bytes:
    return chunk + filler * (-len(chunk) % 4)


def compressed(where: JsonObject, extension: str) -> UnreadableMeshError:
    """The error for geometry that only a decompressor can read."""
    return where.fail(
        f"the geometry is compressed with {extension}, which is not supported",
        "save it uncompressed, for example with 'gltf-transform copy' or from Blender",
    )


def _check_extensions(root: JsonObject) -> None:
    """Refuse what the format says cannot be read without an extension that is not known here."""
    for name in root.texts("extensionsRequired"):
        if name in _COMPRESSION:
            raise compressed(root, name)
        if name not in _UNDERSTOOD and not _OF_NO_SHAPE.match(name):
            raise root.fail(
                f"it requires the extension {shown(name.encode())}, which is not known here",
                "export it without that extension",
            )


def _check_version(root: JsonObject) -> None:
    version = root.child("asset").members.get("version")
    if not isinstance(version, str) or not version.startswith("2."):
        raise root.fail(
            f"asset.version is {str(version)[:20]!r}, but only glTF 2 is supported",
            "export it as glTF 2.0",
        )


def _check_header(data: bytes, size: int, where: str) -> int:
    """The length that the header of a GLB file states, which is no more than there is."""
    version, length = (int.from_bytes(data[i : i + 4], "little") for i in (4, 8))
    if version != 2:
        raise UnreadableMeshError(
            f"GLB version {version} is not supported", where=where, remedy="export glTF 2.0"
        )
    if size < length or length < 20:
        raise UnreadableMeshError(
            f"the file is truncated: {size} of {length} bytes are there",
            where=where,
            remedy="copy or export it again",
        )
    return length


def _split_chunks(data: bytes, where: str) -> tuple[bytes, bytes | None]:
    """The JSON chunk and the first binary one; others are skipped, as the format asks for."""
    length = _check_header(data, len(data), where)
    chunks: dict[int, bytes] = {}
    position = 12
    while position + 8 <= length:
        size, kind = (
            int.from_bytes(data[position + i : position + i + 4], "little") for i in (0, 4)
        )
        position += 8
        if position + size > length:
            raise UnreadableMeshError(
                "the file is damaged: a chunk is longer than the file",
                where=where,
                remedy="copy or export it again",
            )
        chunks.setdefault(kind, data[position : position + size])
        position += size
    if JSON_CHUNK not in chunks:
        raise UnreadableMeshError("the GLB file has no JSON chunk", where=where)
    return chunks[JSON_CHUNK], chunks.get(BINARY_CHUNK)
