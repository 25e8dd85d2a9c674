"""The C header of occluders reads what the library writes, and nothing that is damaged."""

from __future__ import annotations

import math
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simplifier.errors import UnreadableMeshError
from simplifier.geometry.camera import Lens
from simplifier.geometry.mesh import as_mesh
from simplifier.geometry.occluder import Level, LodChain, Occluder
from simplifier.io.load import load_lods, load_occluder
from simplifier.io.save import save_lods, save_occluder
from simplifier.options.simplify import Style
from tests.integrations.c.programs import CHECKED, HEADERS, LANGUAGES, compiled, printed
from tests.io.builders import tetrahedron
from tests.solids import sphere


@pytest.fixture(scope="module", params=LANGUAGES)
def program(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("c")
    return compiled(folder, "print_occluder.c", request.param, *CHECKED)


def numbers(lines: list[str], word: str) -> np.ndarray:
    return np.array([line.split()[1:] for line in lines if line.split()[0] == word], dtype=float)


def chain() -> LodChain:
    ball = sphere(rings=6)
    offset = np.array([1.7e6, 5.2e6, 300.0])
    levels = tuple(
        Level(
            Occluder(ball.vertices + offset, ball.faces[: 60 - 20 * index], 0.1 * 2.0**index),
            64 >> index,
            0.05 * 2.0**index,
        )
        for index in range(3)
    )
    return LodChain(levels, Lens(720, 50.0), 2.0)


def test_an_occluder_comes_back(program: Path, tmp_path: Path) -> None:
    occluder = replace(tetrahedron(0.25), vertices=tetrahedron().vertices + 1e6)
    save_occluder(occluder, tmp_path / "one.occ")
    (lines,) = printed(program, tmp_path / "one.occ")
    assert lines[0] == "all is well"
    world = numbers(lines, "v") + numbers(lines, "origin")
    corners = world[numbers(lines, "f").astype(int)]
    np.testing.assert_array_equal(corners, occluder.vertices[occluder.faces])
    assert lines[3].startswith("sides 2 welded 1 screen 0")
    assert lines[4].startswith("level 0 bound 0.25 deviation nan from 0 resolution 0 width 2")
    box = numbers(lines, "box")[0] + np.tile(numbers(lines, "origin")[0], 2)
    np.testing.assert_allclose(box, [*occluder.vertices.min(0), *occluder.vertices.max(0)])


def test_levels_come_back_with_the_distances_to_change_them_at(
    program: Path, tmp_path: Path
) -> None:
    made = chain()
    save_lods(made, tmp_path / "ball.occ")
    (lines,) = printed(program, tmp_path / "ball.occ")
    rows = [line.split() for line in lines if line.startswith("level")]
    assert [float(row[3]) for row in rows] == [level.error_bound for level in made.levels]
    assert [float(row[5]) for row in rows] == [level.deviation for level in made.levels]
    assert [float(row[7]) for row in rows] == [made.switch_distance(k) for k in range(3)]
    assert [int(row[9]) for row in rows] == [64, 32, 16]
    assert len(numbers(lines, "f")) == sum(level.triangles for level in made.levels)
    for distance, _, index in (line.split()[1:] for line in lines if line.startswith("at")):
        assert made.levels[int(index)] is made.at(float(distance))
    back = load_lods(tmp_path / "ball.occ")
    assert (back.lens, back.pixel_error) == (made.lens, made.pixel_error)
    for level, before in zip(back.levels, made.levels, strict=True):
        corners = before.occluder.vertices[before.occluder.faces]
        np.testing.assert_allclose(
            level.occluder.vertices[level.occluder.faces], corners, atol=1e-6
        )
        assert (level.error_bound, level.deviation) == (before.error_bound, before.deviation)


@pytest.mark.parametrize(("count", "width"), [(65_535, 2), (65_536, 4)])
def test_indices_are_as_wide_as_needed(
    program: Path, tmp_path: Path, count: int, width: int
) -> None:
    random = np.random.default_rng(0)
    vertices = random.uniform(-1, 1, (count, 3))
    faces = np.resize(np.arange(count, dtype=np.int32), (count // 3 + 1, 3))
    save_occluder(Occluder(vertices, faces), tmp_path / "many.occ")
    (lines,) = printed(program, tmp_path / "many.occ")
    assert lines[4].endswith(f"width {width}")
    np.testing.assert_array_equal(numbers(lines, "f"), faces)


def test_single_sided_is_told(program: Path, tmp_path: Path) -> None:
    sheet = Occluder(np.eye(3), np.array([[0, 1, 2]], dtype=np.int32))
    save_occluder(sheet, tmp_path / "sheet.occ", Style(sides="single"))
    (lines,) = printed(program, tmp_path / "sheet.occ")
    assert "sides 1" in lines[3]
    assert numbers(lines, "f").tolist() == [[0, 1, 2], [2, 1, 0]]


def test_triangles_that_meet_share_their_vertices(program: Path, tmp_path: Path) -> None:
    whole = tetrahedron(0.25)
    soup = Occluder(*as_mesh(whole.vertices[whole.faces]), 0.25)
    save_occluder(soup, tmp_path / "soup.occ")
    save_occluder(whole, tmp_path / "whole.occ")
    assert (tmp_path / "soup.occ").read_bytes() == (tmp_path / "whole.occ").read_bytes()
    (lines,) = printed(program, tmp_path / "soup.occ")
    assert len(numbers(lines, "v")) == 4


def test_a_file_from_before_they_did_is_read(program: Path, tmp_path: Path) -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0], [0, 1, 0], [0, 0, 1]], "<f4")
    level = struct.pack("<3d2Q4I8x", 0.5, math.nan, 0.0, 192, 272, 6, 2, 2, 0)
    header = struct.pack(
        "<8s2IQ2I3d6f2dI28x", b"\x89OCC\r\n\x1a\n", 1, 0, 288, 1, 128, 5e6, 0, 9,
        0, 0, 0, 1, 1, 1, 0, 0, 0,
    )  # fmt: skip
    indices = struct.pack("<6H4x", 0, 1, 2, 3, 4, 5)
    (tmp_path / "old.occ").write_bytes(header + level + points.tobytes() + bytes(8) + indices)
    (lines,) = printed(program, tmp_path / "old.occ")
    assert lines[0] == "all is well"
    assert lines[3].startswith("sides 2 welded 0")
    np.testing.assert_array_equal(numbers(lines, "v"), points)
    occluder = load_occluder(tmp_path / "old.occ")
    assert occluder.error_bound == 0.5
    corners = points[[[0, 1, 2], [3, 4, 5]]] + np.array([5e6, 0, 9])
    np.testing.assert_array_equal(occluder.vertices[occluder.faces], corners)


