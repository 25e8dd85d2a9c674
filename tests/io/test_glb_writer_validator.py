"""All GLBs that are written, under Khronos's validator where node and npm's gltf-validator are.

npm install --prefix DIR gltf-validator
NODE_PATH=DIR/node_modules pytest tests/io/test_glb_writer_validator.py
"""

from __future__ import annotations

import json
import shutil
import subprocess
import zlib
from pathlib import Path

import numpy as np
import pytest

from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.scene import Scene
from simplifier.geometry.views import BoundingSphere
from simplifier.io import glb_writer
from simplifier.io.glb_embed import embed_occluder
from simplifier.io.glb_writer import encode_surface
from simplifier.io.load import load
from simplifier.io.scene_writer import encode_scene
from simplifier.io.written_faces import single_sided
from tests.io.builders import (
    TETRAHEDRON_FACES,
    TETRAHEDRON_POINTS,
    GltfBuilder,
    tetrahedron,
    text_ply,
)
from tests.io.test_gltf_lods import chain
from tests.solids import blob, box, torus

NODE = shutil.which("node")
CHECK = """
const validator = require('gltf-validator');
const chunks = [];
process.stdin.on('data', (chunk) => chunks.push(chunk)).on('end', async () => {
  const report = await validator.validateBytes(new Uint8Array(Buffer.concat(chunks)));
  console.log(JSON.stringify(report.issues));
});
"""
# A level of detail is no node of the scene, and the validator does not know the extension.
OF_LEVELS = {"UNSUPPORTED_EXTENSION", "UNUSED_OBJECT"}


def _there():
    found = [NODE, "-e", "require.resolve('gltf-validator')"]
    return NODE and subprocess.run(found, capture_output=True, check=False).returncode == 0


pytestmark = pytest.mark.skipif(
    not _there(), reason="npm's gltf-validator is not there (NODE_PATH names its node_modules)"
)


def issues(data):
    """Codes of what is wrong, of whatever severity."""
    done = subprocess.run(
        [NODE, "-e", CHECK], input=data, capture_output=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr.decode()
    return {one["code"] for one in json.loads(done.stdout)["messages"]}


def far(mesh):
    return Occluder(mesh.vertices + np.array([1_842_000.0, 5_176_000.0, 200.0]), mesh.faces)


OCCLUDERS = {
    "plain": tetrahedron(0.5),
    "empty": Occluder(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32)),
    "single-sided": single_sided(tetrahedron()),
    "in map coordinates": far(torus()),
}


@pytest.mark.parametrize("name", OCCLUDERS)
def test_an_occluder_has_no_issue(name):
    assert issues(glb_writer.encode(OCCLUDERS[name])) == set()


def test_levels_of_detail_have_none_but_that_they_are_levels():
    assert issues(glb_writer.encode_lods(chain())) == OF_LEVELS


def test_a_mesh_to_look_at_has_no_issue():
    mesh = blob(rings=4)
    assert issues(encode_surface(mesh, BoundingSphere.of(mesh))) == set()


@pytest.mark.parametrize("seed", range(4))
def test_a_scene_has_no_issue(seed):
    """As it stands, turned and mirrored, with shear; far away too."""
    generator = np.random.default_rng(seed)
    transforms = np.tile(np.eye(4), (4, 1, 1))
    transforms[1, :3, :3] = np.linalg.qr(generator.normal(size=(3, 3)))[0]
    transforms[2:, :3, :3] = generator.normal(size=(2, 3, 3))
    transforms[1:, :3, 3] = generator.normal(scale=10.0 ** (2 * seed), size=(3, 3))
    meshes = box((2, 3, 4)), TriangleMesh.from_soup(*_moved(torus(), 10.0 ** (2 * seed)))
    places = np.array([0, 1, 0, 1], dtype=np.int32)
    scene = Scene(meshes, ("a", "b", "c", "d"), places, transforms)
    assert issues(encode_scene(scene)) == set()


def _moved(mesh, offset):
    return mesh.vertices + offset, mesh.faces


