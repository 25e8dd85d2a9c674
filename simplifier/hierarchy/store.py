"""Occluders kept under the hash of what they were made from."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import astuple
from pathlib import Path

import numpy as np

from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.hierarchy.node import Kind, Stand
from simplifier.hierarchy.options import SceneOptions
from simplifier.io import load_occluder, save_occluder
from simplifier.io.whole import make_folder
from simplifier.version import VERSION

_FORMAT = b"1"  # raised when the same input is to give another occluder


class OccluderStore:
    """A folder of ``<key>.glb``; each appears whole or not at all, so a killed run leaves no half.

    A node whose occluder would hide nothing has a file without triangles, so that it is not tried
    again.
    """

    def __init__(self, folder: Path) -> None:
        make_folder(folder)
        self._folder = folder

    def path(self, key: str) -> Path:
        return self._folder / f"{key}.glb"

    def keys(self) -> set[str]:
        """All that are there."""
        return {path.stem for path in self._folder.glob("*.glb")}

    def write(self, key: str, occluder: Occluder) -> None:
        save_occluder(occluder, self.path(key))

    def read(self, key: str) -> Occluder:
        """Raises :class:`~simplifier.errors.MeshError` where it is missing or damaged."""
        return load_occluder(self.path(key))

    def keep_only(self, keys: Iterable[str]) -> None:
        """Delete what no scene refers to any more."""
        for stale in self.keys() - set(keys):
            self.path(stale).unlink(missing_ok=True)


def mesh_key(mesh: TriangleMesh) -> bytes:
    """Of the geometry alone."""
    made = hashlib.sha256(len(mesh.vertices).to_bytes(8, "little"))
    made.update(np.ascontiguousarray(mesh.vertices).data)
    made.update(np.ascontiguousarray(mesh.faces).data)
    return made.digest()


def options_key(options: SceneOptions) -> bytes:
    """Of what an occluder depends on: neither the tree's width nor where it will be seen from."""
    kept = (
        options.budget, options.resolution, options.moves, options.up, options.ground,
        options.smallest_hole, options.conservative, options.seed, VERSION,
    )  # fmt: skip
    return _digest(_FORMAT, repr(kept).encode())


def leaf_key(mesh: bytes, kind: Kind, stand: Stand, options: bytes) -> str:
    """Of an occluder of a mesh, in the mesh's own space."""
    return _digest(kind.encode(), mesh, repr(astuple(stand)).encode(), options).hex()[:32]


def placed_key(mesh: bytes, transform: FloatArray) -> bytes:
    """Of a mesh at its place in the world."""
    return _digest(b"placed", mesh, np.ascontiguousarray(transform).tobytes())


def node_key(below: Iterable[bytes], stand: Stand, options: bytes) -> str:
    """Of an inner node from the keys of all parts below it, in an order that they alone decide."""
    return _digest(b"inner", repr(astuple(stand)).encode(), options, *below).hex()[:32]


def _digest(*pieces: bytes) -> bytes:
    made = hashlib.sha256()
    for piece in pieces:
        made.update(len(piece).to_bytes(8, "little"))
        made.update(piece)
    return made.digest()
