"""The buffers of a glTF file: binary chunk, base64 in the JSON, or files beside it."""

from __future__ import annotations

import base64
import re
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import unquote

from simplifier.io.claim import Peek
from simplifier.io.gltf_container import GltfDocument, compressed
from simplifier.io.gltf_json import JsonObject
from simplifier.io.source import read_bytes

_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.\-]*:")
_DATA = re.compile(r"data:[^,]*;base64,", re.IGNORECASE)
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
                if view.child("extensions").has(extension):
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
    uris = [
        root.item("buffers", index).members.get("uri") for index in range(root.count("buffers"))
    ]
    return [uri for uri in uris if isinstance(uri, str) and not _DATA.match(uri)]


def _fetch(uri: str, path: Path, buffer: JsonObject) -> bytes:
    header = _DATA.match(uri)
    if header:
        try:
            payload = "".join(unquote(uri[header.end() :]).split())
            return base64.b64decode(payload.encode("ascii"), validate=True)
        except ValueError:  # also what a non-ASCII letter and wrong padding raise
            raise buffer.fail("its base64 is damaged", "export it again") from None
    return read_bytes(_beside(uri, path, buffer))


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
        "put the file there, or export a single .glb",
    )
