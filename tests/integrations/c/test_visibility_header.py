"""The C header of visible sets finds the library's cells and sets, and takes nothing damaged."""

from __future__ import annotations

import struct
import tempfile
from collections.abc import Sequence
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.errors import UnreadablePvsError
from simplifier.geometry.pvs import METHODS, UNKNOWN, Pvs, Rows
from simplifier.geometry.scene import axis_order
from simplifier.io.pvs_file import decode_pvs, encode_pvs
from tests.integrations.c.programs import CHECKED, compiled, printed
from tests.io.damaged_pvs import DAMAGES, patched, signed, town
from tests.strategies.visible_sets import points_around, visible_sets

FUSED = ["-O2", "-march=native", "-ffp-contract=fast"]
"""Products and sums are rounded once, where the machine can."""
FAST_MATH = ["-O2", "-march=native", "-ffast-math"]
"""Besides, no number is taken for NaN, and the smallest are 0."""


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled(tmp_path_factory.mktemp("c"), "print_visibility.c", "gcc", *CHECKED)


def told(program: Path, *files: tuple[bytes, bytes]) -> list[list[str]]:
    """The lines about each file and its points."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "files")
        parts = (
            struct.pack("=2Q", len(data), len(points)) + data + points for data, points in files
        )
        path.write_bytes(b"".join(parts))
        return printed(program, path)


def rest(lines: Sequence[str], word: str) -> list[str]:
    """What follows a word that lines begin with."""
    return [line[len(word) + 1 :] for line in lines if line.split(" ")[0] == word]


def words_of(visible: np.ndarray) -> str:
    """A set as the program prints it."""
    padded = np.zeros(-(-len(visible) // 64) * 64, bool)
    padded[: len(visible)] = visible
    return " ".join(f"{word:016x}" for word in np.packbits(padded, bitorder="little").view("<u8"))


def world_points(pvs: Pvs, seed: int) -> np.ndarray:
    """World points (n, 3) in and around the cells, and some that are no places."""
    around = points_around(pvs.cells, np.random.default_rng(seed)) + pvs.origin
    world = np.empty_like(around)
    world[:, axis_order(pvs.up)] = around
    return np.concatenate([world, [[1e300, 0, 0], [np.inf, 0, 0], [0, np.nan, 0]]])


def check_told(lines: Sequence[str], pvs: Pvs, points: np.ndarray) -> None:
    assert lines[0] == "all is well"
    assert rest(lines, "counts") == [
        f"{len(pvs.names)} {len(pvs.cells)} {len(pvs.rows)} method {METHODS.index(pvs.method)} "
        f"conservative {pvs.conservative:d} partial {pvs.partial:d} up {'xyz'.index(pvs.up)}"
    ]
    (origin,) = rest(lines, "origin")
    assert [float(word) for word in origin.split()] == pvs.origin.tolist()
    assert rest(lines, "scene") == [f"{pvs.scene.hex()} 1 settings {pvs.settings.hex()}"]
    assert rest(lines, "name") == [name.encode().hex() for name in pvs.names]
    everything = np.ones(len(pvs.names), bool)
    sets = [everything, *(pvs.visible(cell) for cell in range(len(pvs.cells)))]
    assert rest(lines, "set") == [words_of(one) for one in sets]
    check_parts(lines, pvs, sets[1:])
    told = zip(rest(lines, "at"), rest(lines, "from"), pvs.to_cells(points), strict=True)
    for index, (line, seen, point) in enumerate(told):
        cells = pvs.cells.containing(point).tolist()
        assert [int(word) for word in line.split()] == [len(cells), *cells[:4]]
        seen_there = everything
        if len(pvs.cells):
            cell = cells[0] if cells else index % len(pvs.cells)
            seen_there = seen_from(pvs, cell, sets[1 + cell], point[2])
        objects = np.flatnonzero(seen_there) + 1
        assert [int(word) for word in seen.split()] == [len(objects), summed(objects * objects)]


def seen_from(pvs: Pvs, cell: int, visible: np.ndarray, height: float) -> np.ndarray:
    """What is visible from a height over the plan of a cell, in it or not."""
    if pvs.row_of[cell] == UNKNOWN:
        return visible
    inside = pvs.cells.low[cell, 2] <= height <= pvs.cells.high[cell, 2]
    seen = visible if inside else np.ones_like(visible)
    return seen if pvs.altitudes is None else seen & pvs.altitudes.seen(cell, height)


def check_parts(lines: Sequence[str], pvs: Pvs, sets: Sequence[np.ndarray]) -> None:
    """Slices and altitudes; the first line of each cell is of a place outside of all."""
    slices, altitudes = pvs.slices, pvs.altitudes
    (parts,) = rest(lines, "parts")
    count, known, *heights = map(float, parts.split())
    assert (count, known) == (0 if slices is None else slices.count, altitudes is not None)
    if altitudes is not None:
        ends = [altitudes.low + k * altitudes.step + pvs.origin[2] for k in (1, 65534)]
        assert heights == pytest.approx(ends, rel=1e-14, abs=1e-14)
    numbers = np.arange(1, len(pvs.names) + 1)
    told, drawn = rest(lines, "slices")[1:], rest(lines, "drawn")[1:]
    for cell, (line, sums) in enumerate(zip(told, drawn, strict=True)):
        computed = pvs.row_of[cell] != UNKNOWN
        if slices is None or not computed:
            assert line == "none"
        else:
            whole = np.zeros((len(numbers), 3), int)
            whole[sets[cell]] = slices.of(cell)
            named = pvs.order[sets[cell][pvs.order]]
            assert line.split() == [str(k) for k in whole[named].ravel().tolist()]
        ranges = pvs.drawn(cell)[sets[cell]].reshape(-1, 6)
        sum_of_ranges = (ranges * np.arange(1, 7)).sum(axis=1) @ numbers[sets[cell]]
        of_cell = numbers * 0 if altitudes is None else altitudes.values[cell].astype(np.int64)
        assert sums == f"{summed(sum_of_ranges)} {summed(of_cell * numbers) if computed else 0}"


def summed(values: np.ndarray) -> int:
    """As 32 bits hold it."""
    return int(np.sum(values)) % 2**32


@given(pvs=visible_sets(), seed=st.integers(0, 99))
def test_cells_and_sets_are_those_of_the_library(program: Path, pvs: Pvs, seed: int) -> None:
    points = world_points(pvs, seed)
    (lines,) = told(program, (encode_pvs(pvs), points.tobytes()))
    check_told(lines, pvs, points)


def test_it_reads_the_same_as_c_plus_plus(tmp_path: Path) -> None:
    """Another language, the same header: the cells, the sets, and each damage once."""
    program = compiled(tmp_path, "print_visibility.c", "g++", *CHECKED)
    pvs, data = town(), encode_pvs(town())
    points = world_points(pvs, 0)
    damaged = [patched(data, place(data), patch) for place, patch, _ in DAMAGES.values()]
    cut = [data[:length] for length in range(0, len(data), 16)]
    good, *bad = told(program, (data, points.tobytes()), *((file, b"") for file in damaged + cut))
    check_told(good, pvs, points)
    assert all(len(lines) == 1 and lines[0] != "all is well" for lines in bad)


@pytest.fixture(scope="module")
def fused(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled(tmp_path_factory.mktemp("fused"), "print_visibility.c", "gcc", *FUSED)


@given(pvs=visible_sets(), seed=st.integers(0, 99))
def test_no_cell_is_lost_or_found_by_fused_products(fused: Path, pvs: Pvs, seed: int) -> None:
    points = world_points(pvs, seed)
    (lines,) = told(fused, (encode_pvs(pvs), points.tobytes()))
    check_told(lines, pvs, points)


def test_what_is_read_with_fast_math(tmp_path: Path) -> None:
    """A compiler that knows no NaN still tells a box from a prism, and damage from a file."""
    fast = compiled(tmp_path, "print_visibility.c", "gcc", *FAST_MATH)
    pvs, data = town(), encode_pvs(town())
    inside = np.array(
        [[0.5, 0.5, 0.5], [1.5, 1.0, 1.0], [4.5, 1.0, 2.0], [5.9, 3.0, 1.0], [9, 9, 2]]
    )
    world = np.empty_like(inside)
    world[:, axis_order(pvs.up)] = inside + pvs.origin
    damaged = [patched(data, place(data), patch) for place, patch, _ in DAMAGES.values()]
    good, *bad = told(fast, (data, world.tobytes()), *((file, b"") for file in damaged))
    check_told(good, pvs, world)
    assert all(lines[0] != "all is well" for lines in bad)


@pytest.mark.parametrize("name", DAMAGES)
def test_damage_is_refused(program: Path, name: str) -> None:
    place, patch, _ = DAMAGES[name]
    data = encode_pvs(town())
    (lines,) = told(program, (patched(data, place(data), patch), b""))
    assert len(lines) == 1
    other = "version" in name or name == "a flag of later"
    said = "another version" if other else "cut short" if name == "a longer file" else "damaged"
    assert said in lines[0]


def test_every_truncation_and_flipped_bit_is_refused(program: Path) -> None:
    data = encode_pvs(town())
    files = [data[:length] for length in range(len(data))]
    for bit in range(8 * len(data)):
        flipped = bytearray(data)
        flipped[bit // 8] ^= 1 << bit % 8
        files.append(bytes(flipped))
    found = told(program, *((file, b"") for file in files))
    assert len(found) == len(files)
    assert all(len(lines) == 1 and lines[0] != "all is well" for lines in found)


def test_both_readers_refuse_the_same_under_a_right_checksum(program: Path) -> None:
    data = encode_pvs(town())
    random = np.random.default_rng(1)
    files = []
    for _ in range(1500):
        changed = bytearray(data)
        for place in random.integers(8, len(data), random.integers(1, 4)):
            changed[place] = random.choice([0, 1, 0x7F, 0x80, 0xFF, random.integers(256)])
        files.append(signed(changed))
    taken = 0
    for file, lines in zip(files, told(program, *((file, b"") for file in files)), strict=True):
        try:
            pvs = decode_pvs(file, "town.pvs")
        except UnreadablePvsError:
            assert lines[0] != "all is well"
        else:
            check_told(lines, pvs, np.empty((0, 3)))
            taken += 1
    assert 10 < taken < 1000


def test_a_file_of_the_version_before_is_read(program: Path) -> None:
    pvs = town(slices=None, altitudes=None)
    data = patched(encode_pvs(pvs), 8, struct.pack("<I", 2))
    points = world_points(pvs, 0)
    (lines,) = told(program, (data, points.tobytes()))
    check_told(lines, pvs, points)


@pytest.mark.parametrize(
    ("run", "taken"), [(b"\x80\x80\x80\x80\0", True), (b"\x80" * 5 + b"\0", False)]
)
def test_a_length_may_have_five_bytes(program: Path, run: bytes, taken: bool) -> None:
    rows = Rows(run + b"\2\1\1", np.array([0, len(run) + 1, len(run) + 2, len(run) + 3]))
    data = encode_pvs(town(rows=rows, slices=None))
    (lines,) = told(program, (data, b""))
    if taken:
        check_told(lines, decode_pvs(data, "town.pvs"), np.empty((0, 3)))
    else:
        assert lines == ["the file is damaged"]
        with pytest.raises(UnreadablePvsError):
            decode_pvs(data, "town.pvs")


def test_names_are_utf_8_to_both_readers(program: Path) -> None:
    leads = (0x00, 0x7F, 0x80, 0xC1, 0xC2, 0xDF, 0xE0, 0xE1, 0xED, 0xEE, 0xF0, 0xF1, 0xF4, 0xF5)
    seconds = (0x61, 0x7F, 0x80, 0x8F, 0x90, 0x9F, 0xA0, 0xBF, 0xC0)
    others = (0x61, 0x80, 0xBF, 0xC0)
    data = encode_pvs(town(names=("four", "", "", "")))
    begin = data.index(b"four")
    names = [bytes(one) for one in product(leads, seconds, others, others)]
    files = [(patched(data, begin, name), b"") for name in names]
    for name, lines in zip(names, told(program, *files), strict=True):
        try:
            name.decode()
        except UnicodeDecodeError:
            assert lines == ["the file is damaged"]
        else:
            assert rest(lines, "name")[0] == name.hex()


def test_more_objects_than_are_looked_at_together(program: Path) -> None:
    """The order is checked in parts; an object that stands twice is found in any of them."""
    count = 70_000
    order = np.arange(count, dtype=np.int32)[::-1].copy()
    pvs = town(names=("",) * count, order=order, slices=None, altitudes=None)
    data = encode_pvs(pvs)
    begin = 16 * struct.unpack_from("<I", data, 88)[0]
    twice = [
        patched(data, begin + 4 * place, struct.pack("<I", other))
        for place, other in ((0, 0), (count - 1, count - 1), (30_000, 32_767), (5, 32_768))
    ]
    good, *bad = told(program, *((file, b"") for file in (data, *twice)))
    assert good[0] == "all is well"
    assert [lines[0] for lines in bad] == ["the file is damaged"] * len(twice)
