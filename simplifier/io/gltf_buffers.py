"""The buffers of a glTF file: binary chunk, base64 in the JSON, or files beside it.

Accessors of a glTF file as arrays.
"""

from __future__ import annotations

import base64
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import UnreadableMeshError
from simplifier.geometry.mesh import FloatArray
from simplifier.io.claim import Peek
from simplifier.io.files import read_bytes
from simplifier.io.float32 import to_float64
from simplifier.io.gltf_container import GltfDocument, JsonObject, compressed

_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.\-]*:")
_DATA = re.compile(r"data:[^,]*;base64,", re.IGNORECASE)
_BESIDE = "put the file there, or export a single .glb"
_PARTS = re.compile(r"[/\\]")


@dataclass(eq=False)
class Buffers:
    """Buffers by index, each read once.

    ``zeros``  elements so far that were claimed without any data.
    """

    document: GltfDocument
    path: Path
    loaded: dict[int, bytes] = field(default_factory=dict)
    zeros: int = 0

    def view(self, index: int) -> tuple[bytes, int, int, int]:
        """Buffer view ``index`` as (bytes, begin, end, stride); stride 0 means tightly packed."""
        view = self.document.root.item("bufferViews", index)
        data = self._buffer(view.integer("buffer"), view)
        begin = view.integer("byteOffset", 0)
        end = begin + view.integer("byteLength")
        if end > len(data):
            raise view.fail(f"ends at byte {end} of a buffer of {len(data)}", "the file is damaged")
        return data, begin, end, view.integer("byteStride", 0)

    def _buffer(self, index: int, view: JsonObject) -> bytes:
        if index not in self.loaded:
            self.loaded[index] = self._load(index, view)
        return self.loaded[index]

    def _load(self, index: int, view: JsonObject) -> bytes:
        buffer = self.document.root.item("buffers", index)
        length = buffer.integer("byteLength")
        uri = buffer.members.get("uri")
        if isinstance(uri, str):
            data = _fetch(uri, self.path, buffer)
        elif index == 0 and self.document.binary is not None and uri is None:
            data = self.document.binary
        else:
            for extension in ("EXT_meshopt_compression", "KHR_meshopt_compression"):
                if view.has_extension(extension):
                    raise compressed(view, extension)
            raise buffer.fail("has neither data nor the name of a file", "export it again")
        if len(data) < length:
            raise buffer.fail(
                f"holds {len(data)} of {length} bytes", "the file is truncated; copy it again"
            )
        return data[:length]


def claimed_bytes(root: JsonObject, peek: Peek) -> int:
    """Of all buffers, none of them with more than its file has."""
    total = 0
    for index in range(root.count("buffers")):
        buffer = root.item("buffers", index)
        uri = buffer.members.get("uri")
        room = peek.size
        if isinstance(uri, str) and not _DATA.match(uri):
            room = _beside(uri, peek.path, buffer).stat().st_size
        total += min(buffer.integer("byteLength"), room)
    return total


def external_uris(root: JsonObject) -> list[str]:
    """What stands outside of the file: the names that its buffers have for other files."""
    buffers = root.members.get("buffers")
    # What is no buffer is refused where one is read from it.
    found = [one for one in buffers if isinstance(one, dict)] if isinstance(buffers, list) else []
    uris = [one.get("uri") for one in found]
    return [uri for uri in uris if isinstance(uri, str) and not _DATA.match(uri)]


def _fetch(uri: str, path: Path, buffer: JsonObject) -> bytes:
    header = _DATA.match(uri)
    if header:
        try:
            payload = "".join(unquote(uri[header.end() :]).split())
            return base64.b64decode(payload.encode("ascii"), validate=True)
        except ValueError:  # also what a non-ASCII letter and wrong padding raise
            raise buffer.fail("its base64 is damaged", "export it again") from None
    if uri[:5].lower() == "data:":
        raise buffer.fail("its data are not stated in base64", "export it again")
    target = _beside(uri, path, buffer)
    try:
        return read_bytes(target)
    except UnreadableMeshError as error:
        raise buffer.fail(f"names '{uri[:60]}': {error.what}", _BESIDE) from None