def test_an_occluder_that_hides_nothing(program: Path, tmp_path: Path) -> None:
    save_occluder(Occluder(np.empty((0, 3)), np.empty((0, 3), np.int32)), tmp_path / "no.occ")
    (lines,) = printed(program, tmp_path / "no.occ")
    assert lines[0] == "all is well"
    assert len(numbers(lines, "f")) == 0
    assert "bound inf" in lines[4]


DAMAGES = {
    "another version": (8, struct.pack("<I", 2), "another version"),
    "a longer file": (16, struct.pack("<Q", 1 << 40), "cut short"),
    "no level": (24, struct.pack("<I", 0), "damaged"),
    "many levels": (24, struct.pack("<I", 2**32 - 1), "damaged"),
    "a table behind the end": (28, struct.pack("<I", 4096), "damaged"),
    "a table that is not aligned": (28, struct.pack("<I", 132), "damaged"),
    "an origin that is no number": (40, struct.pack("<d", math.nan), "damaged"),
    "an infinite origin": (32, struct.pack("<d", math.inf), "damaged"),
    "a negative bound": (128, struct.pack("<d", -1.0), "damaged"),
    "positions behind the end": (152, struct.pack("<Q", 2**64 - 16), "damaged"),
    "indices that are not aligned": (160, struct.pack("<Q", 242), "damaged"),
    "many vertices": (168, struct.pack("<I", 2**32 - 1), "damaged"),
    "many triangles": (172, struct.pack("<I", 2**32 - 1), "damaged"),
    "an odd width": (176, struct.pack("<I", 3), "damaged"),
    "an index out of range": (240, struct.pack("<H", 4), "damaged"),
}


@pytest.mark.parametrize("name", DAMAGES)
def test_damage_is_refused_by_both_readers(program: Path, tmp_path: Path, name: str) -> None:
    save_occluder(tetrahedron(0.5), tmp_path / "good.occ")
    offset, patch, said = DAMAGES[name]
    data = bytearray((tmp_path / "good.occ").read_bytes())
    data[offset : offset + len(patch)] = patch
    (tmp_path / "bad.occ").write_bytes(data)
    (lines,) = printed(program, tmp_path / "bad.occ")
    assert said in lines[0]
    with pytest.raises(UnreadableMeshError):
        load_occluder(tmp_path / "bad.occ")


def test_every_truncation_and_flipped_byte_is_survived(program: Path, tmp_path: Path) -> None:
    save_lods(chain(), tmp_path / "ball.occ")
    data = (tmp_path / "ball.occ").read_bytes()
    names = []
    for length in range(0, len(data), 7):
        names.append(tmp_path / f"cut{length}")
        names[-1].write_bytes(data[:length])
    cuts = printed(program, *names)
    assert len(cuts) == len(names)
    assert all(lines[0] != "all is well" for lines in cuts)
    random = np.random.default_rng(1)
    names = []
    for index in range(600):
        flipped = bytearray(data)
        place = int(random.integers(0, 320 if index % 2 else len(data)))
        flipped[place] ^= 1 << int(random.integers(0, 8))
        names.append(tmp_path / f"flip{index}.occ")
        names[-1].write_bytes(flipped)
    for path, lines in zip(names, printed(program, *names), strict=True):
        if lines[0] != "all is well":
            with pytest.raises(UnreadableMeshError):
                load_lods(path)


@pytest.mark.parametrize("compiler", LANGUAGES)
@pytest.mark.parametrize("backwards", [False, True])
def test_all_headers_go_into_one_source_in_any_order(
    compiler: str, backwards: bool, tmp_path: Path
) -> None:
    """Two of them once gave one name to a function and to a type."""
    names = sorted((path.name for path in HEADERS.glob("*.h")), reverse=backwards)
    assert len(names) == 4
    lines = [f'#include "{name}"' for name in 2 * names]
    source = tmp_path / "all.c"
    source.write_text("\n".join([*lines, "int main(void) { return 0; }", ""]))
    compiled(tmp_path, str(source), compiler)
