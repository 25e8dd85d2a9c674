"""Scenes with glass, as the bytes of a glTF file."""

from __future__ import annotations

import numpy as np

from tests.io.builders import GltfBuilder


def glazed(nodes):
    """A GLB of nodes by name: the mesh of stone and that of glass, either of which may be None."""
    builder = GltfBuilder()
    builder.root["materials"] = [{"name": "stone"}, {"name": "glass", "alphaMode": "BLEND"}]
    for name, layers in nodes.items():
        primitives = [
            {
                "attributes": {"POSITION": builder.accessor(mesh.vertices, "VEC3", "f4")},
                "indices": builder.accessor(np.ravel(mesh.faces), "SCALAR", "u2"),
                "material": material,
            }
            for material, mesh in enumerate(layers)
            if mesh is not None
        ]
        builder.node(name=name, mesh=builder.primitives(*primitives))
    return builder.glb()
