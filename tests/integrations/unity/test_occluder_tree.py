"""The C# reader of scenes takes and refuses what all readers do, and meets the same nodes."""

from __future__ import annotations

import shutil
import struct
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from simplifier.errors import SceneError
from simplifier.geometry.camera import Camera
from simplifier.hierarchy.packing import pack_tree
from simplifier.hierarchy.visible_nodes import CutFinder
from simplifier.io.occs_file import decode_occs, encode_occs
from tests.acceptance.command import ROOT
from tests.culling.test_culler import random_tree
from tests.integrations.c.programs import printed
from tests.io.damaged_occs import DAMAGES, patched, town

SCRIPT = ROOT / "integrations" / "unity" / "OccluderTree.cs"
HARNESS = ROOT / "tests" / "integrations" / "unity" / "WalkTree.cs"

pytestmark = pytest.mark.skipif(
    not (shutil.which("mcs") and shutil.which("mono")),
    reason="the C# compiler mcs is not installed (Debian's mono-mcs)",
)


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """As a program that starts by itself."""
    folder = tmp_path_factory.mktemp("unity")
    command = ["mcs", "-langversion:7", "-warnaserror", f"-out:{folder / 'walk.exe'}"]
    done = subprocess.run([*command, SCRIPT, HARNESS], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    script = folder / "walk"
    script.write_text(f'#!/bin/sh\nexec mono {folder / "walk.exe"} "$@"\n')
    script.chmod(0o700)
    return script


def written(folder, name, data):
    (folder / name).write_bytes(data)
    return folder / name


def test_what_was_written_comes_back(program, tmp_path):
    tree = town()
    views = written(tmp_path, "views", b"")
    (lines,) = printed(program, views, written(tmp_path, "town.occs", encode_occs(tree)))
    assert lines[0] == "all is well"
    assert [line[5:] for line in lines if line.startswith("name")] == list(tree.objects)
    parts = [tuple(map(int, line.split()[1:])) for line in lines if line.startswith("part")]
    assert parts == tree.parts.tolist()
    corners = [list(map(float, line.split()[1:])) for line in lines if line.startswith("corner")]
    expected = [
        [index, *(vertices[corner] - tree.meshes[index]["origin"]).tolist()]
        for index in range(len(tree.meshes))
        for vertices, faces in [tree.mesh(index)]
        for corner in faces.reshape(-1)
    ]
    assert corners == expected


def test_it_meets_the_nodes_that_python_meets(program, tmp_path):
    for seed in range(4):
        rng = np.random.default_rng(seed)
        away = rng.choice([0.0, 5e6]) * np.array([1.0, 0.9, 0.0])
        packed = pack_tree(random_tree(rng, away))
        if seed % 2:
            worth = rng.choice([0.0, 0.5, 1.0, 3.0], len(packed.nodes)).astype(np.float32)
            packed = replace(packed, worth=worth)
        finder, views, expected = CutFinder.of(packed), b"", []
        for place in range(6):
            eye = away + rng.uniform(-40.0, 40.0, 3)
            camera = Camera.looking(eye, np.array([1.0, 0, 0]), np.array([0.0, 0, 1]), 60.0, 0.1)
            focal, pixels = rng.uniform(50.0, 500.0), float(rng.choice([0.5, 3.0, 30.0]))
            most = None if place % 2 else int(rng.integers(0, 300))
            views += struct.pack("<6d", *eye, focal, pixels, -1 if most is None else most)
            drawn = finder.cut(camera, focal, pixels, lambda node: node % 7 == 3, most)
            expected.append([f"{node}:{level}" for node, level in drawn])
        (lines,) = printed(
            program, written(tmp_path, "views", views),
            written(tmp_path, f"{seed}.occs", encode_occs(packed)),
        )  # fmt: skip
        found = [line.split()[1:] for line in lines if line.startswith("drawn")]
        assert found == expected
        assert any(expected)


def test_damage_is_refused(program, tmp_path):
    data = encode_occs(town())
    cases = [patched(data, place(data), patch) for place, patch, _ in DAMAGES.values()]
    random = np.random.default_rng(2)
    for _ in range(300):
        flipped = bytearray(data)
        flipped[int(random.integers(0, len(data)))] ^= 1 << int(random.integers(0, 8))
        cases.append(patched(bytes(flipped), 0, b""))
    cases += [data[:length] for length in range(0, len(data), 11)]
    cases.append(data[:-1] + bytes([data[-1] ^ 1]))
    paths = [written(tmp_path, f"{index}.occs", case) for index, case in enumerate(cases)]
    told = printed(program, written(tmp_path, "views", b""), *paths)
    assert len(told) == len(cases)
    for case, lines in zip(cases, told, strict=True):
        try:
            decode_occs(case, "case")
            refusal = ""
        except SceneError as error:
            refusal = str(error)
        taken = refusal == "" or "about itself" in refusal
        assert (lines[0] == "all is well") == taken, (refusal, lines[0])
