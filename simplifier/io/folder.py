"""The objects of all mesh files of a folder."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from simplifier.errors import MemoryLimitError, OccluderError, UnreadableMeshError
from simplifier.io.formats import CODECS
from simplifier.io.gltf_scene import MOST_INSTANCES
from simplifier.io.load import load_objects
from simplifier.io.objects import Objects
from simplifier.options import Transparent
from simplifier.overrides_place import overrides_beside


def objects_of_folder(
    folder: Path, *, allow_external: bool, transparent: Transparent, memory_limit: float | None
) -> tuple[Objects, list[str]]:
    """The objects, by relative path and then as in the file, and what could not be read.

    A file's object is named by its relative path without the suffix, and the objects of a glTF file
    "path/name".  Raises :class:`UnreadableMeshError` for more than ``MOST_INSTANCES`` objects
    and :class:`MemoryLimitError`.
    """
    files, warnings = _mesh_files(folder)
    found: list[Objects] = []
    count = 0
    for path in files:
        name = path.relative_to(folder).with_suffix("").as_posix()
        try:
            objects = load_objects(
                path,
                allow_external=allow_external,
                transparent=transparent,
                memory_limit=memory_limit,
            )
        except MemoryLimitError:
            raise  # leaving it out would make another scene
        except OccluderError as error:
            warnings.append(f"{error} (the file was left out)")
            continue
        many = CODECS[path.suffix.lower()].objects is not None
        names = [f"{name}/{own}" for own in objects.names] if many else [name]
        found.append(replace(objects, names=names))
        count += len(names)
        if count > MOST_INSTANCES:
            raise UnreadableMeshError(
                f"its files have more than {MOST_INSTANCES} objects",
                where=str(folder),
                remedy="split the scene",
            )
    return Objects.joined(found), [*warnings, *unused_overrides(files)]


def unused_overrides(meshes: Sequence[Path]) -> list[str]:
    """A warning where meshes have overrides: a scene would have to carry them into every node."""
    found = [beside for beside in dict.fromkeys(map(overrides_beside, meshes)) if beside]
    if not found:
        return []
    others = f" and {len(found) - 1} more" if len(found) > 1 else ""
    return [f"{found[0]}{others}: overrides are for single meshes; a scene takes none"]


def _mesh_files(folder: Path) -> tuple[list[Path], list[str]]:
    """Files with a suffix that can be read, by path, and the folders that cannot be entered."""
    files: list[Path] = []
    warnings: list[str] = []

    def closed(error: OSError) -> None:
        warnings.append(
            f"{error.filename}: the folder cannot be read ({error.strerror}); check its permissions"
        )

    for place, folders, names in os.walk(folder, onerror=closed):
        folders[:] = [name for name in folders if not name.startswith(".")]
        files += [
            Path(place, name)
            for name in names
            if not name.startswith(".") and Path(name).suffix.lower() in CODECS
        ]
    return sorted(files, key=lambda path: path.relative_to(folder).parts), warnings
