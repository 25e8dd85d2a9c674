"""What ``occluder scene`` left behind, damaged: refused, or a tree that can be culled with."""

from __future__ import annotations

import json
import shutil
import zlib
from pathlib import Path

import numpy as np

from simplifier.culling.culler import Culler
from simplifier.culling.depth_buffer import DepthBuffer, Verdict
from simplifier.geometry.camera import Camera
from simplifier.hierarchy.occluder_tree import OccluderTree
from simplifier.hierarchy.scene_file import load_occluder_tree, occluder_store, read_earlier
from tests.fuzz.promises import promise
from tests.fuzz.promises.mesh_files import check_occluder

BUILT = Path(__file__).parents[1] / "built_scene"
"""A small scene as ``python -m tests.fuzz.seeds`` built it."""

_VIEWS = (([0.0, 1.0, -9.0], [0.0, 0.0, 1.0]), ([4.0, 30.0, 4.0], [0.1, -1.0, 0.0]))


def check_manifest(data: bytes, folder: Path) -> None:
    """``data`` in place of scene.json; raises ``OccluderError`` where that is refused."""
    place = _copy(folder / "manifest")
    (place / "scene.json").write_bytes(data)
    read_earlier(place)  # never raises: a damaged manifest is no manifest
    check_tree(load_occluder_tree(place))


def check_stored(data: bytes, folder: Path) -> None:
    """``data`` in place of one stored occluder, by a manifest that believes it to be whole."""
    place = _copy(folder / "stored")
    document = json.loads((BUILT / "scene.json").read_bytes())
    key = min(document["occluders"])
    store = occluder_store(place)
    store.path(key).write_bytes(data)
    kept = store.kept(key)
    promise(kept is None or kept == store.summary(key), "what is kept can be read")
    document["occluders"][key]["checksum"] = zlib.crc32(data)
    (place / "scene.json").write_text(json.dumps(document))
    check_tree(load_occluder_tree(place))


def _copy(place: Path) -> Path:
    """Made once: what is damaged is written anew each time, and nothing else changes."""
    if not place.exists():
        shutil.copytree(BUILT, place)
    return place


def check_tree(tree: OccluderTree) -> None:
    """A tree over all parts, and verdicts on each of them from anywhere."""
    parts = len(tree.tree.order)
    promise(np.array_equal(np.sort(tree.tree.order), np.arange(parts)), "each part is in one leaf")
    promise(np.isfinite(tree.tree.bounds).all(), "boxes are finite")
    promise((tree.object_of < len(tree.objects)).all(), "each part is of an object")
    for occluder in tree.occluders:
        check_occluder(occluder)
        promise(occluder.error_bound < np.inf, "an occluder of a tree has an error bound")
    culler = Culler(tree, DepthBuffer(18, 32))
    for position, ahead in _VIEWS:
        camera = Camera.looking(
            np.array(position), np.array(ahead), np.array([0.0, 1.0, 0.0]), 60.0, 0.05
        )
        verdicts = culler.cull(camera).verdicts
        promise(verdicts.shape == (parts,), "a verdict a part")
        promise(set(verdicts.tolist()) <= set(Verdict), "a verdict is one of three")
