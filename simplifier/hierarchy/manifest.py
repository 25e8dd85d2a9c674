"""Build <-> scene.json: the tree as a file, with its occluders beside it.

The schema is ``docs/scene.schema.json``.  Lengths and places are in world units, but for those of
``occluders`` that leaves use: these are in the space of the leaf's mesh, which ``transform`` takes
to the world.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from simplifier.errors import OptionError, SceneError
from simplifier.geometry.mesh import IntArray
from simplifier.geometry.scene import Scene
from simplifier.hierarchy.build import Build
from simplifier.hierarchy.node import Summary
from simplifier.hierarchy.occluder_tree import LEVELS, OccluderTree
from simplifier.hierarchy.options import SceneOptions
from simplifier.hierarchy.store import OccluderStore
from simplifier.hierarchy.tree import Tree
from simplifier.io.whole import write_whole
from simplifier.version import VERSION

NAME = "scene.json"
FOLDER = "occluders"

SCHEMA_VERSION = 1
"""Raised when a key changes its meaning or goes; new keys do not raise it."""


def occluder_store(folder: Path) -> OccluderStore:
    """Where the occluders of a scene lie."""
    return OccluderStore(folder / FOLDER)


def write_manifest(folder: Path, scene: Scene, options: SceneOptions, build: Build) -> None:
    """Write ``scene.json``, whole or not at all, and delete occluders that it does not name."""
    document = {
        "schema_version": SCHEMA_VERSION,
        "version": VERSION,
        "options": asdict(options),
        "objects": list(scene.names),
        "nodes": _nodes(build),
        "occluders": {
            key: {"file": f"{FOLDER}/{key}.glb", **asdict(summary)}
            for key, summary in sorted(build.summaries.items())
        },
        "warnings": [*scene.warnings, *build.warnings],
    }
    text = json.dumps(document, separators=(",", ":"), allow_nan=False)
    write_whole(folder / NAME, text.replace('},{"bounds"', '},\n{"bounds"').encode())
    occluder_store(folder).keep_only(build.summaries)


def _nodes(build: Build) -> list[dict[str, Any]]:
    tree, parts = build.tree, build.parts
    bounds, children = tree.bounds.tolist(), tree.children.tolist()
    starts = tree.order[tree.spans[:, 0]].tolist()
    transforms = parts.scene.transforms[:, :3].tolist()
    nodes = []
    for node, (first, count) in enumerate(children):
        row: dict[str, Any] = {"bounds": bounds[node]}
        if count:
            row["children"] = [first, count]
        else:
            part = starts[node]
            row |= {
                "object": int(parts.object_of[part]),
                "part": part,
                "transform": transforms[part],
            }
        row |= {name: key for name, key in asdict(build.keys[node]).items() if key is not None}
        nodes.append(row)
    return nodes


def read_summaries(folder: Path) -> dict[str, Summary]:
    """Of the occluders of an earlier build; none where there is no such build or it is damaged."""
    try:
        rows = json.loads((folder / NAME).read_bytes())["occluders"]
        return {key: _summary(row) for key, row in rows.items()}
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        return {}


def _summary(row: Mapping[str, Any]) -> Summary:
    return Summary(int(row["triangles"]), float(row["error_bound"]), float(row["radius"]))


def load_occluder_tree(folder: str | Path) -> OccluderTree:
    """What :func:`write_manifest` wrote, with its occluders.

    Raises :class:`SceneError` where the manifest or one of its occluders is missing or damaged.
    """
    folder = Path(folder)
    path = folder / NAME
    try:
        document = json.loads(path.read_bytes())
    except OSError as error:
        raise SceneError(
            f"there is no {NAME} ({error.strerror})",
            where=str(folder),
            remedy="build it with 'occluder scene'",
        ) from None
    except ValueError:
        raise _damaged(path, "it is not JSON") from None
    try:
        version = document["schema_version"]
        if version != SCHEMA_VERSION:
            raise _damaged(path, f"its schema version is {version}, not {SCHEMA_VERSION}")
        return _tree_of(document, folder)
    except (LookupError, TypeError, ValueError, AttributeError, OptionError) as error:
        raise _damaged(path, f"{type(error).__name__}: {error}") from None


def _damaged(path: Path, why: str) -> SceneError:
    return SceneError(f"it is damaged ({why})", where=str(path), remedy="build the scene again")


def _tree_of(document: Mapping[str, Any], folder: Path) -> OccluderTree:
    rows = document["nodes"]
    children = np.array([row.get("children", (0, 0)) for row in rows], dtype=np.int32)
    parts = np.array([row.get("part", -1) for row in rows], dtype=np.int32)
    order, spans = _depth_first(children, parts)
    tree = Tree(np.array([row["bounds"] for row in rows]), children, spans, order)
    count = len(order)
    object_of = np.empty(count, dtype=np.int32)
    transforms = np.tile(np.eye(4), (count, 1, 1))
    for row in rows:
        if "part" in row:
            object_of[row["part"]] = row["object"]
            transforms[row["part"], :3] = row["transform"]
    keys = sorted({row[name] for row in rows for name in LEVELS if name in row})
    place = {key: index for index, key in enumerate(keys)}
    store = OccluderStore(folder / FOLDER)
    radii = np.array([_summary(document["occluders"][key]).radius for key in keys])
    occluder_of = [[place.get(row.get(name), -1) for name in LEVELS] for row in rows]
    return OccluderTree(
        SceneOptions(**document["options"]), tuple(document["objects"]), object_of, tree,
        transforms, np.array(occluder_of, dtype=np.int32),
        tuple(store.read(key) for key in keys), radii,
    )  # fmt: skip


def _depth_first(children: IntArray, parts: IntArray) -> tuple[IntArray, IntArray]:
    """(order, spans) of a tree: parts in the order of its leaves, and what lies below each node."""
    order: list[int] = []
    spans = np.zeros((len(children), 2), dtype=np.int32)
    waiting = [(0, False)]
    while waiting:
        node, left = waiting.pop()
        first, count = children[node].tolist()
        if left:
            spans[node, 1] = len(order)
            continue
        spans[node, 0] = len(order)
        if count == 0:
            order.append(int(parts[node]))
        elif first <= node or first + count > len(children):
            raise ValueError(f"node {node} has children that are not there or before it")
        waiting.append((node, True))
        waiting += [(child, False) for child in range(first + count - 1, first - 1, -1)]
    if sorted(order) != list(range(len(order))):
        raise ValueError("its leaves do not hold every part once")
    return np.array(order, dtype=np.int32), spans
