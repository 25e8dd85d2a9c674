"""What is fuzzed: a name, how its inputs are changed, what has to hold, and how long it may take.

A case is some bytes.  For readers they are the file; where meshes and options go in they are the
JSON of ``cases.py``, so that both are kept, replayed and made smaller alike.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from random import Random

from simplifier.errors import OccluderError
from tests.fuzz.cases import read_case
from tests.fuzz.mutation.archives import reword_parts
from tests.fuzz.mutation.documents import edit, edit_glb
from tests.fuzz.mutation.flips import flip
from tests.fuzz.mutation.sealed import flip_sealed
from tests.fuzz.mutation.words import reword
from tests.fuzz.promises import check_refusal
from tests.fuzz.promises.builds import (
    check_build_manifest,
    check_build_record,
    check_shard_record,
)
from tests.fuzz.promises.built_scenes import check_built_scene
from tests.fuzz.promises.camera_paths import check_camera_path
from tests.fuzz.promises.materials import check_material_file
from tests.fuzz.promises.mesh_files import check_mesh_file
from tests.fuzz.promises.originals import check_original
from tests.fuzz.promises.overrides import NAMED, check_overrides
from tests.fuzz.promises.packed_scenes import check_packed
from tests.fuzz.promises.products import check_evaluate, check_simplify
from tests.fuzz.promises.scene_folders import check_manifest, check_stored

Mutator = Callable[[Random, bytes, bytes], bytes]
Check = Callable[[bytes, Path], None]

_CHANGES = (1, 1, 1, 1, 2, 2, 3, 5)  # of a file, one after the other


@dataclass(frozen=True)
class Target:
    """One thing that takes input.

    ``check``     (data, an empty folder to use): raises ``OccluderError`` for a refusal, anything
                  else for a fault of the library.
    ``mutators``  one is chosen for each change; none where cases are drawn from strategies.
    ``seconds``   after which a case counts as hanging: a hundred times what the slowest takes.
    """

    name: str
    check: Check
    mutators: tuple[Mutator, ...] = ()
    seconds: float = 10.0

    def mutated(self, random: Random, data: bytes, other: bytes) -> bytes:
        """One to five changes; ``other`` is another input of the same target."""
        for _ in range(random.choice(_CHANGES)):
            data = random.choice(self.mutators)(random, data, other)
        return data

    def verdict(self, data: bytes, folder: Path) -> str:
        """``taken``, or the kind of refusal.  A warning of numpy's counts as a fault, too."""
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                self.check(data, folder)
            except OccluderError as error:
                check_refusal(error)
                return type(error).__name__
        return "taken"


def _mesh_file(suffix: str) -> Check:
    def check(data: bytes, folder: Path) -> None:
        path = folder / f"mesh{suffix}"
        path.write_bytes(data)
        check_mesh_file(path)

    return check


def _glass(data: bytes, folder: Path) -> None:
    mesh = folder / "named.obj"
    mesh.write_bytes(b"mtllib glass.mtl\n" + NAMED)
    (folder / "glass.mtl").write_bytes(data)
    check_material_file(mesh)


def _camera_path(data: bytes, folder: Path) -> None:
    path = folder / "path.json"
    path.write_bytes(data)
    check_camera_path(path)


def _simplify(data: bytes, folder: Path) -> None:
    check_simplify(read_case(data), folder)


def _evaluate(data: bytes, folder: Path) -> None:
    check_evaluate(read_case(data))


def _scene(data: bytes, folder: Path) -> None:
    check_built_scene(read_case(data), folder)


_TEXT = (flip, reword, reword)

READERS = (
    Target("3mf", _mesh_file(".3mf"), (flip, reword_parts, reword_parts)),
    Target("dae", _mesh_file(".dae"), _TEXT),
    Target("glb", _mesh_file(".glb"), (flip, edit_glb, edit_glb)),
    Target("gltf", _mesh_file(".gltf"), (flip, reword, edit, edit)),
    Target("obj", _mesh_file(".obj"), _TEXT),
    Target("occ", _mesh_file(".occ"), (flip,)),
    Target("off", _mesh_file(".off"), _TEXT),
    Target("ply", _mesh_file(".ply"), _TEXT),
    Target("stl", _mesh_file(".stl"), _TEXT),
    Target("tres", _mesh_file(".tres"), _TEXT),
    Target("mtl", _glass, _TEXT),
    Target("original", check_original, (flip, edit_glb, edit_glb)),
    Target("overrides", check_overrides, _TEXT, seconds=60.0),
    Target("build_manifest", check_build_manifest, _TEXT),
    Target("build_record", check_build_record, (flip, edit, edit)),
    Target("camera_path", _camera_path, (flip, reword, edit, edit)),
    Target("manifest", check_manifest, (flip, edit, edit)),
    Target("occs", check_packed, (flip, flip_sealed, flip_sealed, flip_sealed)),
    Target("shard_record", check_shard_record, (flip, edit, edit)),
    Target("stored", check_stored, (flip, edit_glb)),
)
"""Inputs are changed files."""

DRAWN = (
    Target("simplify", _simplify, seconds=120.0),
    Target("evaluate", _evaluate, seconds=120.0),
    Target("scene", _scene, seconds=240.0),
)
"""Inputs are drawn from strategies."""

TARGETS = {target.name: target for target in (*READERS, *DRAWN)}


def target_named(name: str) -> Target:
    """Of the table."""
    return TARGETS[name]
