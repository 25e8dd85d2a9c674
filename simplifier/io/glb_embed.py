"""An original and its occluder in one GLB, with all that the original has as it was.

The occluder's node, mesh and data are put behind those of the original, and the node's extras say
what there was before, so that they can be taken away again: an occluder that was embedded earlier
is replaced.
"""

from __future__ import annotations

import base64
import copy
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from simplifier.errors import OutputError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.scene import Scene
from simplifier.io.files import read_bytes, write_whole
from simplifier.io.formats import codec_for_reading
from simplifier.io.glb_writer import GlbMeshes, occluder_extras
from simplifier.io.gltf import BEFORE, GENERATOR
from simplifier.io.gltf_container import GltfDocument, JsonObject, open_document, pack_glb
from simplifier.io.gltf_levels import EXTENSION, level_ids
from simplifier.io.places import followed
from simplifier.io.scene_writer import encode_scene
from simplifier.io.written_faces import single_sided
from simplifier.options.simplify import PLAIN, Embedding, Style

_ARRAYS = ("nodes", "meshes", "materials", "accessors", "bufferViews", "buffers")


def save_with_original(
    original: Path,
    mesh: TriangleMesh,
    occluder: Occluder,
    path: Path,
    how: Embedding,
    style: Style = PLAIN,
) -> None:
    """Write what :func:`with_original` gives, all or nothing."""
    write_whole(path, with_original(original, mesh, occluder, path, how, style))


def with_original(
    original: Path,
    mesh: TriangleMesh,
    occluder: Occluder,
    path: Path,
    how: Embedding,
    style: Style = PLAIN,
) -> bytes:
    """What the file ``path`` is to hold.

    Raises as :func:`embed_occluder` and :func:`check_place`.
    """
    check_place(original, path)
    shown = single_sided(occluder) if style.sides == "single" else occluder
    try:
        return embed_occluder(original, mesh, shown, how)
    except OutputError as error:
        raise OutputError(error.what, where=str(path), remedy=error.remedy) from None


def embed_occluder(original: Path, mesh: TriangleMesh, occluder: Occluder, how: Embedding) -> bytes:
    """A GLB of the file ``original``, or of ``mesh`` where that is no glTF, and the occluder.

    Raises :class:`UnreadableMeshError` for an original that is damaged where reading passes over
    it, and :class:`OutputError` where the occluder does not fit float32.
    """
    document = _document_of(original, mesh)
    level_ids(document.root)  # refuses levels that form a cycle
    with _damage_told(
        document.root, "its JSON is not as glTF has it: nothing can be added", "export it again"
    ):
        root, binary = _without_earlier(document)
        if len(occluder.faces):
            binary = _with_occluder(root, binary, occluder, original.stem, how)
        return pack_glb(root, binary)


def _with_occluder(
    root: dict[str, Any], binary: bytes, occluder: Occluder, stem: str, how: Embedding
) -> bytes:
    """Put it into the root, whose file has that ``stem``; the binary chunk with its data."""
    meshes = GlbMeshes()
    node = meshes.add(occluder, {})
    before: dict[str, Any] = {key: len(root.get(key, [])) for key in _ARRAYS}
    before["bytes"] = len(binary)
    if root.get("buffers"):
        before["byte_length"] = root["buffers"][0]["byteLength"]
    buffer, start, binary = _added_bytes(root, meshes.binary, binary)
    _append(root, meshes.document(), buffer, start)
    node["mesh"] = before["meshes"]
    node["extras"] = occluder_extras(occluder) | {BEFORE: before}
    scene = _scene(root)
    if scene is not None:
        before["scene_nodes"] = list(scene["nodes"])
    if not root.get("nodes"):
        _give_nodes(root, scene, before["meshes"])
    if how == "godot":
        node["name"] = f"{stem}-occonly"
        (scene or _new_scene(root))["nodes"].append(len(root["nodes"]))
    else:
        node["name"] = f"{stem}_lod"
        _add_level(root, scene or _new_scene(root), before, stem)
    root["nodes"].append(node)
    return binary


def external_names(original: Path) -> list[str]:
    """The files beside a glTF file that it refers to, pictures too; none for other formats."""
    if not codec_for_reading(original).external:
        return []
    root = open_document(read_bytes(original), str(original)).root.members
    named = [*root.get("buffers", []), *root.get("images", [])]  # type: ignore[misc]
    uris = [one.get("uri") for one in named if isinstance(one, dict)]
    return [uri for uri in uris if isinstance(uri, str) and not uri.startswith("data:")]


@contextmanager
def _damage_told(root: JsonObject, what: str, remedy: str) -> Iterator[None]:
    """Whatever JSON that is of another shape than it should be makes of the block."""
    try:
        yield
    except (AttributeError, LookupError, RecursionError, TypeError, ValueError):
        raise root.fail(what, remedy) from None


def _document_of(original: Path, mesh: TriangleMesh) -> GltfDocument:
    if codec_for_reading(original).external:
        data = read_bytes(original)
    else:
        place = np.zeros(1, dtype=np.int32), np.eye(4)[None]
        data = encode_scene(Scene((mesh,), (original.stem,), *place))
    return open_document(data, str(original))


