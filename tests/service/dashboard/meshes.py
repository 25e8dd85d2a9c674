"""Files to be chosen in a browser."""

from __future__ import annotations

from pathlib import Path

from examples.castle import castle
from simplifier import Occluder, save


def castle_file(folder: Path, name: str = "castle.obj") -> Path:
    """A castle of some thousand triangles; ``name`` may be whatever a file may be called."""
    mesh = castle()
    made = folder / "made.obj"
    save(Occluder(mesh.vertices, mesh.faces), made)
    return made.rename(folder / name)


def broken_file(folder: Path) -> Path:
    """A GLB that ends after its head."""
    path = folder / "broken.glb"
    path.write_bytes(b"glTF\2\0\0\0\xff\xff\0\0JSON")
    return path
