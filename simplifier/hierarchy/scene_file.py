"""Build -> scene.json -> OccluderTree: the tree as a file, with its occluders beside it.

The schema is ``docs/scene.schema.json``.  Lengths and places are in world units, but for those of
``occluders`` that leaves use: these are in the space of the leaf's mesh, which ``transform`` takes
to the world.

Values of scene.json -> arrays, each checked, so that a damaged file gives no broken tree.

All raise one of :data:`DAMAGE`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import orjson  # json takes ten times as long to write a scene's numbers, and twice to read them
from numpy.typing import ArrayLike, NDArray

from simplifier.checks import as_path
from simplifier.errors import MeshError, OptionError, SceneError
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.scene import Scene
from simplifier.hierarchy.node_plan import is_key
from simplifier.hierarchy.occluder_tree import LEVELS, OccluderTree, TreeOutline
from simplifier.hierarchy.scene_build import Build
from simplifier.hierarchy.store import OccluderStore, Summary
from simplifier.hierarchy.tree import Tree
from simplifier.io.files import make_folder, read_bytes, write_whole
from simplifier.io.occs_checks import check_object_order
from simplifier.io.places import is_there
from simplifier.options.scene import SceneOptions
from simplifier.version import VERSION

SCENE_FILE = "scene.json"
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
        "options": options.chosen(),
        "objects": list(scene.names),
        "nodes": _nodes(build),
        "occluders": {
            key: {"file": f"{FOLDER}/{key}.glb", **vars(summary)}
            for key, summary in sorted(build.summaries.items())
        },
        "warnings": [*scene.warnings, *build.warnings],
    }
    write_whole(folder / SCENE_FILE, _text(document))
    occluder_store(folder).keep_only(build.summaries)


def _text(document: Mapping[str, Any]) -> bytes:
    """orjson writes the nodes alone: names from Python may have characters that it refuses."""
    parts = {
        name: value
        if name == "nodes"
        else orjson.Fragment(json.dumps(value, separators=(",", ":"), allow_nan=False))
        for name, value in document.items()
    }
    return orjson.dumps(parts).replace(b'},{"bounds"', b'},\n{"bounds"')


def _nodes(build: Build) -> list[dict[str, Any]]:
    """Raises ValueError for numbers that are not finite, for which orjson would write null."""
    tree, parts = build.tree, build.parts
    boxes = _numbers(tree.bounds, (2, 3), "bounds").tolist()
    transforms = _numbers(parts.scene.transforms[:, :3], (3, 4), "transform").tolist()
    objects, starts = parts.object_of.tolist(), tree.order[tree.spans[:, 0]].tolist()
    nodes = []
    for bounds, children, part, keys in zip(
        boxes, tree.children.tolist(), starts, build.keys, strict=True
    ):
        row: dict[str, Any] = {"bounds": bounds}
        if children[1]:
            row["children"] = children
        else:
            row["object"] = objects[part]
            row["part"] = part
            row["transform"] = transforms[part]
        if keys.far:
            row["far"] = keys.far
        if keys.near:
            row["near"] = keys.near
        nodes.append(row)
    return nodes


@dataclass(frozen=True)
class Earlier:
    """What an earlier build says of its occluders, by key; ``keys`` are those that nodes have,
    ascending."""

    summaries: Mapping[str, Summary]
    keys: Sequence[str]


def read_earlier(folder: Path) -> Earlier:
    """Nothing where there is no such build or it is damaged."""
    summaries: Mapping[str, Summary] = {}
    try:
        document = _document(folder)
        summaries = summaries_of(value_of(document, "occluders", SCENE_FILE))
        return Earlier(
            summaries, keys_of(rows_of(value_of(document, "nodes", SCENE_FILE)), summaries)
        )
    except (SceneError, *DAMAGE):
        return Earlier(summaries, ())


def outline_of(scene: Scene, options: SceneOptions, build: Build) -> tuple[TreeOutline, list[str]]:
    """What :func:`load_occluder_tree` gives of what was built, but for the triangles of the
    occluders, whose keys these are."""
    parts, tree = build.parts, build.tree
    leaves = tree.order[tree.spans[:, 0]]
    order, spans = _depth_first(
        tree.children.astype(np.int64), np.where(tree.is_leaf, leaves, -1).astype(np.int64)
    )
    used = sorted({key for node in build.keys for key in (node.far, node.near) if key})
    place = {key: index for index, key in enumerate(used)}
    found = [[place[key] if key else -1 for key in (node.far, node.near)] for node in build.keys]
    transforms = np.tile(np.eye(4), (len(parts.object_of), 1, 1))
    transforms[:, :3] = parts.scene.transforms[:, :3]
    return TreeOutline(
        options_of(options.chosen()), scene.names, parts.object_of,
        Tree(tree.bounds, tree.children, spans, order), transforms,
        np.array(found, dtype=np.int32),
        np.array([build.summaries[key].error_bound for key in used], dtype=np.float64),
        np.array([build.summaries[key].radius for key in used], dtype=np.float64),
    ), used  # fmt: skip


def load_occluder_tree(folder: str | Path) -> OccluderTree:
    """What :func:`write_manifest` wrote, with its occluders.

    Raises :class:`SceneError` where the manifest or one of its occluders is missing, damaged, or
    of another schema version.  Every value is checked: what is returned is a tree.
    """
    folder = as_path("folder", folder)
    document = _document(folder)
    try:
        rows = rows_of(value_of(document, "nodes", SCENE_FILE))
        tree = tree_of(rows)
        objects = objects_of(value_of(document, "objects", SCENE_FILE))
        object_of, transforms = parts_of(rows, tree, len(objects))
        summaries = summaries_of(value_of(document, "occluders", SCENE_FILE))
        keys = keys_of(rows, summaries)
        return OccluderTree(
            options_of(value_of(document, "options", SCENE_FILE)), objects, object_of, tree,
            transforms, occluders_of(rows, keys),
            _read_occluders(OccluderStore(folder / FOLDER), keys, summaries),
            np.array([summaries[key].radius for key in keys]),
        )  # fmt: skip
    except (OptionError, *DAMAGE) as error:
        raise _damage(folder / SCENE_FILE, str(error)) from None


def _document(folder: Path) -> dict[str, Any]:
    path = folder / SCENE_FILE
    remedy = "build the scene with 'occluder scene'"
    if not is_there(path):
        raise SceneError(f"there is no {SCENE_FILE}", where=str(folder), remedy=remedy)
    data = read_bytes(path, error=SceneError, remedy=remedy)
    try:
        document = _parsed(data)
    except (ValueError, RecursionError):
        raise _damage(path, "it is not JSON") from None
    if not isinstance(document, dict):
        raise _damage(path, "it is not a JSON object")
    version = document.get("schema_version")
    if version != SCHEMA_VERSION:
        raise SceneError(
            f"it has schema version {version!r}, and this program reads {SCHEMA_VERSION}",
            where=str(path),
            remedy="build the scene again",
        )
    return document


def _parsed(data: bytes) -> Any:
    """Raises ValueError or RecursionError for what is not JSON."""
    try:
        return orjson.loads(data)
    except ValueError:
        return json.loads(data)  # this takes NaN and infinity, whose place is named later


def _read_occluders(
    store: OccluderStore, keys: Sequence[str], summaries: Mapping[str, Summary]
) -> tuple[Occluder, ...]:
    """Raises :class:`SceneError` where one is missing or not as it was written."""
    occluders = []
    for key in keys:
        try:
            occluders.append(store.read(key, summaries[key].checksum))
        except MeshError as error:
            raise _damage(store.path(key), error.what) from None
    return tuple(occluders)


def _damage(path: Path, why: str) -> SceneError:
    return SceneError(f"it is damaged ({why})", where=str(path), remedy="build the scene again")


DAMAGE = (TypeError, ValueError, ArithmeticError)
"""What a missing key or a wrong value, a wrong type or too large a number raises."""

_MOST = 2**32
_LEAF, _INNER = {"bounds", "object", "part", "transform"}, {"bounds", "children"}
_KEYS = (_LEAF, _LEAF | set(LEVELS)), (_INNER, _INNER | {LEVELS[0]})
"""Of a leaf and of an inner node: those that it needs, and all that it can have."""

Row = Mapping[str, Any]


def rows_of(nodes: Any) -> list[Row]:
    """The nodes, each a leaf's or an inner node's keys and no other."""
    if not isinstance(nodes, list) or not nodes:
        raise ValueError("'nodes' is not a list of nodes")
    for place, row in enumerate(nodes):
        needed, allowed = _KEYS["children" in row]
        if not isinstance(row, dict) or not needed <= row.keys() <= allowed:
            for name in sorted(needed):
                value_of(row, name, f"node {place}")
            raise ValueError(f"node {place} has a key that it cannot have")
    return nodes


def tree_of(rows: Sequence[Row]) -> Tree:
    """Without any cycle, and with every part in one leaf."""
    bounds = _numbers([row["bounds"] for row in rows], (2, 3), "bounds")
    if not (bounds[:, 0] <= bounds[:, 1]).all():
        raise ValueError("a node's lowest corner is above its highest")
    children = _whole_numbers([row.get("children", (0, 0)) for row in rows], (2,), "children")
    parts = _whole_numbers([row.get("part", -1) for row in rows], (), "part")
    _check_children(children, np.array(["children" in row for row in rows]))
    order, spans = _depth_first(children, parts)
    if not np.array_equal(np.sort(order), np.arange(len(order))):
        raise ValueError("the leaves do not hold every part once")
    return Tree(bounds, children.astype(np.int32), spans, order)


def objects_of(names: Any) -> tuple[str, ...]:
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise ValueError("'objects' is not a list of names")
    if len(set(names)) < len(names):
        raise ValueError("two objects have the same name")
    return tuple(names)


def parts_of(rows: Sequence[Row], tree: Tree, objects: int) -> tuple[IntArray, FloatArray]:
    """(p,) object and (p, 4, 4) transform of each part."""
    leaves = [row for row in rows if "part" in row]
    places = [row["part"] for row in leaves]
    owners = _whole_numbers([row["object"] for row in leaves], (), "object")
    if owners.min() < 0 or owners.max() >= objects:
        raise ValueError("a leaf is of an object that is not there")
    object_of = np.empty(len(tree.order), dtype=np.int32)
    object_of[places] = owners
    check_object_order(object_of, objects)
    transforms = np.tile(np.eye(4), (len(tree.order), 1, 1))
    transforms[places, :3] = _numbers([row["transform"] for row in leaves], (3, 4), "transform")
    return object_of, transforms


def keys_of(rows: Sequence[Row], summaries: Mapping[str, Summary]) -> list[str]:
    """Keys of the occluders that nodes have, each once, ascending."""
    keys = [row[name] for row in rows for name in LEVELS if name in row]
    for key in keys:
        if key not in summaries:
            raise ValueError(f"a node has the occluder {key!r}, which is not there")
    return sorted(set(keys))


def occluders_of(rows: Sequence[Row], keys: Sequence[str]) -> IntArray:
    """(k, 2) places in ``keys`` of the nodes' far and near occluders; -1 for none."""
    place = {key: index for index, key in enumerate(keys)}
    found = [[place[row[name]] if name in row else -1 for name in LEVELS] for row in rows]
    return np.array(found, dtype=np.int32)


