"""Run everything once on small meshes, so that every kernel is compiled and cached."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import get_args

import numpy as np

from simplifier.accuracy.accuracy import AccuracyOptions, evaluate_accuracy
from simplifier.culling.depth_buffer import Coverage, DepthBuffer
from simplifier.culling.flythrough import fly
from simplifier.culling.item_buffer import ItemBuffer
from simplifier.errors import BackendUnavailableError, MeshError
from simplifier.geometry.camera import Camera, CameraPath
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.scene import Scene
from simplifier.hierarchy.scene_build import build_occluders
from simplifier.hierarchy.scene_file import load_occluder_tree, occluder_store, write_manifest
from simplifier.io.formats import writable_suffixes
from simplifier.io.load import load, load_occluder
from simplifier.io.save import save_occluder
from simplifier.kernels.item_buffer import merge_pictures
from simplifier.kernels.native import library
from simplifier.kernels.thin import crack_triangles
from simplifier.options.scene import CullOptions, PathKind, PathOptions, SceneOptions
from simplifier.options.simplify import Trim
from simplifier.options.stages import Options, SectionOptions, make_options
from simplifier.options.visibility import Fill, Placing, PvsOptions
from simplifier.pipeline import simplify_mesh
from simplifier.report.report import build_report

_MOVES = 16  # a search in a few rounds
_TEETH = 80  # of a face whose work is bounded
_HEADER = """ply
format {} 1.0
element vertex 4
property float x
property float y
property float z
element face 2
property list uchar int vertex_indices
end_header
"""
_POINTS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 1]], dtype="<f4")
_MIXED = ((3, 0, 1, 2), (4, 0, 1, 2, 3))  # faces of unequal size are read row by row


def warm_up() -> None:
    """Fill the cache; a later process of the same user on the same processor compiles nothing."""
    # Here, not above: it takes long to load, and the command line loads this module.
    from simplifier.camera_paths.generate import generate_path

    mesh = _frame()
    little = make_options(1.0, budget=8, resolution=16, moves=_MOVES)
    little = replace(little, sections=SectionOptions(directions=4, depths=2))
    for trim, exact in zip(get_args(Trim), (False, True), strict=True):
        selection = replace(little.selection, trim=trim)
        occluder = _simplify_and_judge(mesh, replace(little, selection=selection), exact=exact)
    simplify_mesh(mesh, replace(little, refine=replace(little.refine, front=0.01)))
    fan = TriangleMesh.from_soup(_POINTS, [[0, 1, 2], [0, 2, 3]])
    crack_triangles(9.0 * fan.vertices, fan.faces, np.arange(4, dtype=np.int32))
    flooded = replace(little, solid=replace(little.solid, fill="flood"))
    simplify_mesh(TriangleMesh.from_soup(_POINTS[:3], [[0, 1, 2]]), flooded)  # nothing inside
    closed = replace(little.solid, smallest_hole=0.1, conservative=True)
    _simplify_and_judge(mesh, replace(little, solid=closed), exact=False)
    with suppress(BackendUnavailableError):
        stencil = SectionOptions(directions=2, depths=1, slicer="gl")
        _simplify_and_judge(mesh, replace(little, sections=stencil), exact=False)
    for kind in get_args(PathKind):
        with suppress(MeshError):  # the frame has no interior, which is found out by its floors
            generate_path(_scene(mesh), PathOptions(kind, frames=2))
    _cull(mesh)
    # With a hole, which what viewers fill is looked through for.
    _find_sets(_scene(TriangleMesh.from_soup(mesh.vertices, mesh.faces[1:])))
    with tempfile.TemporaryDirectory() as folder:
        for conservative in (False, True):
            _fly(mesh, Path(folder) / str(conservative), conservative=conservative)
        for path in _files(Path(folder), occluder):
            load(path)
            load_occluder(path)


def _simplify_and_judge(mesh: TriangleMesh, options: Options, *, exact: bool) -> Occluder:
    """Simplify, judge and report."""
    result = simplify_mesh(mesh, options)
    accuracy = evaluate_accuracy(
        mesh, result.occluder, AccuracyOptions(views=4, image=32, quads=64, exact=exact)
    )
    build_report(mesh, result.occluder, result.solid, accuracy, options={}, timings={})
    return result.occluder


def _cull(mesh: TriangleMesh) -> None:
    """Draw and test under both coverages, and draw the truth."""
    camera = Camera.looking(np.zeros(3), np.ones(3), np.array([0.0, 1.0, 0.0]), 60.0, 0.1)
    for coverage, native in product(get_args(Coverage), (library(), None)):
        buffer = DepthBuffer(16, 16, coverage)
        buffer.native = native
        buffer.draw_mesh(mesh.vertices, mesh.faces, camera)
        buffer.test(mesh.bounds[None], camera)
    items = ItemBuffer(16, 16)
    items.draw(_scene(mesh), camera)
    # What several threads draw of many triangles is put together by this.
    merge_pictures(
        np.zeros((2, 2)), items.items[:2, :2].copy(), np.ones((2, 2)), items.items[:2, :2].copy()
    )


def _fly(mesh: TriangleMesh, folder: Path, *, conservative: bool) -> None:
    """Build a scene, read it again, and cull it from a camera."""
    scene = _scene(mesh)
    options = SceneOptions(budget=8, resolution=16, moves=_MOVES, conservative=conservative)
    build = build_occluders(scene, options, occluder_store(folder), {})
    write_manifest(folder, scene, options, build)
    camera = Camera.looking(
        np.array([1.5, 1.5, -5.0]), np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0]), 60.0, 0.1
    )
    fly(scene, load_occluder_tree(folder), CameraPath("", (camera,)), CullOptions((16, 16)))


def _find_sets(scene: Scene) -> None:
    """What is visible from cells among objects and on a terrain, found and checked."""
    # Here, not above: what they need of scipy and shapely takes long to load.
    from simplifier.camera_paths.columns import UprightScene
    from simplifier.geometry.elevation import Elevation
    from simplifier.visibility.checking.check import CheckOptions, check_pvs
    from simplifier.visibility.cull_maps.cull_map import umbra_heights
    from simplifier.visibility.find import find_pvs
    from simplifier.visibility.placing.cells import place_cells
    from simplifier.visibility.placing.terrain_cells import place_on_terrain
    from simplifier.visibility.solid.terrain import Terrain

    look = CheckOptions(cells=1, views=4, azimuths=4, pictures=1, pixels=16)
    options = PvsOptions(up="y", cell_size=2.0, eye_height=0.5)
    upright = UprightScene.of(scene, "y")
    some = np.arange(1)
    for placing in get_args(Placing):
        if placing == "floors":
            continue  # there is no room
        cells = place_cells(upright, placing, options).some(some)
        for fill in get_args(Fill):
            found = find_pvs(upright, cells, replace(options, fill=fill, slices=True))
            check_pvs(scene, found.pvs, look)
        if found.maps is not None:
            umbra_heights(found.maps, found.pvs.cells, 0)
        find_pvs(upright, cells, replace(options, method="strong", skip_buried=True))
    found = find_pvs(upright, cells, replace(options, method="slice-wise"))
    check_pvs(scene, found.pvs, look)
    hill = Elevation(np.array([[0.0, 0, 1], [0, 2, 0], [0, 0, 0]]), (1.0, 1.0), (0.0, 0.0))
    terrain = Terrain.of(hill, 1)
    upright = UprightScene.of(terrain.scene, "z")
    options = replace(options, up="z", cell_size=1.0)
    cells = place_on_terrain(terrain, upright, "grid", options).some(some)
    find_pvs(upright, cells, replace(options, method="voxel-column"), terrain=terrain)
    found = find_pvs(upright, cells, replace(options, method="cull-map"), terrain=terrain)
    check_pvs(terrain.scene, found.pvs, look, terrain=terrain)


def _files(folder: Path, occluder: Occluder) -> Iterator[Path]:
    """A file of every format, of PLY those kinds that are not written here, and a face of many
    corners."""
    for suffix in writable_suffixes():
        path = folder / f"mesh{suffix}"
        save_occluder(occluder, path)
        yield path
    rows = "\n".join(" ".join(map(str, row)) for row in (*_POINTS.tolist(), *_MIXED))
    text = folder / "text.ply"
    text.write_text(_HEADER.format("ascii") + rows + "\n")
    yield text
    faces = b"".join(bytes([row[0]]) + np.array(row[1:], "<i4").tobytes() for row in _MIXED)
    binary = folder / "binary.ply"
    binary.write_bytes(_HEADER.format("binary_little_endian").encode() + _POINTS.tobytes() + faces)
    yield binary
    many = folder / "many.obj"
    teeth = [f"v {x} {x % 2} 0" for x in range(_TEETH)]
    corners = " ".join(map(str, range(1, _TEETH + 2)))
    many.write_text("\n".join([*teeth, f"v 0 {_TEETH} 0", f"f {corners}", ""]))
    yield many


def _scene(mesh: TriangleMesh) -> Scene:
    return Scene((mesh,), ("frame",), np.zeros(1, dtype=np.int32), np.eye(4)[None])


def _frame() -> TriangleMesh:
    """A square frame of four boxes: its sections have a hole, so bridging is compiled too."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    quads = np.array(
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    )
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    bars = ((3, 1, 0, 0), (3, 1, 0, 2), (1, 3, 0, 0), (1, 3, 2, 0))  # width, height, low corner
    vertices = [corners * (w, h, 1) + (x, y, 0) for w, h, x, y in bars]
    starts = range(0, 8 * len(bars), 8)
    return TriangleMesh.from_soup(
        np.concatenate(vertices), np.concatenate([faces + start for start in starts])
    )
