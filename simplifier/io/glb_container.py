"""A glTF document and its binary buffer as the bytes of a GLB file."""

from __future__ import annotations

import json
from typing import Any

from simplifier.io.gltf_container import BINARY_CHUNK, GLB_MAGIC, JSON_CHUNK


def glb_bytes(document: dict[str, Any], binary: bytes) -> bytes:
    """Strict JSON, then the buffer unless it is empty; chunks padded to 4 bytes."""
    text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode("ascii")
    chunks = [(JSON_CHUNK, _padded(text, b" "))]
    if binary:
        chunks.append((BINARY_CHUNK, _padded(binary, b"\0")))
    body = b"".join(
        len(chunk).to_bytes(4, "little") + kind.to_bytes(4, "little") + chunk
        for kind, chunk in chunks
    )
    header = GLB_MAGIC + (2).to_bytes(4, "little") + (12 + len(body)).to_bytes(4, "little")
    return header + body


def _padded(chunk: bytes, filler: bytes) -> bytes:
    return chunk + filler * (-len(chunk) % 4)
