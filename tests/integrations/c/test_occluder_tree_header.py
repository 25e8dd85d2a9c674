"""The C headers of scenes walk as Python does, frame by frame, and refuse what is damaged."""

from __future__ import annotations

import platform
import shutil
import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest

from simplifier.culling.culler import Culler
from simplifier.culling.depth_buffer import DepthBuffer
from simplifier.errors import SceneError
from simplifier.geometry.camera import Camera, Lens
from simplifier.geometry.packed_tree import PackedTree
from simplifier.hierarchy.packing import pack_tree
from simplifier.io.occs_file import decode_occs, encode_occs
from tests.culling.test_culler import random_tree
from tests.integrations.c.programs import CHECKED, HEADERS, LANGUAGES, STRICT, compiled, printed
from tests.io.damaged_occs import DAMAGES, patched, town
from tests.rasters import random_camera

X86 = platform.machine().lower() in ("x86_64", "amd64")
PLAIN = ["-U__SSE2__", "-U__aarch64__"]
WAYS = {
    **{compiler: (compiler, CHECKED) for compiler in LANGUAGES},
    "gcc, AVX2": ("gcc", ["-O2", "-mavx2"] if X86 else ["-O2"]),
    "gcc, SSE4.1": ("gcc", ["-O2", "-msse4.1"] if X86 else ["-O2"]),
    "gcc, plain": ("gcc", ["-O0", *PLAIN]),
    "gcc, plain and optimised": ("gcc", ["-O2", *PLAIN]),
    "clang, AVX2": ("clang", ["-O2", "-mavx2"] if X86 else ["-O2"]),
}


VITAL = ("gcc", "clang++", "gcc, AVX2", "gcc, plain")
"""Of these ways; `make test-slow` takes the others."""


