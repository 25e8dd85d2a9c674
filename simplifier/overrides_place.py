"""Where an asset's overrides are, for those who need not read them."""

from __future__ import annotations

from pathlib import Path

SUFFIX = ".overrides.toml"
"""In place of the mesh's own."""


def overrides_place(mesh: Path) -> Path:
    """The file that belongs to a mesh, whether or not it is there."""
    return mesh.with_suffix(SUFFIX)


def overrides_beside(mesh: Path) -> Path | None:
    """The file that belongs to a mesh; None where there is none."""
    path = overrides_place(mesh)
    return path if path.is_file() else None
