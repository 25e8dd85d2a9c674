"""A file of any mesh format: refused, or read the same way by everything that reads it."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import get_args

import numpy as np

from simplifier.errors import EmptyMeshError, OutputError, UnreadableMeshError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import LodChain, Occluder
from simplifier.geometry.scene import Scene
from simplifier.io.formats import CODECS, writable_suffixes
from simplifier.io.glb_embed import Embedding, embed_occluder
from simplifier.io.load import load, load_lods, load_occluder
from simplifier.io.save import occluder_bytes
from simplifier.io.scene import load_scene
from tests.fuzz.promises import check_sentence, promise
from tests.fuzz.promises.soups import FURTHEST, check_soup

_FLOAT32 = 2.0**-23  # share of a coordinate that rounding may take
_ROUNDED = (".glb", ".occ", ".stl")


def check_mesh_file(path: Path) -> None:
    """Raises ``OccluderError`` for a file that is refused, and for one without a triangle."""
    occluder = load_occluder(path)
    check_occluder(occluder)
    try:
        mesh = load(path, transparent="keep")
    except EmptyMeshError:
        promise(len(occluder.faces) == 0, "a mesh is empty where its occluder is")
        raise
    promise(
        np.array_equal(mesh.vertices, occluder.vertices)
        and np.array_equal(mesh.faces, occluder.faces),
        "a mesh and an occluder of the same file are the same",
    )
    with suppress(EmptyMeshError):
        opaque = load(path)
        promise(_stated(opaque) <= _stated(mesh), "leaving out adds nothing")
    check_round_trips(occluder)
    _check_alone(path, mesh)
    _check_scene(path, mesh)
    if path.suffix in (".glb", ".gltf", ".occ"):
        _check_levels(path)
    _check_addition(path, mesh, occluder)


def check_occluder(occluder: Occluder) -> None:
    """Whatever it was read from or made of."""
    check_soup(occluder.vertices, occluder.faces)
    promise(occluder.error_bound >= 0.0, "an error bound is a length")


def check_round_trips(occluder: Occluder) -> None:
    """Written in every format it comes back: to the last bit, or to the digits of a float32."""
    corners = occluder.vertices[occluder.faces]
    for suffix in writable_suffixes():
        path = Path(f"occluder{suffix}")
        try:
            data = occluder_bytes(occluder, path)
        except OutputError:
            promise(suffix in _ROUNDED, f"{suffix} can hold any coordinate")
            continue
        vertices, faces = CODECS[suffix].decode(data, path)
        found = vertices[faces]
        promise(found.shape == corners.shape, f"no triangle is lost in {suffix}")
        if suffix not in _ROUNDED:
            promise(np.array_equal(found, corners), f"{suffix} keeps every bit")
            again = occluder_bytes(Occluder(vertices, faces.astype(np.int32)), path)
            promise(again == data, f"{suffix} is the same when it is written again")
        elif len(corners):
            low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
            # A GLB's vertices lie around its centre, which has all digits of a float64.
            reach = np.ptp(corners, axis=(0, 1)) if suffix == ".glb" else np.abs([low, high]).max(0)
            near = 4.0 * np.finfo(np.float64).eps * np.abs([low, high]).max()
            off = np.abs(found - corners).max(axis=(0, 1))
            promise((off <= _FLOAT32 * reach.max() + near).all(), f"{suffix} keeps seven digits")


def _stated(mesh: TriangleMesh) -> int:
    """Triangles of the file: what is far too large or too far away for a mesh hangs on the rest."""
    return len(mesh.faces) + mesh.dropped.total


def _check_alone(path: Path, mesh: TriangleMesh) -> None:
    """Other files may be refused; what is read without them is the same."""
    try:
        alone = load(path, allow_external=False, transparent="keep")
    except UnreadableMeshError as error:
        promise("another file" in error.what, "only other files are refused")
        return
    promise(np.array_equal(alone.vertices, mesh.vertices), "a file is the same without others")


def _check_scene(path: Path, mesh: TriangleMesh) -> None:
    try:
        scene = load_scene(path, transparent="keep")
    except EmptyMeshError:
        return
    check_scene(scene)
    if not scene.warnings and not mesh.dropped.total:
        promise(
            scene.triangle_counts.sum() == len(mesh.faces), "the objects of a scene are its mesh"
        )


def check_scene(scene: Scene) -> None:
    """Objects that can be placed."""
    for mesh in scene.meshes:
        check_soup(mesh.vertices, mesh.faces)
    promise(len(scene) > 0, "a scene has an object")
    promise(len(set(scene.names)) == len(scene.names) == len(scene.mesh_of), "names are unique")
    promise("\n".join(scene.names).encode(), "names can be written")
    promise(set(scene.mesh_of.tolist()) == set(range(len(scene.meshes))), "every mesh is used")
    promise(np.isfinite(scene.transforms).all(), "transforms are finite")
    promise((scene.transforms[:, 3] == [0, 0, 0, 1]).all(), "transforms are affine")
    bounds = scene.bounds()
    promise((np.abs(bounds) <= FURTHEST).all(), "objects are within reach")
    promise((bounds[:, 0] <= bounds[:, 1]).all(), "a box has its low end below its high one")
    for warning in scene.warnings:
        check_sentence(warning)


def _check_levels(path: Path) -> None:
    try:
        chain = load_lods(path)
    except UnreadableMeshError:
        return
    check_levels(chain)


def _check_addition(path: Path, mesh: TriangleMesh, occluder: Occluder) -> None:
    """What was read may be damaged where reading passes over it, so no more is promised."""
    for how in get_args(Embedding):
        with suppress(OutputError, UnreadableMeshError):
            embed_occluder(path, mesh, occluder, how)


def check_levels(chain: LodChain) -> None:
    """Finest first, each with its bound."""
    bounds = [level.error_bound for level in chain.levels]
    promise(bounds == sorted(bounds) and bounds, "error bounds rise from level to level")
    promise(chain.lens.rows > 0 and 0.0 < chain.lens.fov < 180.0, "a lens sees something")
    for level in chain.levels:
        check_occluder(level.occluder)
        promise(0.0 <= level.deviation < np.inf, "a deviation is a length")
    promise(chain.at(np.inf) is chain.levels[-1], "far off, the coarsest will do")
