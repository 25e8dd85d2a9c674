"""``scene.occs`` beside ``scene.json``: the same tree in one file for engines."""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from simplifier.errors import OutputError, SceneError
from simplifier.geometry.packed_tree import PackedTree
from simplifier.hierarchy.occluder_tree import NodeTree, OccluderTree
from simplifier.hierarchy.packing import WeldedMesh, pack_meshes
from simplifier.hierarchy.scene_file import SCENE_FILE
from simplifier.io.files import read_bytes, write_whole
from simplifier.io.occs_file import decode_occs, encode_occs

PACKED_FILE = "scene.occs"
_RANKED = "frame_triangles"  # of ``about``: the budget that occluders were ranked for
_MANIFEST = "manifest"  # of ``about``: CRC-32 of the scene.json that the file was made with


@dataclass(frozen=True, eq=False)
class Packed:
    """``scene.occs`` as it lies in a ``folder``: its bytes, and the tree that these hold."""

    folder: Path
    data: bytes
    tree: PackedTree

    def is_current(self) -> bool:
        """Whether it is of the ``scene.json`` that lies there now, and not ranked."""
        about = self.tree.about
        try:
            return _RANKED not in about and about.get(_MANIFEST) == _manifest(self.folder)
        except SceneError:
            return False

    def meshes(self, keys: Sequence[str]) -> dict[str, WeldedMesh]:
        """Its occluders by key; ``keys`` are those that the nodes of its ``scene.json`` have.  None
        where it is not of the ``scene.json`` there.

        Reading thousands of occluders again takes longer than all else of a small change.
        """
        if len(self.tree.meshes) != len(keys) or not self.is_current():
            return {}
        return {key: WeldedMesh.packed(self.tree, index) for index, key in enumerate(keys)}


def read_packed(folder: Path) -> Packed | None:
    """None where there is no ``scene.occs``, or a damaged one."""
    try:
        data = read_bytes(folder / PACKED_FILE, error=SceneError)
        return Packed(folder, data, decode_occs(data, PACKED_FILE))
    except SceneError:
        return None


def write_packed(folder: Path, tree: OccluderTree) -> bytes:
    """Write ``scene.occs``, whole or not at all; what it holds now.

    ``tree`` is what ``scene.json`` in the folder says.  Raises
    :class:`~simplifier.errors.OutputError`; an older file is gone then.
    """
    return write_meshes(folder, tree, map(WeldedMesh.of, tree.occluders))


def write_meshes(folder: Path, tree: NodeTree, occluders: Iterable[WeldedMesh]) -> bytes:
    """As :func:`write_packed`, of occluders that are welded already."""
    path = folder / PACKED_FILE
    try:
        packed = pack_meshes(tree, occluders)
        about = {**packed.about, _MANIFEST: _manifest(folder)}
        data = encode_occs(replace(packed, about=about))
    except OutputError:
        path.unlink(missing_ok=True)
        raise
    write_whole(path, data)
    return data


def write_ranked(folder: Path, ranked: PackedTree, frame_triangles: int) -> bytes:
    """Write ``scene.occs`` with the worth of its nodes, whole or not at all; what it holds now."""
    about = {**ranked.about, _RANKED: frame_triangles}
    data = encode_occs(replace(ranked, about=about))
    write_whole(folder / PACKED_FILE, data)
    return data


def _manifest(folder: Path) -> int:
    return zlib.crc32(read_bytes(folder / SCENE_FILE, error=SceneError))