def _beside(uri: str, path: Path, buffer: JsonObject) -> Path:
    """The file that a relative URI names, refused when it is not under the folder of ``path``.

    A model from elsewhere must not make a service read its other files or call other machines.
    """
    name = unquote(uri)
    parts = _PARTS.split(name)
    folder = path.parent.resolve()
    if _SCHEME.match(uri) or _SCHEME.match(name) or parts[0] == "" or ".." in parts:
        raise _outside(uri, buffer)
    try:
        target = folder.joinpath(*parts).resolve()
    except (OSError, ValueError, RuntimeError):  # a NUL character, a loop of links
        raise _outside(uri, buffer) from None
    if not target.is_relative_to(folder):
        raise _outside(uri, buffer)
    return target


def _outside(uri: str, buffer: JsonObject) -> Exception:
    return buffer.fail(
        f"names '{uri[:60]}', but only files beside the glTF file are read",
        _BESIDE,
    )


_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}
# An accessor without data is all zeros and could claim any size, and a file have many of them.
_MOST_ZEROS = 1_000_000


def read_accessor(buffers: Buffers, index: int, kind: str) -> NDArray[Any]:
    """(count, width) in the stored dtype, sparse values put in.  May be a view into the file.

    ``kind`` is SCALAR, VEC3 or VEC4.  Raises ``UnreadableMeshError`` for another kind and for what
    lies out of bounds.
    """
    accessor = buffers.document.root.item("accessors", index)
    if accessor.members.get("type") != kind:
        raise accessor.fail(f"is not of type {kind}", "the file is damaged; export it again")
    dtype = _dtype(accessor)
    count, width = accessor.integer("count"), _WIDTHS[kind]
    if accessor.has("bufferView"):
        place = accessor.integer("bufferView"), accessor.integer("byteOffset", 0)
        values = _read_view(buffers, accessor, *place, dtype, count, width)
    else:
        buffers.zeros += count
        if buffers.zeros > _MOST_ZEROS:
            raise accessor.fail(
                f"claims {count} elements without any data, {buffers.zeros} with those before",
                "export it again",
            )
        values = np.zeros((count, width), dtype=dtype)
    if accessor.has("sparse"):
        values = _with_sparse(buffers, accessor, values)
    return values


def read_vectors(buffers: Buffers, index: int, kind: str) -> FloatArray:
    """(count, width) float64; normalized integers are scaled to [0, 1] or [-1, 1]."""
    values = read_accessor(buffers, index, kind)
    result = to_float64(values)
    accessor = buffers.document.root.item("accessors", index)
    if accessor.members.get("normalized") is True and values.dtype.kind in "iu":
        result = np.maximum(result / np.iinfo(values.dtype).max, -1.0)
    return result


def _dtype(owner: JsonObject) -> np.dtype[Any]:
    code = owner.integer("componentType")
    if code not in _TYPES:
        raise owner.fail(f"componentType {code} is unknown", "the file is damaged")
    return np.dtype(_TYPES[code])


def _read_view(
    buffers: Buffers,
    owner: JsonObject,
    view: int,
    offset: int,
    dtype: np.dtype[Any],
    count: int,
    width: int,
) -> NDArray[Any]:
    data, begin, end, stride = buffers.view(view)
    size = dtype.itemsize * width
    if 0 < stride < size:
        raise owner.fail(
            f"its elements of {size} bytes overlap: their buffer view has a byteStride of {stride}",
            "the file is damaged; export it again",
        )
    stride = stride or size
    start = begin + offset
    if count and start + stride * (count - 1) + size > end:
        raise owner.fail(
            f"{count} elements reach beyond their buffer view", "the file is damaged or truncated"
        )
    if not count:
        return np.zeros((0, width), dtype=dtype)
    strides = (stride, dtype.itemsize)
    return np.ndarray((count, width), dtype, data, offset=start, strides=strides)


def _with_sparse(buffers: Buffers, accessor: JsonObject, base: NDArray[Any]) -> NDArray[Any]:
    sparse = accessor.child("sparse")
    places, news = sparse.child("indices"), sparse.child("values")
    count = sparse.integer("count")
    indices, values = (
        _read_view(
            buffers,
            part,
            part.integer("bufferView"),
            part.integer("byteOffset", 0),
            dtype,
            count,
            width,
        )
        for part, dtype, width in (
            (places, _dtype(places), 1),
            (news, base.dtype, base.shape[1]),
        )
    )
    if indices.dtype.kind != "u" or (count and int(indices.max()) >= len(base)):
        raise sparse.fail("replaces elements that are not there", "the file is damaged")
    result = base.copy()
    result[indices[:, 0]] = values
    return result
