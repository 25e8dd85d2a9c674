"""Packed scenes, damaged: refused, or a tree that is written as it was."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from simplifier.io.occs_file import decode_occs, encode_occs
from tests.fuzz.promises import promise


def check_packed(data: bytes, folder: Path) -> None:
    """Raises ``OccluderError`` where it is refused."""
    tree = decode_occs(data, "packed.occs")
    promise(np.isfinite(tree.boxes).all(), "boxes are finite")
    promise(len(np.unique(tree.order)) == len(tree.parts), "each part is in one leaf")
    for index in range(len(tree.meshes)):
        vertices, faces = tree.mesh(index)
        promise(np.isfinite(vertices).all(), "vertices are finite")
        promise(faces.size == 0 or faces.max() < len(vertices), "faces name vertices")
    again = decode_occs(encode_occs(tree), "packed.occs")
    promise(encode_occs(again) == encode_occs(tree), "it is written as it is read")