def summaries_of(rows: Any) -> dict[str, Summary]:
    """By key; keys become names of files, so nothing else may stand for one."""
    if not isinstance(rows, dict):
        raise ValueError("'occluders' is not an object")
    for key in rows:
        if not is_key(key):
            raise ValueError(f"{key!r} is not a key of an occluder")
    if not rows:
        return {}
    columns = [_column(rows, name) for name in _OF_SUMMARY]
    return {key: Summary(*row) for key, *row in zip(rows, *columns, strict=True)}


def _column(rows: Mapping[str, Any], name: str) -> list[Any]:
    """A field of all, at once: one by one takes longer than all that a small change makes."""
    values = [value_of(row, name, f"occluder {key}") for key, row in rows.items()]
    try:
        return _from_0(values, name, name)
    except ValueError:
        for key, value in zip(rows, values, strict=True):
            _from_0([value], name, f"{name} of occluder {key}")
        raise


def _from_0(values: list[Any], name: str, said: str) -> list[Any]:
    found = _OF_SUMMARY[name](values, (), said)
    if found.min() < 0:
        raise ValueError(f"{said!r} is below 0")
    return list(found.tolist())


def options_of(values: Any) -> SceneOptions:
    """Those that this version knows."""
    known = (one.name for one in SceneOptions.fields() if one.of_result)
    return SceneOptions(**{name: value_of(values, name, "the options") for name in known})


