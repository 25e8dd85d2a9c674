"""The triangles that Blender reads of a file, as JSON: ``python reader_blender.py FILE``.

For a Python that has bpy and nothing of the library.  Blender's +z up is turned back to +y.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import bpy


def main(path: Path) -> None:
    """Print version and corners, three a triangle."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if path.suffix == ".glb":
        bpy.ops.import_scene.gltf(filepath=str(path))
    else:
        read = getattr(bpy.ops.wm, f"{path.suffix[1:]}_import")
        read(filepath=str(path), forward_axis="NEGATIVE_Z", up_axis="Y")
    corners = []
    for shown in bpy.context.scene.objects:
        if shown.type != "MESH":
            continue
        shown.data.calc_loop_triangles()
        for triangle in shown.data.loop_triangles:
            for vertex in triangle.vertices:
                x, y, z = shown.matrix_world @ shown.data.vertices[vertex].co
                corners.append([x, z, -y])
    print(json.dumps({"version": bpy.app.version_string, "corners": corners}))


main(Path(sys.argv[1]))
