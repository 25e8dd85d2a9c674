"""Keys: the hash of all that an occluder is made from."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import astuple

import numpy as np

from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.hierarchy.node import Kind, Stand
from simplifier.hierarchy.options import SceneOptions
from simplifier.version import VERSION

_FORMAT = b"5"  # raised when the same input is to give another occluder
_DIGITS = 32


def mesh_key(mesh: TriangleMesh) -> bytes:
    """Of the geometry alone."""
    made = hashlib.sha256(len(mesh.vertices).to_bytes(8, "little"))
    made.update(np.ascontiguousarray(mesh.vertices).data)
    made.update(np.ascontiguousarray(mesh.faces).data)
    return made.digest()


def options_key(options: SceneOptions) -> bytes:
    """Of what all occluders depend on: neither the tree's width nor where they will be seen from.

    Up, ground and hole are not among it: a :class:`Stand` has what they mean for some triangles.
    """
    kept = (
        options.budget, options.resolution, options.moves, options.conservative, options.seed,
        VERSION,
    )  # fmt: skip
    return _digest(_FORMAT, repr(kept).encode())


def leaf_key(mesh: bytes, kind: Kind, stand: Stand, options: bytes) -> str:
    """Of an occluder of a mesh, in the mesh's own space."""
    return _digest(kind.encode(), mesh, _said(stand), options).hex()[:_DIGITS]


def placed_key(mesh: bytes, transform: FloatArray) -> bytes:
    """Of a mesh at its place in the world."""
    # Both of one length each, so no lengths are needed to tell them apart; scenes have many.
    return hashlib.sha256(b"placed" + mesh + transform.tobytes()).digest()


def node_key(below: Iterable[bytes], stand: Stand, options: bytes) -> str:
    """Of an inner node from the keys of all parts below it, in an order that they alone decide."""
    return _digest(b"inner", _said(stand), options, b"".join(below)).hex()[:_DIGITS]


def is_key(text: str) -> bool:
    """Whether a text can be a key, and so is safe as the name of a file."""
    return len(text) == _DIGITS and set(text) <= set("0123456789abcdef")


def _said(stand: Stand) -> bytes:
    return repr(astuple(stand)).encode()


def _digest(*pieces: bytes) -> bytes:
    made = hashlib.sha256()
    for piece in pieces:
        made.update(len(piece).to_bytes(8, "little"))
        made.update(piece)
    return made.digest()