def value_of(values: Any, name: str, where: object) -> Any:
    if not isinstance(values, dict) or name not in values:
        raise ValueError(f"{name!r} of {where} is missing")
    return values[name]


def _check_children(children: NDArray[np.int64], inner: NDArray[np.bool_]) -> None:
    """They follow each other in the order of their parents: so each node but the root has one."""
    first, count = children[inner].T
    in_order = np.array_equal(first, 1 + np.cumsum(count) - count)
    if not in_order or 1 + count.sum() != len(children) or (count < 2).any():
        raise ValueError("the children are not in the order of their parents, 2 or more of each")
    if (first <= np.nonzero(inner)[0]).any():
        raise ValueError("a node comes after its children")


def _depth_first(
    children: NDArray[np.int64], parts: NDArray[np.int64]
) -> tuple[IntArray, IntArray]:
    """(order, spans) of a tree: parts in the order of its leaves, and what lies below each node."""
    # Lists, since nodes have few children: a call of numpy takes longer than such a sum.
    sizes, begins = [1] * len(children), [0] * len(children)
    inner = [(node, *row) for node, row in enumerate(children.tolist()) if row[1] > 0]
    for node, first, count in reversed(inner):
        sizes[node] = sum(sizes[first : first + count])
    for node, first, count in inner:
        begin = begins[node]
        for child in range(first, first + count):
            begins[child] = begin
            begin += sizes[child]
    leaves = children[:, 1] == 0
    starts = np.array(begins, dtype=np.int32)
    order = np.empty(np.count_nonzero(leaves), dtype=np.int32)
    order[starts[leaves]] = parts[leaves]
    return order, np.column_stack([starts, starts + np.array(sizes, dtype=np.int32)])


