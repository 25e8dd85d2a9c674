"""Packed scenes, damaged: refused by Python and C alike, or a tree that both walk alike."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from simplifier.culling.culler import Culler
from simplifier.culling.depth_buffer import DepthBuffer
from simplifier.errors import SceneError
from simplifier.geometry.camera import Camera
from simplifier.geometry.packed_tree import PackedTree
from simplifier.io.occs_file import decode_occs, encode_occs
from simplifier.kernels.native import NativeTree, library
from tests.fuzz.promises import promise


def check_packed(data: bytes, folder: Path) -> None:
    """Raises ``OccluderError`` where it is refused."""
    try:
        tree = decode_occs(data, "packed.occs")
    except SceneError as error:
        # What a file says about itself is nothing to engines.
        promise("about itself" in str(error) or not _taken_in_c(data), "C refuses it, too")
        raise
    promise(_taken_in_c(data) or library() is None, "C takes it, too")
    _check_walks(tree)
    promise(np.isfinite(tree.boxes).all(), "boxes are finite")
    promise(len(np.unique(tree.order)) == len(tree.parts), "each part is in one leaf")
    for index in range(len(tree.meshes)):
        vertices, faces = tree.mesh(index)
        promise(np.isfinite(vertices).all(), "vertices are finite")
        promise(faces.size == 0 or faces.max() < len(vertices), "faces name vertices")
    again = decode_occs(encode_occs(tree), "packed.occs")
    promise(encode_occs(again) == encode_occs(tree), "it is written as it is read")


def _taken_in_c(data: bytes) -> bool:
    if library() is None:
        return False
    try:
        NativeTree(data)
    except ValueError:
        return False
    return True


def _check_walks(tree: PackedTree) -> None:
    """From beside the root's box, and from within it."""
    low, high = tree.boxes[0]
    for share in (-0.5, 0.4):
        eye = low + (high - low) * [share, 0.5, 0.5]
        camera = Camera.looking(eye, np.array([1.0, 0, 0]), np.array([0.0, 0, 1]), 60.0, 0.1)
        for coverage in ("centre", "inner"):
            plain, compiled = (Culler(tree, DepthBuffer(18, 32, coverage)) for _ in range(2))
            plain.buffer.native = None
            one, other = plain.cull(camera), compiled.cull(camera)
            promise(one.drawn == other.drawn, "C draws the same occluders")
            promise((one.verdicts == other.verdicts).all(), "C judges alike")
