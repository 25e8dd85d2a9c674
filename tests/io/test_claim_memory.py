"""Headers that promise more than the file holds cost no memory."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from simplifier.errors import MeshError
from simplifier.io.load import load
from tests.allocating import most_allocated
from tests.io.builders import GltfBuilder, ply

MANY = 2**31
LITTLE = 64 << 20  # bytes: a few accessors of zeros are read until their sum is too much

XYZ = "property float x\nproperty float y\nproperty float z\n"
FACE = "property list uchar int vertex_indices\n"
FACES = f"element face 1\n{FACE}"
SHORT = b"\0" * 64


def claiming(**accessor: object) -> bytes:
    """A GLB whose positions are claimed to be many."""
    scene = GltfBuilder()
    view = scene.view(np.zeros((3, 3), "<f4").tobytes())
    place = {"bufferView": view} if accessor.pop("data") else {}
    positions = scene.raw_accessor(componentType=5126, count=MANY, type="VEC3", **place, **accessor)
    scene.node(mesh=scene.primitives({"attributes": {"POSITION": positions}}))
    return scene.glb()


def many_zeros() -> bytes:
    """Each accessor claims little, all of them half a gigabyte."""
    scene = GltfBuilder()
    zeros = [scene.raw_accessor(componentType=5126, count=999_999, type="VEC3") for _ in range(40)]
    scene.node(mesh=scene.primitives(*({"attributes": {"POSITION": one}} for one in zeros)))
    return scene.glb()


CLAIMS = {
    "vertices.ply": ply(f"element vertex {MANY}\n{XYZ}{FACES}", SHORT, "binary_little_endian"),
    "text.ply": ply(f"element vertex {MANY}\n{XYZ}{FACES}", b"0 0 0\n"),
    "bare.ply": ply(f"element vertex {MANY}\n{FACES}", SHORT, "binary_little_endian"),
    "bare_text.ply": ply(f"element vertex {MANY}\n{FACES}", b"3 0 1 2\n"),
    "faces.ply": ply(
        f"element vertex 3\n{XYZ}element face {MANY}\n{FACE}", SHORT, "binary_little_endian"
    ),
    "corners.ply": ply(
        f"element vertex 1\n{XYZ}element face 1\nproperty list uint int vertex_indices\n",
        b"\0" * 12 + struct.pack("<I", MANY), "binary_little_endian",
    ),
    "facets.stl": b"\0" * 80 + struct.pack("<I", MANY) + SHORT,
    "lines.off": f"OFF\n{MANY - 1} {MANY - 1} 0\n0 0 0\n".encode(),
    "length.glb": b"glTF" + struct.pack("<II", 2, MANY) + SHORT,
    "chunk.glb": b"glTF" + struct.pack("<IIII", 2, 84, MANY, 0x4E4F534A) + SHORT,
    "data.glb": claiming(data=True),
    "nothing.glb": claiming(data=False),
    "zeros.glb": many_zeros(),
}  # fmt: skip


@pytest.mark.parametrize("name", CLAIMS)
def test_more_than_there_is(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(CLAIMS[name])

    def refuse() -> None:
        with pytest.raises(MeshError, match=path.name):
            load(path)

    assert most_allocated(refuse) < LITTLE
