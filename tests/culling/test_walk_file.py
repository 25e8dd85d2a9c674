"""Walks as pages play them: read back here, and held against the culler frame by frame."""

from __future__ import annotations

import gzip
import json
from dataclasses import replace

import numpy as np
import pytest

from bench.visibility_city import generated_city
from simplifier.api import simplify_scene
from simplifier.camera_paths.generate import generate_path
from simplifier.culling import walk_file
from simplifier.culling.culler import Culler
from simplifier.culling.depth_buffer import DepthBuffer, Verdict
from simplifier.culling.fate import Fate
from simplifier.culling.flythrough import fly
from simplifier.culling.walk_file import MAGIC, encode_walk
from simplifier.options.scene import CullOptions, PathOptions
from tests.culling.occluded import (
    HIDDEN,
    SMALL,
    WALL,
    exact,
    looking,
    path_of,
    street,
    tree_of,
    wall_with_window,
)
from tests.walkable import scene_of

PATH = path_of(looking(), looking((0.0, -8.0, 3.0)), looking(forward=(0.0, -1.0, 0.0)), looking())


def read(data):
    """The header and the arrays, with what changes from frame to frame added up."""
    plain = gzip.decompress(data)
    assert plain[:4] == MAGIC
    start = 8 + int.from_bytes(plain[4:8], "little")
    header = json.loads(plain[8:start])
    arrays = {}
    for name, told in header["arrays"].items():
        count = int(np.prod(told["shape"]))
        arrays[name] = np.frombuffer(plain, told["type"], count, start + told["at"]).reshape(
            told["shape"]
        )
    for name in ("fates", "drawn"):
        arrays[name] = np.bitwise_xor.accumulate(arrays[name], axis=0)
    return header, arrays


def bits(rows, count):
    return np.unpackbits(rows, axis=1, bitorder="little")[:, :count]