def _without_earlier(document: GltfDocument) -> tuple[dict[str, Any], bytes]:
    """A copy of the JSON, and the binary chunk, without an occluder of an earlier run."""
    root: dict[str, Any] = copy.deepcopy(document.root.members)
    binary = document.binary or b""
    nodes = root.get("nodes", [])
    extras = nodes[-1].get("extras", {}) if nodes and isinstance(nodes[-1], dict) else {}
    if not (isinstance(extras, dict) and extras.get("generator") == GENERATOR):
        return root, binary
    before = extras.get(BEFORE)
    if not isinstance(before, dict):
        return root, binary
    with _damage_told(
        document.root,
        "the occluder of an earlier run was changed by another program",
        "use the original, without an occluder",
    ):
        for key in _ARRAYS:
            root[key] = root.get(key, [])[: before[key]]
            if not root[key]:
                del root[key]
        binary = binary[: before["bytes"]]
        if root.get("buffers") and "uri" not in root["buffers"][0]:
            root["buffers"][0]["byteLength"] = before["byte_length"]
        _restore_scene(root, before)
    return root, binary


def _restore_scene(root: dict[str, Any], before: dict[str, Any]) -> None:
    if "scene_nodes" in before:
        root["scenes"][root.get("scene", 0)]["nodes"] = before["scene_nodes"]
    else:
        root.pop("scenes", None)
        root.pop("scene", None)
    if "root" in before:
        index, node = before["root"]
        root["nodes"][index] = node
    if "extensions_used" in before:
        root["extensionsUsed"] = before["extensions_used"]
        if root["extensionsUsed"] is None:
            del root["extensionsUsed"]


def _added_bytes(root: dict[str, Any], added: bytes, binary: bytes) -> tuple[int, int, bytes]:
    """The buffer that the bytes went to, where they begin in it, and the binary chunk."""
    buffers = root.setdefault("buffers", [])
    if not buffers:
        buffers.append({"byteLength": len(added)})
        return 0, 0, added
    if "uri" in buffers[0]:  # the chunk would have to be the first: the bytes go into the JSON
        text = base64.b64encode(added).decode("ascii")
        uri = f"data:application/octet-stream;base64,{text}"
        buffers.append({"byteLength": len(added), "uri": uri})
        return len(buffers) - 1, 0, binary
    padded = binary + b"\0" * (-len(binary) % 4)
    buffers[0]["byteLength"] = len(padded) + len(added)
    return 0, len(padded), padded + added


def _append(root: dict[str, Any], made: dict[str, Any], buffer: int, start: int) -> None:
    """The arrays of an occluder's own document behind those of the root."""
    base = {key: len(root.get(key, [])) for key in _ARRAYS}
    for view in made["bufferViews"]:
        view["buffer"] = buffer
        view["byteOffset"] += start
    for accessor in made["accessors"]:
        accessor["bufferView"] += base["bufferViews"]
    for mesh in made["meshes"]:
        mesh.pop("extras", None)
        for primitive in mesh["primitives"]:
            primitive["material"] += base["materials"]
            primitive["indices"] += base["accessors"]
            for name in primitive["attributes"]:
                primitive["attributes"][name] += base["accessors"]
    for key in ("meshes", "materials", "accessors", "bufferViews"):
        root.setdefault(key, []).extend(copy.deepcopy(made[key]))


def _scene(root: dict[str, Any]) -> dict[str, Any] | None:
    scenes = root.get("scenes", [])
    if not scenes:
        return None
    scene: dict[str, Any] = scenes[root.get("scene", 0)]
    scene.setdefault("nodes", [])
    return scene


def _give_nodes(root: dict[str, Any], scene: dict[str, Any] | None, meshes: int) -> None:
    """To a file of meshes alone: beside the occluder's node, nobody would look at them."""
    root["nodes"] = [{"mesh": mesh} for mesh in range(meshes)]
    if scene is not None:
        scene["nodes"] = list(range(meshes))


def _new_scene(root: dict[str, Any]) -> dict[str, Any]:
    """Of a file without one: all nodes that no other has as a child."""
    nodes = root.get("nodes", [])
    children = {child for node in nodes for child in node.get("children", [])}
    scene = {"nodes": [index for index in range(len(nodes)) if index not in children]}
    root["scenes"], root["scene"] = [scene], 0
    return scene


def _add_level(
    root: dict[str, Any], scene: dict[str, Any], before: dict[str, Any], name: str
) -> None:
    """Make the node that comes next the coarsest level of the scene's only root."""
    nodes = root.setdefault("nodes", [])
    if len(scene["nodes"]) == 1:
        index = scene["nodes"][0]
        if index < before["nodes"]:
            before["root"] = [index, copy.deepcopy(nodes[index])]
    else:
        index = len(nodes)
        nodes.append({"name": name, "children": list(scene["nodes"])})
        scene["nodes"] = [index]
    top = nodes[index]
    levels = top.setdefault("extensions", {}).setdefault(EXTENSION, {}).setdefault("ids", [])
    levels.append(len(nodes))
    extras = top.get("extras")
    coverage = extras.get("MSFT_screencoverage") if isinstance(extras, dict) else None
    if isinstance(coverage, list):
        coverage.append(0.0)
    used = root.get("extensionsUsed")
    before["extensions_used"] = copy.deepcopy(used)
    if EXTENSION not in (used or []):
        root["extensionsUsed"] = [*(used or []), EXTENSION]


def check_place(original: Path, output: Path) -> None:
    """Raise :class:`OutputError` where the output could not hold all that the original has."""
    if output.suffix.lower() != ".glb":
        raise OutputError(
            "only .glb files hold the original too", where=str(output), remedy="name a .glb file"
        )
    names = external_names(original)
    if names and followed(output).parent != followed(original).parent:
        raise OutputError(
            f"the original refers to '{names[0][:60]}' beside it, which would be missing there",
            where=str(output),
            remedy="write beside the original, or export it as a single .glb",
        )