def _numbers(values: ArrayLike, shape: tuple[int, ...], name: str) -> FloatArray:
    """(n, *shape) float64, finite."""
    found = _array(values, shape, "if")
    if found is None or not np.isfinite(found).all():
        raise ValueError(f"{name!r} is not always {math.prod(shape)} finite numbers")
    return found.astype(np.float64)


def _whole_numbers(values: list[Any], shape: tuple[int, ...], name: str) -> NDArray[np.int64]:
    """(n, *shape), -1 to 2**32: those of arrays and checksums."""
    found = _array(values, shape, "i")
    if found is None or ((found < -1) | (found > _MOST)).any():
        raise ValueError(f"{name!r} is not always {math.prod(shape)} whole numbers in range")
    return found


# By the names of a Summary's fields, in their order.
_OF_SUMMARY = {
    "triangles": _whole_numbers,
    "error_bound": _numbers,
    "radius": _numbers,
    "checksum": _whole_numbers,
}


def _array(values: ArrayLike, shape: tuple[int, ...], kinds: str) -> NDArray[Any] | None:
    """(n, *shape) of one of numpy's kinds of numbers; None where the values are none such."""
    try:
        found = np.array(values)
    except ValueError:  # rows of several lengths
        return None
    return found if found.shape[1:] == shape and found.dtype.kind in kinds else None
