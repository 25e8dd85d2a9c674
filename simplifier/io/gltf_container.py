"""A glTF file as its JSON and its binary chunk.

A checked view of the JSON of a glTF file: every access says where it failed.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, cast

from simplifier.errors import OutputError, UnreadableMeshError
from simplifier.io.claim import Peek
from simplifier.io.text import quote_word

GLB_MAGIC = b"glTF"
JSON_CHUNK = 0x4E4F534A
BINARY_CHUNK = 0x004E4942
_UNDERSTOOD = ("KHR_mesh_quantization", "EXT_mesh_gpu_instancing", "MSFT_lod")
# Of looks, sound and metadata: they move no vertex and hide no node.
_OF_NO_SHAPE = re.compile(
    r"[A-Z]+_(materials|texture|lights|packing|techniques?|animation|audio|xmp|mesh_features"
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


def open_document(data: bytes, where: str, *, names_once: bool = True) -> GltfDocument:
    """Either form, told by the first bytes; raises :class:`UnreadableMeshError`.

    ``names_once``  as of :func:`parse_json`.
    """
    text, binary = split_chunks(data, where)
    root = parse_json(text, where, names_once=names_once)
    _check_version(root)
    _check_extensions(root)
    return GltfDocument(root, binary)


def peek_document(peek: Peek) -> GltfDocument:
    """The JSON alone, without what it refers to, and whatever its names; raises as
    :func:`open_document`."""
    head = peek.read(0, 20)
    if head[:4] == GLB_MAGIC and int.from_bytes(head[16:20], "little") == JSON_CHUNK:
        text = peek.read(20, int.from_bytes(head[12:16], "little"))
    else:
        text = peek.read(0, peek.size)
    return GltfDocument(parse_json(text, str(peek.path), names_once=False), None)


def pack_glb(root: dict[str, Any], binary: bytes) -> bytes:
    """A GLB file of a JSON document and, unless it is empty, its binary chunk.

    Raises :class:`OutputError` beyond the 4 GiB that its header can state.
    """
    text = json.dumps(root, separators=(",", ":"), allow_nan=False).encode("ascii")
    chunks = [(JSON_CHUNK, _pad(text, b" "))]
    if binary:
        chunks.append((BINARY_CHUNK, _pad(binary, b"\0")))
    length = 12 + sum(8 + len(chunk) for _, chunk in chunks)
    if length >= 1 << 32:
        raise OutputError("the scene is too large for a GLB file", remedy="split it")
    parts = [GLB_MAGIC, _word(2), _word(length)]
    for kind, chunk in chunks:
        parts += [_word(len(chunk)), _word(kind), chunk]
    return b"".join(parts)


def _word(value: int) -> bytes:
    return value.to_bytes(4, "little")


def _pad(chunk: bytes, filler: bytes) -> bytes:
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
                f"it requires the extension {name[:60]!a}, which is not known here",
                "export it without that extension",
            )


def _check_version(root: JsonObject) -> None:
    asset = root.child("asset").members
    version, least = asset.get("version"), asset.get("minVersion", "2.0")
    if not isinstance(version, str) or not version.startswith("2."):
        raise root.fail(
            f"asset.version is {ascii(version)[:20]}, but only glTF 2 is supported",
            "export it as glTF 2.0",
        )
    if least != "2.0":
        raise root.fail(
            f"asset.minVersion is {ascii(least)[:20]}, but only glTF 2.0 is supported",
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


def split_chunks(data: bytes, where: str) -> tuple[bytes, bytes | None]:
    """The JSON chunk and the first binary one; others are skipped, as the format asks for.  All of
    a file that is no GLB is JSON."""
    if data[:4] != GLB_MAGIC:
        return data, None
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


_LARGEST = 2**53  # whole numbers beyond this are not exact in JSON


class JsonObject:
    """``members`` as JSON has them, and ``where`` they are: the file and the place inside it, for
    messages.  The place is put into words when it is asked for, since scenes have many nodes."""

    __slots__ = ("_index", "_key", "_outer", "members")

    def __init__(
        self, members: dict[str, object], where: str | JsonObject, key: str = "", index: int = -1
    ) -> None:
        """``where`` in words, or the object that it is in: as the member ``key``, or at ``index``
        of the list that this is."""
        self.members, self._outer, self._key, self._index = members, where, key, index

    @property
    def where(self) -> str:
        if isinstance(self._outer, str):
            return self._outer
        return f"{self._outer.where}: {_place(self._key, self._index)}"

    def fail(self, what: str, remedy: str = "") -> UnreadableMeshError:
        """The error to raise for this object."""
        return UnreadableMeshError(what, where=self.where, remedy=remedy)

    def has(self, key: str) -> bool:
        return self.members.get(key) is not None

    def has_extension(self, name: str) -> bool:
        """Whether this object has the glTF extension of that name; nearly none has any."""
        return self.members.get("extensions") is not None and self.child("extensions").has(name)

    def integer(self, key: str, default: int | None = None) -> int:
        """A whole number from 0 on; ``default`` when absent, an error when that is None."""
        value = self.members.get(key, default)
        if isinstance(value, float) and value.is_integer():
            value = int(value)
        if type(value) is not int or not 0 <= value <= _LARGEST:  # True is of another type
            raise self.fail(f"'{key}' is not a whole number from 0 on")
        return value

    def integers(self, key: str) -> list[int]:
        """An array of whole numbers from 0 on; empty when absent."""
        if key not in self.members:  # as of nearly all nodes: they have no children
            return []
        values = self._array(key)
        if all(type(value) is int and 0 <= value <= _LARGEST for value in values):
            return cast(list[int], values)
        view = JsonObject({str(i): value for i, value in enumerate(values)}, f"{self.where}.{key}")
        return [view.integer(str(i)) for i in range(len(values))]

    def numbers(self, key: str, length: int) -> list[float] | None:
        """An array of ``length`` finite numbers; None when absent."""
        numbers = self.numbers_or_nan(key, length)
        if numbers is not None and not all(map(math.isfinite, numbers)):
            raise self._not_numbers(key, length)
        return numbers

    def numbers_or_nan(self, key: str, length: int) -> list[float] | None:
        """An array of ``length`` values, NaN for those that are no number; None when absent."""
        if not self.has(key):
            return None
        values = self._array(key)
        if len(values) != length:
            raise self._not_numbers(key, length)
        if set(map(type, values)) == {float}:  # nearly always, and a scene has many matrices
            return cast(list[float], values)
        return [number_or_nan(value) for value in values]

    def texts(self, key: str) -> list[str]:
        """The texts of an array; empty when absent."""
        return [value for value in self._array(key) if isinstance(value, str)]

    def child(self, key: str) -> JsonObject:
        """An object inside this one; without members when absent."""
        value = self.members.get(key)
        return self._view({} if value is None else value, key)

    def count(self, key: str) -> int:
        """Length of an array; 0 when absent."""
        return len(self._array(key))

    def item(self, key: str, index: int) -> JsonObject:
        """One object of an array of objects."""
        values = self._array(key)
        if index >= len(values):
            raise self.fail(f"{_place(key, index)} is used, but there are {len(values)}")
        return self._view(values[index], key, index)

    def items(self, key: str) -> Iterator[JsonObject]:
        """All objects of an array of objects."""
        return (self._view(value, key, index) for index, value in enumerate(self._array(key)))

    def items_with(self, member: str, key: str) -> Iterator[tuple[int, JsonObject]]:
        """Those that have a ``member``, and their places: of many nodes they may be few."""
        for index, value in enumerate(self._array(key)):
            if not isinstance(value, dict) or member in value:
                yield index, self._view(value, key, index)

    def _not_numbers(self, key: str, length: int) -> UnreadableMeshError:
        return self.fail(f"'{key}' is not an array of {length} numbers")

    def _array(self, key: str) -> list[object]:
        value = self.members.get(key)
        if value is None:
            return []
        if not isinstance(value, list):
            raise self.fail(f"'{key}' is not an array")
        return value

    def _view(self, value: object, key: str, index: int = -1) -> JsonObject:
        if not isinstance(value, dict):
            raise self.fail(f"'{_place(key, index)}' is not an object")
        return JsonObject(value, self, key, index)


def _place(key: str, index: int) -> str:
    """Of a member, or of the one at ``index``, if that is not below 0, of its list."""
    return key if index < 0 else f"{key}[{index}]"


def parse_json(data: bytes, where: str, *, names_once: bool = True) -> JsonObject:
    """Raises :class:`UnreadableMeshError` for what is not a JSON object, or one that names a member
    twice; ``names_once``, whether to look for that, takes as long as all else."""
    check_object(data, where)
    value = _parsed_soon(data, names_once) if len(data) >= _LARGE else None
    if value is not None:
        return JsonObject(value, where)
    try:
        hook = _members if names_once else None
        found = json.loads(data.decode("utf-8-sig"), object_pairs_hook=hook)
    except (ValueError, RecursionError) as error:
        raise UnreadableMeshError(
            f"its JSON is damaged ({str(error)[:80]})",
            where=where,
            remedy="copy or export it again",
        ) from None
    return JsonObject(found, where)


_LARGE = 1 << 18  # bytes that json takes longer to read than orjson to be loaded


def _parsed_soon(data: bytes, names_once: bool) -> dict[str, object] | None:
    """What json would give, in less than half of the time; None where json is to be asked.  That
    takes what orjson does not: NaN, the mark of UTF-8, half of a character, and what is nested
    deeper than any scene.  It says what is wrong, too."""
    import orjson

    try:
        value = orjson.loads(data)
        is_whole = not names_once or _lost_no_name(data, orjson.dumps(value))
    except (orjson.JSONDecodeError, orjson.JSONEncodeError):
        return None
    return value if is_whole and isinstance(value, dict) else None


def _lost_no_name(data: bytes, again: bytes) -> bool:
    """Whether JSON has as many names when it is written ``again``: of two that are the same, one is
    lost.  False, too, where that is not easy to tell: names may end in space, and characters may be
    written by number."""
    if data.rstrip(b" ") == again:  # most files are written like that
        return True
    spaced = any(space + b":" in data for space in (b" ", b"\t", b"\n", b"\r"))
    if spaced or b"\\u00" in data:
        return False
    return data.count(b'":') == again.count(b'":')


def check_object(start: bytes, where: str) -> None:
    """Raises :class:`UnreadableMeshError` for what does not begin as a JSON object does."""
    text = start.removeprefix(b"\xef\xbb\xbf").lstrip(b" \t\r\n")
    if text and not text.startswith(b"{"):
        raise UnreadableMeshError(
            f"its JSON is not an object: it begins with {quote_word(text[:8])}",
            where=where,
            remedy="check that this is a glTF file",
        )


def _members(pairs: list[tuple[str, object]]) -> dict[str, object]:
    """Which of two values is meant nobody knows, and glTF forbids it."""
    members = dict(pairs)
    if len(members) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"'{twice[:40]}' occurs twice in one object")
    return members


def number_or_nan(value: object) -> float:
    """NaN for what is no number."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.nan
