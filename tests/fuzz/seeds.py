"""Write the corpus anew: ``python -m tests.fuzz.seeds``, after a change of a format.

Small files by our own writers and by hand, one for each way that a format can say something; the
scene that damaged manifests stand in for; and a case of each kind that is drawn.  What fuzzing
found is in ``fixtures/`` and is not touched.
"""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from simplifier import simplify_scene
from simplifier.builds.finding import AssetFigures
from simplifier.builds.record import Entry, write_record
from simplifier.builds.shard_record import Making, ShardRecord, write_shard_record
from simplifier.builds.shards import Shard
from simplifier.geometry.camera import Camera, CameraPath
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Level, LodChain, Occluder
from simplifier.geometry.scene import Scene
from simplifier.io.camera_path import save_camera_path
from simplifier.io.formats import writable_suffixes
from simplifier.io.glb_embed import embed_occluder
from simplifier.io.load import load
from simplifier.io.occs_file import encode_occs
from simplifier.io.save import occluder_bytes, save_lods
from simplifier.io.scene_writer import write_scene
from tests.fuzz.cases import soup_of, write_case
from tests.fuzz.corpus import CORPUS
from tests.fuzz.promises.scene_folders import BUILT
from tests.hierarchy.scenes import QUICK, fine_box, moved, street, turned
from tests.io.builders import (
    FACE_LIST,
    FAN,
    MODEL_3MF,
    TETRAHEDRON_FACES,
    TETRAHEDRON_POINTS,
    XYZ,
    GltfBuilder,
    collada,
    geometry_dae,
    mesh_3mf,
    package_3mf,
    ply,
    tetrahedron,
    valid_files,
)
from tests.io.damaged_occs import town
from tests.solids import box, table

_SHARD = Shard(1, 2)
_OVERRIDES = b"""
[[box]]
name = "core"
center = [1, 0.5, 0.25]
size = [0.5, 0.5, 0.25]
angle = 30
axis = "z"

[[quad]]
corners = [[0.1, 0, 0.5], [1.9, 0, 0.5], [1.9, 1, 0.5], [0.1, 1, 0.5]]

[[open]]
center = [0.2, 0.8, 0.9]
size = [0.2, 0.2, 0.1]
rotation = [0, 0.6, 0, 0.8]

[ignore]
meshes = ["flag"]
transparent = "keep"
"""
_MANIFEST = b"""
[defaults]
budget = 32
require = { min_recall = 0.5, max_triangles = 40, max_overhang = 0.1, verdict = "weak" }

[[asset]]
files = ["*.obj", "props/**/*.[pg]l?"]
exclude = "props/wip/*"
output = ["made/{folder}/{name}_{suffix}.tres", { file = "{name}.ply", as_quads = true }]

[[asset]]
files = "trees/**"
lods = 2
[asset.require]
min_recall = 0.1
"""
_QUICK = {"budget": 12, "preset": "draft", "resolution": 8, "moves": 20}
_JUDGED = {"views": 4, "image": 16, "quads": 50}


def main() -> None:
    """Replace all that this writes."""
    shutil.rmtree(CORPUS, ignore_errors=True)
    shutil.rmtree(BUILT, ignore_errors=True)
    _build_scene()
    for target, name, data in _inputs():
        place = CORPUS / target
        place.mkdir(parents=True, exist_ok=True)
        (place / name).write_bytes(data)


def _build_scene() -> None:
    scene = street(6)
    bar = fine_box((30.0, 1.0, 1.0), cuts=4)  # so long that it is cut into parts
    scene = Scene(
        (*scene.meshes, bar), (*scene.names, "bar"), np.append(scene.mesh_of, 2).astype(np.int32),
        np.concatenate([scene.transforms, [moved(0.0, 0.0, 9.0, -0.5 * turned("y", 9.0))]]),
    )  # fmt: skip
    simplify_scene(
        scene, BUILT, budget=QUICK.budget, resolution=QUICK.resolution, width=QUICK.width,
        moves=QUICK.moves, pixel_error=QUICK.pixel_error,
    )  # fmt: skip


def _inputs() -> Iterator[tuple[str, str, bytes]]:
    """Target, name and content."""
    for name, (suffix, data) in valid_files().items():
        yield suffix[1:], f"by hand {name}".replace(" ", "_"), data
    occluder = Occluder(table().vertices, table().faces, 0.125)
    for suffix in writable_suffixes():
        yield suffix[1:], "written", occluder_bytes(occluder, Path(f"x{suffix}"))
        yield suffix[1:], "written_empty", occluder_bytes(_empty(), Path(f"x{suffix}"))
    yield from _gltf()
    yield from _text()
    yield from _xml()
    yield from _made_files()
    yield from _decided_files()
    yield "manifest", "built", (BUILT / "scene.json").read_bytes()
    yield "occs", "built", (BUILT / "scene.occs").read_bytes()
    yield "occs", "by_hand", encode_occs(town())
    for path in sorted((BUILT / "occluders").iterdir())[:3]:
        yield "stored", path.stem[:8], path.read_bytes()
    yield from _cases()


