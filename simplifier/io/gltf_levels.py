"""Which nodes of a glTF file are levels of detail of another: the extension MSFT_lod."""

from __future__ import annotations

from simplifier.io.gltf_container import JsonObject

EXTENSION = "MSFT_lod"


def level_ids(root: JsonObject) -> dict[int, list[int]]:
    """The coarser nodes of each finest one, finer to coarser; empty without the extension.

    Raises ``UnreadableMeshError`` when a node that is not there is named, or one twice, or one that
    names levels itself, as in a cycle.
    """
    levels = {}
    for index, node in root.items_with("extensions", "nodes"):
        if node.has_extension(EXTENSION):
            extension = node.child("extensions").child(EXTENSION)
            if extension.has("ids"):
                levels[index] = extension.integers("ids")
    for index, ids in levels.items():
        node = root.item("nodes", index)
        for one in ids:
            root.item("nodes", one)
            if one in levels:
                raise node.fail(
                    f"its level of detail nodes[{one}] has levels itself, or they form a cycle",
                    "export it again",
                )
        if len(set(ids)) < len(ids):
            raise node.fail("names a level of detail twice", "export it again")
    return levels