def fates_of(header, arrays):
    parts = header["parts"]
    wide = -(-parts // 8)
    planes = [bits(arrays["fates"][:, at * wide : (at + 1) * wide], parts) for at in range(3)]
    return planes[0] + 2 * planes[1] + 4 * planes[2]


def mesh_of(arrays, item):
    """Vertices relative to the origin and faces of a part or, after these, of an occluder."""
    counts = arrays["counts"].astype(int)
    first, corner = counts[:item, 0].sum(), 3 * counts[:item, 1].sum()
    low, size = arrays["boxes"][item].reshape(2, 3)
    steps = arrays["positions"][first : first + counts[item, 0]] / 65_535.0
    faces = arrays["indices"][corner : corner + 3 * counts[item, 1]].reshape(-1, 3)
    return low + size * steps, faces


@pytest.mark.parametrize("wall", [WALL, wall_with_window()], ids=["wall", "window"])
def test_each_frame_is_what_the_culler_says(wall):
    scene = street(wall)
    tree = tree_of(scene, {"wall": exact(WALL)})
    flown = fly(scene, tree, PATH, SMALL)
    header, arrays = read(encode_walk(flown, "street.glb"))
    fates, drawn = fates_of(header, arrays), bits(arrays["drawn"], header["occluders"])
    culler = Culler(tree, DepthBuffer(SMALL.rows, SMALL.columns))
    for row, occluders, camera in zip(fates, drawn, PATH.cameras, strict=True):
        culled = culler.cull(camera)
        hidden = np.isin(row, (Fate.CULLED, Fate.WRONG))
        # What is in no pixel even alone is absent, whatever is said of it.
        assert (culled.verdicts[hidden] == Verdict.HIDDEN).all()
        shown = np.isin(row, (Fate.SEEN, Fate.MISSED))
        assert (culled.verdicts[shown] == Verdict.VISIBLE).all()
        assert occluders.sum() == len(culled.drawn)
    names = [scene.names[part] for part in np.flatnonzero(fates[0] == Fate.CULLED)]
    assert set(names) <= set(HIDDEN)
    assert names
    assert (fates[0] == Fate.WRONG).any() == (wall is not WALL)
    assert (fates[3] == fates[0]).all()


def test_its_figures_are_those_of_the_frames():
    scene = street(wall_with_window())
    flown = fly(scene, tree_of(scene, {"wall": exact(WALL)}), PATH, SMALL)
    header, _ = read(encode_walk(flown, "street.glb"))
    for at, frame in enumerate(flown.frames):
        told = {name: values[at] for name, values in header["figures"].items()}
        assert told["in_view"] == frame.figures.objects.in_view
        assert told["hidden"] == frame.figures.objects.hidden
        assert told["culled"] == frame.figures.objects.culled
        assert told["wrong"] == frame.figures.objects.wrong
        assert told["wrong_pixels"] == frame.figures.wrong_pixels
        assert told["occluder_triangles"] == frame.figures.occluder_triangles
    assert (header["up"], header["upward"], header["frames"]) == (2, 1.0, 4)
    assert header["aspect"] == pytest.approx(80 / 45)


def test_shapes_and_cameras_are_where_they_were():
    shift = np.array([4e6, -2e6, 300.0])  # as on a map
    scene = street()
    placed = scene.transforms.copy()
    placed[:, :3, 3] += shift
    moved = replace(scene, transforms=placed)
    cameras = [replace(one, position=one.position + shift) for one in PATH.cameras]
    flown = fly(moved, tree_of(moved, {"wall": exact(WALL)}), path_of(*cameras), SMALL)
    header, arrays = read(encode_walk(flown, "street.glb"))
    eye = arrays["cameras"][0, :3]
    for part in range(header["parts"]):
        points, faces = mesh_of(arrays, part)
        whole = flown.parts.scene.joined([part])
        assert np.abs((points - eye) - (whole.vertices - cameras[0].position)).max() < 1e-3
        assert np.array_equal(faces, whole.faces)
    points, faces = mesh_of(arrays, header["parts"])
    own, sides, _ = flown.occluders.placed(*flown.played[0].drawn[0])
    assert np.abs((points - eye) - (own - cameras[0].position)).max() < 1e-3
    assert np.array_equal(faces, sides)
    assert np.allclose(arrays["cameras"][:, 3:12], [one.axes.ravel() for one in PATH.cameras])


def test_occluders_from_elsewhere_are_played_as_well():
    scene = street()
    flown = fly(scene, scene_of(WALL, names=["theirs"]), PATH, SMALL)
    header, arrays = read(encode_walk(flown, "street.glb"))
    assert header["occluders"] == 1
    assert bits(arrays["drawn"], 1).ravel().tolist() == [1, 1, 0, 1]
    assert np.ptp(mesh_of(arrays, header["parts"])[0], axis=0) == pytest.approx([12.0, 0.2, 8.0])


def test_large_scenes_are_shown_as_boxes(monkeypatch):
    scene = street(wall_with_window())
    flown = fly(scene, tree_of(scene, {"wall": exact(WALL)}), PATH, SMALL)
    monkeypatch.setattr(walk_file, "_MOST_TRIANGLES", 90)
    header, arrays = read(encode_walk(flown, "street.glb"))
    assert arrays["counts"][: header["parts"], 1].tolist() == [12] * 7
    assert header["triangles"] == 120


def test_a_town_is_small_and_the_same_again(tmp_path):
    scene = generated_city(2)
    tree = simplify_scene(scene, tmp_path / "town", up="z", ground=True, resolution=16, moves=50)
    path = generate_path(scene, PathOptions(frames=30, up="z"))
    made = [
        encode_walk(fly(scene, tree, path, CullOptions((160, 90), repeats=1, shots=0)), "t")
        for _ in range(2)
    ]
    assert made[0] == made[1]
    header, _ = read(made[0])
    still = gzip.compress(gzip.decompress(made[0])[: -header["frames"]], 6)
    moving = len(made[0]) / header["frames"]
    assert len(still) < 400_000
    assert moving < 20_000
