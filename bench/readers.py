"""Other programs' readers on the files written here: ``python -m bench.readers``.

A castle's occluder goes out in each format, as quads too, and every reader that is installed tells
what it reads: all of the triangles, in their places and with their windings, or what is different.
``readers_castle.csv`` holds the answers, ``readers.md`` shows them.  The readers, in an environment
that has this library::

    pip install trimesh meshio open3d assimp-py
    npm install --prefix DIR three && export NODE_PATH=DIR/node_modules
    make test-blender  # for its environment
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

import simplifier
from bench.record import Row, write_page, write_table
from examples.castle import castle
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.occluder import Occluder
from simplifier.io.formats import suffixes_with_quads
from simplifier.io.written_faces import quads_and_triangles

RESULTS = Path("bench/results")
_BLENDER = Path(".venv-blender/bin/python")
_CLOSE = 1e-6  # of the longest edge: what float32 may move a corner by


Read = Callable[[Path], tuple[str, FloatArray]]
"""The version, and (m, 3, 3) corners in world space."""


def _trimesh(path: Path) -> tuple[str, FloatArray]:
    read = import_module("trimesh").load(path, force="mesh", process=False)
    return version("trimesh"), np.asarray(read.triangles)


def _meshio(path: Path) -> tuple[str, FloatArray]:
    read = import_module("meshio").read(path)
    corners = [
        read.points[_fan(block.data)]
        for block in read.cells
        if block.type in ("triangle", "quad", "polygon")
    ]
    return version("meshio"), np.concatenate(corners)


def _open3d(path: Path) -> tuple[str, FloatArray]:
    read = import_module("open3d").io.read_triangle_mesh(str(path))
    return version("open3d"), np.asarray(read.vertices)[np.asarray(read.triangles)]


def _assimp(path: Path) -> tuple[str, FloatArray]:
    library = import_module("assimp_py")
    scene = library.import_file(str(path), library.Process_Triangulate)
    corners: list[FloatArray] = []

    def add(node: Any, above: FloatArray) -> None:
        place = above @ np.array(node.transformation, dtype=float).reshape(4, 4)
        for index in node.mesh_indices:
            mesh = scene.meshes[index]
            points = np.asarray(mesh.vertices, dtype=float).reshape(-1, 3)
            faces = np.asarray(mesh.indices).reshape(-1, 3)
            corners.append((points @ place[:3, :3].T + place[:3, 3])[faces])
        for child in node.children:
            add(child, place)

    add(scene.root_node, np.eye(4))
    return version("assimp-py"), np.concatenate(corners)


def _outside(*command: str | Path) -> Read:
    """Of a program that prints the version and the corners as JSON, in the last line."""

    def read(path: Path) -> tuple[str, FloatArray]:
        done = subprocess.run(
            [*command, path], capture_output=True, text=True, check=True, timeout=120
        )
        told = json.loads(next(line for line in done.stdout.splitlines() if line.startswith("{")))
        return told["version"], np.array(told["corners"]).reshape(-1, 3, 3)

    return read


_HERE = Path(__file__).parent
READERS: dict[str, tuple[Read, str]] = {
    "three.js": (_outside("node", _HERE / "reader_three.mjs"), ".glb .obj .ply .stl"),
    "Blender": (_outside(_BLENDER, _HERE / "reader_blender.py"), ".glb .obj .ply .stl"),
    "Assimp": (_assimp, ".glb .obj .ply .stl .off"),
    "Open3D": (_open3d, ".glb .obj .ply .stl .off"),
    "meshio": (_meshio, ".obj .ply .stl .off"),
    "trimesh": (_trimesh, ".glb .obj .ply .stl .off"),
}
"""What reads, and the suffixes that it has readers for."""


def _fan(polygons: NDArray[np.int64]) -> NDArray[np.int64]:
    """(k, n) polygons as (k (n - 2), 3) triangles."""
    polygons = np.asarray(polygons)
    last = polygons.shape[1] - 1
    parts = [polygons[:, [0, corner, corner + 1]] for corner in range(1, last)]
    return np.concatenate(parts)


def answers(occluder: Occluder, folder: Path) -> Iterator[Row]:
    """A row a reader that is there, with what it says of each file."""
    quads, _ = quads_and_triangles(occluder)
    for name, (read, suffixes) in READERS.items():
        row: dict[str, object] = {"reader": name, "version": ""}
        for path, split in _written(occluder, folder):
            kind = path.suffix + (" quads" if split else "")
            try:
                if path.suffix in suffixes.split():
                    row["version"], corners = read(path)
                    row[kind] = difference(occluder, quads if split else quads[:0], corners)
                else:
                    row[kind] = "-"
            except (ImportError, FileNotFoundError) as error:
                print(f"{name} is left out: {error}", file=sys.stderr)
                break
            except (Exception, SystemExit) as error:  # readers end as they like
                row[kind] = f"fails: {error}"[:60]
        else:
            yield row


def _written(occluder: Occluder, folder: Path) -> Iterator[tuple[Path, bool]]:
    """The files, and whether with quads."""
    for suffix in (".glb", ".obj", ".ply", ".stl", ".off"):
        for split in (False, True) if suffix in suffixes_with_quads() else (False,):
            path = folder / f"castle{'_quads' if split else ''}{suffix}"
            simplifier.save(occluder, path, quads=split)
            yield path, split


def difference(occluder: Occluder, quads: IntArray, corners: FloatArray) -> str:
    """Whether triangles (m, 3, 3) are those of an occluder: "same", or what is not.

    A quad, by its four vertices, may be split along either diagonal.
    """
    if len(corners) != len(occluder.faces):
        return f"{len(corners)} of {len(occluder.faces)} triangles"
    used = np.unique(occluder.faces)
    points = occluder.vertices[used]
    apart, nearest = KDTree(points).query(corners.reshape(-1, 3))
    if apart.max() > _CLOSE * float(np.ptp(points, axis=0).max()):
        return "moved"
    found = {_turned(face) for face in used[nearest].reshape(-1, 3).tolist()}
    expected = {_turned(face) for face in occluder.faces.tolist()}
    for a, b, c, d in quads.tolist():
        other = {_turned([b, c, d]), _turned([d, a, b])}
        if other <= found:
            expected = (expected - {_turned([a, b, c]), _turned([a, c, d])}) | other
    if found == expected:
        return "same"
    turned_over = {frozenset(face) for face in found} == {frozenset(face) for face in expected}
    return "other windings" if turned_over else "other triangles"


def _turned(face: list[int]) -> tuple[int, ...]:
    """The same cycle of corners from its least on."""
    first = face.index(min(face))
    return tuple(face[first:] + face[:first])


def main() -> None:
    """Write the table and show it."""
    argparse.ArgumentParser(prog="python -m bench.readers", description=__doc__).parse_args()
    occluder = simplifier.simplify(castle(), budget=64, ground=True).occluder
    with tempfile.TemporaryDirectory() as folder:
        rows = list(answers(occluder, Path(folder)))
    write_table(RESULTS / "readers_castle.csv", rows, "python -m bench.readers")
    print(write_page(RESULTS, "readers", ["castle"]).read_text())


if __name__ == "__main__":
    main()
