"""Write an occluder, or a chain of levels, as a GLB that any viewer shows properly.

The bytes depend on the occluders alone.  Levels follow the extension MSFT_lod: the finest node, the
only one of the scene, names the coarser ones, so that a viewer without it shows the finest.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from simplifier.geometry.lod_chain import LodChain
from simplifier.geometry.occluder import Occluder
from simplifier.io.glb_meshes import GlbMeshes
from simplifier.io.gltf import GENERATOR
from simplifier.io.gltf_container import pack_glb
from simplifier.io.gltf_levels import EXTENSION


def encode(occluder: Occluder) -> bytes:
    """A GLB with one node "occluder" and, unless there is no face, one mesh.

    The extras of node and mesh hold the generator, the number of triangles and, when finite, the
    error bound.  Raises :class:`OutputError` when the occluder does not fit float32.
    """
    extras, meshes = occluder_extras(occluder), GlbMeshes()
    node = {"name": "occluder", "extras": extras, **meshes.add(occluder, extras)}
    return pack_glb(_root([node]) | meshes.document(), meshes.binary)


def encode_lods(chain: LodChain) -> bytes:
    """A GLB with a node a level, finest first, "occluder_lod0" and so on.

    The extras of a node also hold its level, resolution, deviation, switch distance, and the screen
    and pixel error that this is for; those of the finest the screen coverages too.  Raises
    :class:`OutputError` when an occluder does not fit float32.
    """
    meshes = GlbMeshes()
    nodes = [
        {
            "name": f"occluder_lod{index}",
            "extras": _level_extras(chain, index),
            **meshes.add(level.occluder, occluder_extras(level.occluder)),
        }
        for index, level in enumerate(chain.levels)
    ]
    root = _root(nodes)
    if len(nodes) > 1:
        nodes[0]["extensions"] = {EXTENSION: {"ids": list(range(1, len(nodes)))}}
        nodes[0]["extras"]["MSFT_screencoverage"] = screen_coverages(chain)
        root["extensionsUsed"] = [EXTENSION]
    return pack_glb(root | meshes.document(), meshes.binary)


def screen_coverages(chain: LodChain) -> list[float]:
    """The least share of the screen's height from which each level is shown; 0 for the last.

    It is that of the finest occluder's bounding sphere where its near side is at the distance from
    which the next level is good enough: what a viewer that has only this file can find out itself.
    """
    occluder = chain.levels[0].occluder
    corners = occluder.vertices[occluder.faces].reshape(-1, 3)
    if len(corners) == 0:
        return [0.0] * len(chain.levels)
    centre = corners.min(axis=0) / 2.0 + corners.max(axis=0) / 2.0
    radius = float(np.linalg.norm(corners - centre, axis=1).max())
    distances = [chain.switch_distance(index) for index in range(1, len(chain.levels))]
    return [*(_coverage(chain, radius, distance) for distance in distances), 0.0]


def _coverage(chain: LodChain, radius: float, distance: float) -> float:
    """The outline of a sphere, ``distance`` from its near side, in screen heights, at most 1."""
    tangent = math.sqrt(distance) * math.sqrt(distance + 2.0 * radius)
    diameter = 2.0 * radius * chain.lens.focal
    return diameter / (tangent * chain.lens.rows) if diameter < tangent * chain.lens.rows else 1.0


def _root(nodes: list[dict[str, Any]]) -> dict[str, Any]:
    """A scene of the first node."""
    return {
        "asset": {"version": "2.0", "generator": GENERATOR},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": nodes,
    }


def occluder_extras(occluder: Occluder) -> dict[str, Any]:
    """What a node tells of its occluder."""
    extras: dict[str, Any] = {"generator": GENERATOR, "triangles": len(occluder.faces)}
    if math.isfinite(occluder.error_bound):
        extras["error_bound"] = float(occluder.error_bound)
    return extras


def _level_extras(chain: LodChain, index: int) -> dict[str, Any]:
    level, distance = chain.levels[index], chain.switch_distance(index)
    extras = occluder_extras(level.occluder) | {
        "level": index,
        "resolution": level.resolution,
        "deviation": float(level.deviation),
        "lens": {
            "screen_height": chain.lens.rows,
            "fov": float(chain.lens.fov),
            "pixel_error": float(chain.pixel_error),
        },
    }
    if math.isfinite(distance):
        extras["switch_distance"] = distance
    return extras