def textured():
    """A glTF of one root, with a picture."""
    builder = GltfBuilder()
    mesh = whole_mesh(builder, TEXCOORD_0=("VEC2", "f4", [[0, 0], [1, 0], [0, 1], [1, 1]]))
    builder.root["meshes"][mesh]["primitives"][0]["material"] = 0
    picture = builder.view(png())
    builder.node(mesh=mesh, name="painted")
    builder.root |= {
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [{"bufferView": picture, "mimeType": "image/png"}],
        "scenes": [{"nodes": [0]}], "scene": 0,
    }  # fmt: skip
    return builder.glb()


def animated():
    """Two roots, of which one has a child that moves and bends a mesh with a skin."""
    builder = GltfBuilder()
    weights = [[0.5, 0.5, 0, 0]] * 4
    bent = whole_mesh(
        builder, JOINTS_0=("VEC4", "u1", [[0, 1, 0, 0]] * 4), WEIGHTS_0=("VEC4", "f4", weights)
    )
    builder.node(name="bent", mesh=bent, skin=0)
    builder.node(name="joint", children=[2])
    builder.node(name="moved")
    times = builder.accessor([0, 1], "SCALAR", "f4", min=[0], max=[1])
    places = builder.accessor([[0, 0, 0], [0, 1, 0]], "VEC3", "f4")
    target = {"node": 2, "path": "translation"}
    builder.root |= {
        "skins": [{"joints": [1, 2]}],
        "animations": [
            {
                "samplers": [{"input": times, "output": places}],
                "channels": [{"sampler": 0, "target": target}],
            }
        ],
        "scenes": [{"nodes": [0, 1]}],
        "scene": 0,
    }
    return builder.glb()


def whole_mesh(builder, **attributes):
    """A tetrahedron that says all that the format asks for."""
    points = np.array(TETRAHEDRON_POINTS, dtype=float)
    bounds = {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}
    position = builder.accessor(points, "VEC3", "f4", **bounds)
    more = {name: builder.accessor(v, kind, of) for name, (kind, of, v) in attributes.items()}
    indices = builder.accessor(np.ravel(TETRAHEDRON_FACES), "SCALAR", "u2")
    mesh = builder.primitives({"attributes": {"POSITION": position, **more}, "indices": indices})
    for accessor in builder.root["accessors"]:
        target = 34963 if accessor["type"] == "SCALAR" else 34962
        builder.root["bufferViews"][accessor["bufferView"]]["target"] = target
    return mesh


def png():
    """One white pixel."""

    def chunk(kind, body):
        check = zlib.crc32(kind + body).to_bytes(4, "big")
        return len(body).to_bytes(4, "big") + kind + body + check

    header = bytes([0, 0, 0, 1, 0, 0, 0, 1, 8, 2, 0, 0, 0])
    pixels = zlib.compress(b"\0\xff\xff\xff")
    parts = chunk(b"IHDR", header), chunk(b"IDAT", pixels), chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


ORIGINALS = {"textured": textured, "animated": animated}


@pytest.mark.parametrize("sides", ["double", "single"])
@pytest.mark.parametrize("name", [*ORIGINALS, "ply"])
def test_an_occluder_for_godot_adds_no_issue(tmp_path: Path, name: str, sides: str) -> None:
    assert both(tmp_path, name, "godot", sides) == set()


@pytest.mark.parametrize("name", ["textured", "ply"])
def test_an_occluder_as_a_level_adds_none_but_that_it_is_one(tmp_path: Path, name: str) -> None:
    assert both(tmp_path, name, "lod") == OF_LEVELS


def test_roots_with_a_skin_get_a_node_above(tmp_path: Path) -> None:
    """It moves nothing, which is what the validator warns of."""
    assert both(tmp_path, "animated", "lod") == OF_LEVELS | {"NODE_SKINNED_MESH_NON_ROOT"}


def both(tmp_path, name, how, sides="double"):
    if name == "ply":
        path = tmp_path / "rock.ply"
        path.write_bytes(text_ply())
    else:
        path = tmp_path / f"{name}.glb"
        path.write_bytes(ORIGINALS[name]())
        assert issues(path.read_bytes()) == set()
    occluder = single_sided(tetrahedron(0.5)) if sides == "single" else tetrahedron(0.5)
    return issues(embed_occluder(path, load(path), occluder, how))