def _empty() -> Occluder:
    return Occluder(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32), 0.5)


def _gltf() -> Iterator[tuple[str, str, bytes]]:
    rich = GltfBuilder()
    mesh = rich.mesh(TETRAHEDRON_POINTS, TETRAHEDRON_FACES)
    strip = rich.mesh(FAN, [0, 1, 2, 3, 4], mode=5)
    fan = rich.mesh(FAN, mode=6)
    lines = rich.mesh(FAN, [0, 1, 2, 3], mode=1)
    sparse = rich.raw_accessor(
        componentType=5126, type="VEC3", count=4,
        sparse={
            "count": 2,
            "indices": {"bufferView": rich.view(bytes([1, 2])), "componentType": 5121},
            "values": {"bufferView": rich.view(np.eye(2, 3, dtype="<f4").tobytes())},
        },
    )  # fmt: skip
    loose = rich.primitives({"attributes": {"POSITION": sparse}})
    short = rich.accessor(np.array(FAN) * 127, "VEC3", "i1", normalized=True)
    whole = rich.primitives({"attributes": {"POSITION": short}, "mode": 4})
    places = rich.accessor([[0, 0, 0], [3, 0, 0]], "VEC3", "f4")
    turns = rich.accessor([[0, 0, 0, 127], [0, 127, 0, 0]], "VEC4", "i1", normalized=True)
    sizes = rich.accessor([[1, 1, 1], [2, -1, 1]], "VEC3", "f4")
    rich.node(mesh=mesh, name="one", translation=[1, 2, 3], rotation=[0, 0, 0, 1], scale=[1, 2, 1])
    rich.node(mesh=strip, matrix=[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1])
    rich.node(name="parent", children=[3, 4], scale=[1e3, 1e3, 1e3])
    rich.node(mesh=fan, name="one")
    rich.node(mesh=lines, children=[5])
    rich.node(mesh=loose)
    rich.node(mesh=whole)
    rich.node(
        mesh=mesh,
        extensions={
            "EXT_mesh_gpu_instancing": {
                "attributes": {"TRANSLATION": places, "ROTATION": turns, "SCALE": sizes}
            }
        },
    )
    rich.root["scenes"] = [{"nodes": [0, 1, 2, 6, 7]}]
    rich.root["scene"] = 0
    yield "glb", "rich", rich.glb()
    rich.root["nodes"][0]["extras"] = {"generator": "planar-occluder", "error_bound": 0.5}
    yield "gltf", "rich_without_its_file", rich.json(uri="beside.bin")


