"""Read back the levels of detail that ``glb_writer.encode_lods`` wrote."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np

from simplifier.errors import EmptyMeshError, OptionError
from simplifier.geometry.camera import Lens
from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.occluder import Level, LodChain, Occluder
from simplifier.io.gltf import GENERATOR, read_instances
from simplifier.io.gltf_buffers import Buffers
from simplifier.io.gltf_container import JsonObject, number_or_nan, open_document
from simplifier.io.gltf_levels import level_ids
from simplifier.io.gltf_scene import instances_of, scene_nodes, subtree


def decode_lods(data: bytes, path: Path) -> LodChain:
    """The levels with their error bounds, finest first, and the lens that they were made for.

    Raises :class:`UnreadableMeshError` when the file has no levels or those of several objects,
    when one is missing, has lost its figures or is named twice, when they form a cycle, or when
    error bounds fall from one level to the next.
    """
    buffers = Buffers(open_document(data, str(path)), path)
    root = buffers.document.root
    index, parent = _finest(root)
    ids = [index, *level_ids(root).get(index, [])]
    levels = tuple(_level(buffers, one, level, parent, str(path)) for level, one in enumerate(ids))
    node = root.item("nodes", index)
    for finer, coarser in pairwise(levels):
        if coarser.error_bound < finer.error_bound:
            raise node.fail("the error bounds of its levels fall", "export it again")
    stored = node.child("extras").child("lens")
    try:
        lens = Lens(stored.integer("screen_height"), _positive(stored, "fov"))
    except OptionError as error:
        raise stored.fail(f"this is not a screen ({error})", "export it again") from None
    return LodChain(levels, lens, _positive(stored, "pixel_error"))


def _finest(root: JsonObject) -> tuple[int, FloatArray]:
    """The only node of the scene that is the finest level of something.

    Its number, and (4, 4) from its parent's space to the world.
    """
    nodes = scene_nodes(root)
    found = [place for place, node in enumerate(nodes.nodes) if _is_finest(node)]
    if len(found) != 1:
        what = "holds no levels of detail" if not found else "holds levels of several objects"
        raise root.fail(what, "name a .glb that was written with levels of detail")
    above = nodes.parents[found[0]]
    return nodes.indices[found[0]], nodes.world()[above] if above >= 0 else np.eye(4)


def _is_finest(node: JsonObject) -> bool:
    extras = node.members.get("extras")
    return (
        isinstance(extras, dict)
        and extras.get("generator") == GENERATOR
        and extras.get("level") == 0
    )


def _level(buffers: Buffers, index: int, level: int, parent: FloatArray, where: str) -> Level:
    root = buffers.document.root
    node = root.item("nodes", index)
    extras = node.child("extras")
    if extras.integer("level") != level:
        raise node.fail(f"this should be level {level}", "export it again")
    bound = number_or_nan(extras.members.get("error_bound", math.inf))
    deviation = number_or_nan(extras.members.get("deviation"))
    if not (bound >= 0.0 and 0.0 <= deviation < math.inf):
        raise node.fail("its error bound or deviation is not a length", "export it again")
    below = subtree(root, index)
    instances = instances_of(buffers, below, parent @ below.world())
    vertices, faces = read_instances(buffers, instances, where)
    try:
        mesh = TriangleMesh.from_soup(vertices, faces, where=where)
    except EmptyMeshError:
        occluder = Occluder(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32), bound)
    else:
        occluder = Occluder(mesh.vertices, mesh.faces, bound)
    return Level(occluder, extras.integer("resolution"), deviation)


def _positive(stored: JsonObject, key: str) -> float:
    value = number_or_nan(stored.members.get(key))
    if not 0.0 < value < math.inf:
        raise stored.fail(f"'{key}' is not a positive number", "export it again")
    return value
