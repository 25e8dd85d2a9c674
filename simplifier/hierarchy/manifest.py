"""Build -> scene.json -> OccluderTree: the tree as a file, with its occluders beside it.

The schema is ``docs/scene.schema.json``.  Lengths and places are in world units, but for those of
``occluders`` that leaves use: these are in the space of the leaf's mesh, which ``transform`` takes
to the world.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from simplifier.checks import as_path
from simplifier.errors import MeshError, OptionError, SceneError
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.scene import Scene
from simplifier.hierarchy.build import Build
from simplifier.hierarchy.manifest_rows import (
    DAMAGE,
    keys_of,
    objects_of,
    occluders_of,
    options_of,
    parts_of,
    rows_of,
    summaries_of,
    tree_of,
    value_of,
)
from simplifier.hierarchy.occluder_tree import OccluderTree
from simplifier.hierarchy.options import SceneOptions
from simplifier.hierarchy.store import OccluderStore, Summary
from simplifier.io.atomic import make_folder, write_whole
from simplifier.io.source import read_bytes
from simplifier.version import VERSION

NAME = "scene.json"
FOLDER = "occluders"

SCHEMA_VERSION = 1
"""Raised when a key changes its meaning or goes; new keys do not raise it."""


def occluder_store(folder: Path) -> OccluderStore:
    """Where the occluders of a scene lie; made if it is not there.

    Raises :class:`~simplifier.errors.OutputError`.
    """
    make_folder(folder / FOLDER)
    return OccluderStore(folder / FOLDER)


def write_manifest(folder: Path, scene: Scene, options: SceneOptions, build: Build) -> None:
    """Write ``scene.json``, whole or not at all, and delete occluders that it does not name.

    Its bytes depend on the scene, the options and the version alone.  Raises
    :class:`~simplifier.errors.OutputError`.
    """
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
        keys = build.keys[node]
        row |= {name: key for name, key in (("far", keys.far), ("near", keys.near)) if key}
        nodes.append(row)
    return nodes


def read_summaries(folder: Path) -> dict[str, Summary]:
    """Of the occluders of an earlier build; none where there is no such build or it is damaged."""
    try:
        return summaries_of(value_of(_document(folder), "occluders", NAME))
    except (SceneError, *DAMAGE):
        return {}


def load_occluder_tree(folder: str | Path) -> OccluderTree:
    """What :func:`write_manifest` wrote, with its occluders.

    Raises :class:`SceneError` where the manifest or one of its occluders is missing, damaged, or
    of another schema version.  Every value is checked: what is returned is a tree.
    """
    folder = as_path("folder", folder)
    document = _document(folder)
    try:
        rows = rows_of(value_of(document, "nodes", NAME))
        tree = tree_of(rows)
        objects = objects_of(value_of(document, "objects", NAME))
        object_of, transforms = parts_of(rows, tree, len(objects))
        summaries = summaries_of(value_of(document, "occluders", NAME))
        keys = keys_of(rows, summaries)
        return OccluderTree(
            options_of(value_of(document, "options", NAME)), objects, object_of, tree, transforms,
            occluders_of(rows, keys), _read(OccluderStore(folder / FOLDER), keys, summaries),
            np.array([summaries[key].radius for key in keys]),
        )  # fmt: skip
    except (OptionError, *DAMAGE) as error:
        raise _damaged(folder / NAME, str(error)) from None


def _document(folder: Path) -> dict[str, Any]:
    path = folder / NAME
    remedy = "build the scene with 'occluder scene'"
    if not path.exists():
        raise SceneError(f"there is no {NAME}", where=str(folder), remedy=remedy)
    data = read_bytes(path, error=SceneError, remedy=remedy)
    try:
        document = json.loads(data)
    except (ValueError, RecursionError):
        raise _damaged(path, "it is not JSON") from None
    if not isinstance(document, dict):
        raise _damaged(path, "it is no JSON object")
    version = document.get("schema_version")
    if version != SCHEMA_VERSION:
        raise SceneError(
            f"it has schema version {version!r}, and this program reads {SCHEMA_VERSION}",
            where=str(path),
            remedy="build the scene again",
        )
    return document


def _read(
    store: OccluderStore, keys: Sequence[str], summaries: Mapping[str, Summary]
) -> tuple[Occluder, ...]:
    """Raises :class:`SceneError` where one is missing or not as it was written."""
    occluders = []
    for key in keys:
        try:
            if store.checksum(key) != summaries[key].checksum:
                raise _damaged(store.path(key), "it is not what was written")
            occluders.append(store.read(key))
        except MeshError as error:
            raise _damaged(store.path(key), error.what) from None
    return tuple(occluders)


def _damaged(path: Path, why: str) -> SceneError:
    return SceneError(f"it is damaged ({why})", where=str(path), remedy="build the scene again")