def _text() -> Iterator[tuple[str, str, bytes]]:
    yield (
        "obj",
        "polygons",
        (
            b"# weights, colours, textures\nmtllib a.mtl\nv 0 0 0 1 1 0 0\nv 2 0 0\nv 2 2 0\n"
            b"v 1 .5 0\n"
            b"v 0 2 0\nvt 0 0\nvn 0 0 1\ng one\nf 1/1/1 2//1 3/1 \\\n 4 5\nf -5 -4 -3\nl 1 2\n"
        ),
    )
    yield (
        "off",
        "colours",
        (
            b"# polygons\nCOFF\n5 2 0\n0 0 0 255 0 0\n2 0 0 1 1 1\n2 2 0 0 0 0\n1 .5 0 9 9 9\n"
            b"0 2 0 1 1 1\n5 0 1 2 3 4  0.5 0.5 0.5\n3 0 1 2\n"
        ),
    )
    strips = f"element vertex 5\n{XYZ}property uchar red\nelement tristrips 1\n{FACE_LIST}"
    rows = b"".join(b"%d %d 0 7\n" % (place % 2, place // 2) for place in range(5))
    yield "ply", "strips", ply(strips, rows + b"7 0 1 2 3 -1 1 2\n")
    mixed = f"element extra 1\nproperty double x\nelement vertex 5\n{XYZ}element face 2\n"
    mixed += "property uchar flags\nproperty list ushort uint vertex_index\n"
    body = np.float64(7.0).tobytes() + np.array(FAN, dtype="<f4").tobytes()
    for corners in ([0, 1, 2], [0, 1, 2, 3, 4]):
        body += b"\1" + len(corners).to_bytes(2, "little") + np.array(corners, "<u4").tobytes()
    yield "ply", "mixed", ply(mixed, body, "binary_little_endian")
    yield (
        "stl",
        "upper_case",
        (
            b"SOLID x\nFACET NORMAL 0 0 1\nOUTER LOOP\nVERTEX 0 0 0\nVERTEX 1 0 0\nVERTEX 0 1e0 0\n"
            b"ENDLOOP\nENDFACET\nEND SOLID x\n"
        ),
    )
    yield (
        "tres",
        "split",
        (
            b'[gd_resource type="ArrayOccluder3D" format=3]\r\n'
            b'[resource]\r\nresource_name = "a"\r\n'
            b"vertices = PackedVector3Array(0, 0, 0, 1, 0, 0,\r\n 0, 1, inf_neg)\r\n"
            b"indices = PackedInt32Array(0, 1, 2)\r\n"
        ),
    )


def _xml() -> Iterator[tuple[str, str, bytes]]:
    mesh = mesh_3mf(TETRAHEDRON_POINTS, TETRAHEDRON_FACES)
    painted = mesh.replace('v3="1"/>', 'v3="1" pid="2" p1="1"/>', 1)
    resources = (
        '<basematerials id="2"><base name="wood" displaycolor="#804020"/>'
        '<base name="glass" displaycolor="#80A0FF40"/></basematerials>\n'
        f'<object id="3" name="leg" pid="2" pindex="0">{painted}</object>\n'
        '<object id="4" name="pair"><components><component objectid="3"/>'
        '<component objectid="3" transform="1 0 0 0 1 0 0 0 1 5 0 0"/>'
        '<component objectid="1" p:path="/3D/other.model"/></components></object>\n'
    )
    build = '<item objectid="4"/><item objectid="3" transform="-2 0 0 0 1 0 0 0 1 0 9 0"/>\n'
    other = MODEL_3MF.format(resources=f'<object id="1">{mesh}</object>', build="")
    yield "3mf", "components", package_3mf(resources, build, other=other)
    inputs = (
        '<input semantic="VERTEX" source="#fan-vertices" offset="0"/>'
        '<input semantic="NORMAL" source="#fan-positions" offset="1"/>'
    )
    polygons = (
        f'<polylist count="2" material="glass">{inputs}<vcount>5 3</vcount>'
        "<p>0 0 1 0 2 0 3 0 4 0 0 0 1 0 2 0</p></polylist>"
        f"<polygons>{inputs}<p>0 0 1 0 2 0 3 0</p></polygons>"
        f"<tristrips>{inputs}<p>0 0 1 0 2 0 3 0</p></tristrips>"
        f"<trifans>{inputs}<p>0 0 1 0 2 0 3 0</p></trifans><lines>{inputs}<p>0 0 1 0</p></lines>"
    )
    nodes = (
        '<node id="a" name="top"><translate>1 2 3</translate><rotate>0 0 1 90</rotate>'
        "<scale>1 -1 2</scale><node><matrix>1 0 0 0 0 1 0 0 0 0 1 5 0 0 0 1</matrix>"
        '<instance_geometry url="#fan"><bind_material><technique_common>'
        '<instance_material symbol="glass" target="#pane"/></technique_common></bind_material>'
        "</instance_geometry></node></node><node><lookat>0 0 9 0 0 0 0 1 0</lookat>"
        '<instance_node url="#kept"/><instance_controller url="#skin"/></node>\n'
    )
    libraries = (
        '<library_nodes><node id="kept"><instance_geometry url="#fan"/></node></library_nodes>\n'
        '<library_controllers><controller id="skin"><skin source="#fan"><bind_shape_matrix>'
        "1 0 0 4 0 1 0 0 0 0 1 0 0 0 0 1</bind_shape_matrix></skin></controller>"
        '</library_controllers>\n<library_materials><material id="pane" name="pane">'
        '<instance_effect url="#clear"/></material></library_materials>\n<library_effects>'
        '<effect id="clear"><profile_COMMON><technique><phong><transparent opaque="A_ONE">'
        "<color>1 1 1 0.5</color></transparent><transparency><float>1</float></transparency>"
        "</phong></technique></profile_COMMON></effect></library_effects>\n"
    )
    yield "dae", "everything", collada(geometry_dae("fan", FAN, polygons), nodes, libraries)


def _made_files() -> Iterator[tuple[str, str, bytes]]:
    """By writers that need a folder."""
    with tempfile.TemporaryDirectory() as folder:
        fine, coarse = tetrahedron(0.1), tetrahedron(0.2)
        for suffix in (".occ", ".glb"):
            path = Path(folder, f"made{suffix}")
            save_lods(LodChain((Level(fine, 8, 0.05), Level(coarse, 4, 0.1))), path)
            yield suffix[1:], "levels", path.read_bytes()
        write_scene(street(3), path)
        yield "glb", "scene", path.read_bytes()
        path = path.with_suffix(".json")
        up = np.array([0.0, 1.0, 0.0])
        cameras = [
            Camera.looking(
                np.array([float(x), 2.0, 0.0]), np.array([0.2, -0.1, 1.0]), up, 60.0, 0.1
            )
            for x in range(2)
        ]
        save_camera_path(CameraPath("walk", tuple(cameras)), path)
        yield "camera_path", "written", path.read_bytes()
    frame = {"position": [0, 0, 0], "target": [1, 2, 3], "up": [0, 0, 1], "fov": 60}
    by_hand = {"schema_version": 1, "name": "by hand", "frames": [frame, {**frame, "near": 1e-3}]}
    yield "camera_path", "by_hand", json.dumps(by_hand).encode()


def _decided_files() -> Iterator[tuple[str, str, bytes]]:
    """What people write beside meshes, and what a build keeps."""
    yield (
        "mtl",
        "glass",
        b"# panes\nnewmtl brick\nKd 0.5 0.4 0.3\nd 1.0\n"
        b"newmtl cloth\nTr 0.25\nmap_d -clamp on leaf.png\n",
    )
    yield "overrides", "all", _OVERRIDES
    yield "overrides", "ignoring", b'[ignore]\nmaterials = ["cl?th"]\nmeshes = ["[f]*"]\n'
    yield "build_manifest", "all", _MANIFEST
    figures = AssetFigures(12, 0.99, 0.9, 0.125, None, 0.004, "good")
    entries = {
        "wall.obj": Entry("ab", {"a.mtl": ""}, {"budget": 12}, "1", {"x.glb": "cd"}, figures),
        "props/crate.ply": Entry(
            "ef", {}, {"error_bounds": [0.5, 1.0]}, "1", {"c_lod0.tres": "01"}, figures,
            {"c.tres": {"sides": "single"}},
        ),
    }  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "written.lock")
        write_record(path, entries)
        yield "build_record", "written", path.read_bytes()
        held = {name: one for name, one in entries.items() if _SHARD.holds(name)}
        making = {name: Making("it was never made", 1.5, ("weak",)) for name in held}
        record = ShardRecord(_SHARD, "ab", "1", True, held, making, {"trees/oak.stl": "it is open"})
        write_shard_record(path, record)
        yield "shard_record", "written", path.read_bytes()
        mesh = Path(folder, "rock.glb")
        for name in ("by_hand_glb", "rich"):
            data = next(data for _, one, data in _all_glb() if one == name)
            mesh.write_bytes(data)
            yield "original", name, data
            added = Occluder(box().vertices, box().faces, 0.5)
            yield "original", f"{name}_again", embed_occluder(mesh, load(mesh), added, "lod")


def _all_glb() -> Iterator[tuple[str, str, bytes]]:
    for name, (suffix, data) in valid_files().items():
        if suffix == ".glb":
            yield "glb", f"by_hand_{name}", data
    yield from _gltf()


def _cases() -> Iterator[tuple[str, str, bytes]]:
    meshes: dict[str, TriangleMesh] = {"box": box(), "table": table(), "open": box(without=[2])}
    chosen: dict[str, dict[str, object]] = {
        "box": {"conservative": True},
        "table": {"lods": 2},
        "open": {"ground": True, "shrink": 0.1, "trim": "area"},
    }
    for name, mesh in meshes.items():
        case = {"mesh": soup_of(mesh), "options": {**_QUICK, **_JUDGED, **chosen[name]}}
        yield "simplify", name, write_case(case)
    yield (
        "evaluate",
        "part",
        write_case(
            {
                "mesh": soup_of(table()),
                "occluder": soup_of(box((1.5, 0.1, 0.8), (0.0, 0.7, 0.0))),
                "options": {"resolution": 8, **_JUDGED},
            }
        ),
    )
    scene = street(4)
    yield (
        "scene",
        "street",
        write_case(
            {
                "meshes": [soup_of(mesh) for mesh in scene.meshes],
                "mesh_of": scene.mesh_of.tolist(),
                "transforms": scene.transforms.tolist(),
                "options": {"budget": 12, "resolution": 8, "moves": 20, "pixel_error": 100.0},
                "cameras": [{"position": [0, 1, -9], "forward": [0, 0, 1], "fov": 60, "near": 0.1}],
            }
        ),
    )


if __name__ == "__main__":
    main()