@pytest.fixture(
    scope="module",
    params=[
        way if way in VITAL else pytest.param(way, marks=pytest.mark.slow)
        for way in [*WAYS, "NEON"]
    ],
)
def program(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("c")
    if request.param == "NEON":
        return emulated(folder)
    if request.param == "gcc":
        made: Path = request.getfixturevalue("checked")
        return made
    compiler, flags = WAYS[request.param]
    return compiled(folder, "walk_tree.c", compiler, "-ffp-contract=off", *flags)


def emulated(folder: Path) -> Path:
    """For 64-bit ARM, run by qemu."""
    if shutil.which("aarch64-linux-gnu-gcc") is None or shutil.which("qemu-aarch64") is None:
        pytest.skip("there are no aarch64-linux-gnu-gcc and qemu-aarch64 here")
    made = folder / "walk_tree"
    source = Path(__file__).parent / "walk_tree.c"
    command = ["aarch64-linux-gnu-gcc", "-std=c99", *STRICT, "-O2", "-ffp-contract=off", "-static"]
    subprocess.run([*command, f"-I{HEADERS}", source, "-o", made, "-lm"], check=True)
    script = folder / "run"
    script.write_text(f'#!/bin/sh\nexec qemu-aarch64 {made} "$@"\n')
    script.chmod(0o700)
    return script


@pytest.fixture(scope="module")
def checked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled(
        tmp_path_factory.mktemp("c"), "walk_tree.c", "gcc", "-ffp-contract=off", *CHECKED
    )


def views_file(folder: Path, views: list[tuple[Camera, int, int, str, float, int | None]]) -> Path:
    numbers = []
    for camera, rows, columns, coverage, pixels, most in views:
        focal = Lens(rows, camera.fov).focal
        numbers += [
            *camera.position, *np.ravel(camera.axes), focal, camera.near, rows, columns,
            coverage == "inner", pixels, -1 if most is None else most, 0, 0,
        ]  # fmt: skip
    path = folder / "views"
    path.write_bytes(struct.pack(f"<{len(numbers)}d", *numbers))
    return path


def by_numba(packed: PackedTree, view: tuple[Camera, int, int, str, float, int | None]):
    camera, rows, columns, coverage, pixels, most = view
    culler = Culler(packed, DepthBuffer(rows, columns, coverage), pixels, most)
    culler.buffer.native = None
    return culler.cull(camera)


def test_each_frame_is_walked_as_python_walks_it(program: Path, tmp_path: Path) -> None:
    """Of random scenes, near and far from the origin, from outside and from among the things."""
    kinds = set()
    for seed in range(6):
        rng = np.random.default_rng(seed)
        away = rng.choice([0.0, 5e6]) * np.array([1.0, 0.9, 0.0])
        packed = pack_tree(random_tree(rng, away))
        path = tmp_path / f"{seed}.occs"
        path.write_bytes(encode_occs(packed))
        views = []
        for place in range(6):
            aside = random_camera(rng)
            camera = Camera(away + rng.uniform(-30, 30, 3), aside.axes, aside.fov, 0.1)
            most = None if place % 3 else int(rng.integers(0, 200))
            coverage = "inner" if place % 2 else "centre"
            pixels = float(rng.choice([0.5, 3.0, 30.0]))
            views.append((camera, 45, 71, coverage, pixels, most))
        (lines,) = printed(program, views_file(tmp_path, views), path)
        assert lines[0] == "all is well"
        for name in ("drawn", "verdicts", "counts"):
            assert sum(line.split()[0] == name for line in lines) == len(views)
        drawn = [line.split()[1:] for line in lines if line.startswith("drawn")]
        verdicts = [line.split()[1:] for line in lines if line.startswith("verdicts")]
        counts = [line.split()[1:] for line in lines if line.startswith("counts")]
        for view, *found in zip(views, drawn, verdicts, counts, strict=True):
            culled = by_numba(packed, view)
            assert found[0] == [f"{node}:{level}" for node, level in culled.drawn]
            assert list(map(int, found[1])) == culled.verdicts.tolist()
            assert list(map(int, found[2])) == [len(culled.drawn), culled.triangles]
            kinds.update(found[1])
    assert kinds == {"0", "1", "2"}


def test_what_was_written_comes_back(checked: Path, tmp_path: Path) -> None:
    tree = town()
    (tmp_path / "town.occs").write_bytes(encode_occs(tree))
    (lines,) = printed(checked, views_file(tmp_path, []), tmp_path / "town.occs")
    assert lines[:2] == [
        "all is well",
        "scene nodes 5 parts 3 vertices 4 rows 180 fov 60 pixels 0.5 up 2 conservative 1",
    ]
    assert [line[5:] for line in lines if line.startswith("name")] == list(tree.objects)
    parts = [tuple(map(int, line.split()[1:])) for line in lines if line.startswith("part")]
    assert parts == tree.parts.tolist()
    corners = [line.split()[1:] for line in lines if line.startswith("corner")]
    expected = [
        [str(index), *(f"{value:.9g}" for value in vertices[corner] - tree.meshes[index]["origin"])]
        for index in range(len(tree.meshes))
        for vertices, faces in [tree.mesh(index)]
        for corner in faces.reshape(-1)
    ]
    assert corners == expected


def test_damage_is_refused_by_all_readers(checked: Path, tmp_path: Path) -> None:
    data = encode_occs(town())
    paths = []
    for number, (place, patch, _) in enumerate(DAMAGES.values()):
        paths.append(tmp_path / f"{number}.occs")
        paths[-1].write_bytes(patched(data, place(data), patch))
    views = views_file(tmp_path, [])
    for name, lines in zip(DAMAGES, printed(checked, views, *paths), strict=True):
        said = "cut short" if name == "a longer file" else "damaged"
        if DAMAGES[name][2].endswith("newer release"):
            said = "another version"
        assert said in lines[0], name
        assert len(lines) == 1


def test_every_truncation_and_flipped_bit_is_survived(checked: Path, tmp_path: Path) -> None:
    """By the checksum, or by what they say where that is of the bytes as they are."""
    data = encode_occs(town())
    cases = [data[:length] for length in range(0, len(data), 3)]
    cut = len(cases)
    random = np.random.default_rng(1)
    for index in range(1200):
        flipped = bytearray(data)
        place = int(random.integers(0, len(data)))
        flipped[place] ^= 1 << int(random.integers(0, 8))
        cases.append(patched(bytes(flipped), 0, b"") if index % 4 else bytes(flipped))
    paths = []
    for number, case in enumerate(cases):
        paths.append(tmp_path / f"{number}.occs")
        paths[-1].write_bytes(case)
    ahead = Camera.looking(
        np.array([5e6 - 9.0, 1.0, 1.0]), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0, 1]), 60, 0.1
    )
    views = views_file(
        tmp_path, [(ahead, 18, 32, "inner", 0.5, None), (ahead, 9, 9, "centre", 9, 5)]
    )
    told = printed(checked, views, *paths)
    assert all(lines[0] != "all is well" for lines in told[:cut])
    taken = 0
    for case, lines in zip(cases[cut:], told[cut:], strict=True):
        refusal = _refusal(case)
        # What engines do not read may be wrong.
        assert (lines[0] == "all is well") == (refusal == "" or "about itself" in refusal), refusal
        taken += not refusal
    assert 0 < taken < 1200


def _refusal(data: bytes) -> str:
    """By the library's own reader; nothing where it takes the file."""
    try:
        decode_occs(data, "case")
    except SceneError as error:
        return str(error)
    return ""


def test_both_headers_mean_the_same_by_what_they_share() -> None:
    shared = set()
    for name in ("occluder_buffer.h", "occluder_tree.h"):
        text = (HEADERS / name).read_text()
        begin, end = text.index("#ifndef OCCLUDER_VIEW"), text.index("#endif /* OCCLUDER_VIEW */")
        shared.add(text[begin:end])
    assert len(shared) == 1
