"""After ``warmup`` nothing is compiled any more, whatever the first command is."""

from __future__ import annotations

import ast
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import simplifier
from simplifier.cli.main import main
from simplifier.io.formats import writable_suffixes
from simplifier.kernels.compiled import kernel
from simplifier.warmup import warm_up
from tests.acceptance.command import draw_small, environment, occluder
from tests.solids import box, joined, sphere

FEW = ("--resolution", "10", "--moves", "50", "--views", "3", "--image", "24", "--quads", "20")

POINTS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1)]
FACES = [(0, 1, 2, 3), (0, 1, 5), (0, 5, 4), (1, 2, 6, 5), (2, 3, 4, 5, 6)]

HEADER = """ply
format {} 1.0
element vertex 7
property double x
property double y
property double z
element face 5
property list uchar int vertex_indices
end_header
"""


def hand_made(folder):
    """Files as others write them: mixed faces, text and either byte order, comments, indices."""
    words = [" ".join(map(str, row)) for row in POINTS]
    rows = [*words, *(f"{len(face)} {' '.join(map(str, face))}" for face in FACES)]
    yield write(folder / "mixed.ply", HEADER.format("ascii") + "\n".join(rows) + "\n")
    for name, order in (("little", "<"), ("big", ">")):
        data = np.array(POINTS, f"{order}f8").tobytes() + b"".join(
            bytes([len(face)]) + np.array(face, f"{order}i4").tobytes() for face in FACES
        )
        path = folder / f"{name}.ply"
        path.write_bytes(HEADER.format(f"binary_{name}_endian").encode() + data)
        yield path
    corners = (" ".join(f"{i + 1}//1" for i in face) for face in FACES)
    obj = [*(f"v {word}" for word in words), "vn 0 0 1", *(f"f {line}" for line in corners)]
    yield write(folder / "quads.obj", "# comment\n" + "\n".join(obj) + "\n")
    yield write(folder / "mixed.off", "OFF\n7 5 0\n" + "\n".join(rows) + "\n")
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join(f"vertex {words[i]}\n" for i in face[:3])
        + "endloop\nendfacet\n"
        for face in FACES
    )
    yield write(folder / "text.stl", f"solid x\n{facets}endsolid x\n")


def write(path, text):
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def meshes(tmp_path_factory):
    """A file of every format and kind."""
    folder = tmp_path_factory.mktemp("meshes")
    mesh = joined(
        box(), box((0.5, 0.5, 0.5), (0.2, 0.2, 0.2)), box((1, 1, 1), (2, 0, 0), without=[2])
    )
    paths = []
    for suffix in writable_suffixes():
        paths.append(folder / f"boxes{suffix}")
        simplifier.save(simplifier.Occluder(mesh.vertices, mesh.faces), paths[-1])
    return [*paths, *hand_made(folder)]


def commands(meshes, folder):
    """What users may begin with, each the words of one command."""
    for path in meshes:
        target = str(folder / f"{path.stem}{path.suffix}")
        yield ["simplify", str(path), "-o", target, "--preset", "draft", *FEW]
        yield ["evaluate", str(path), target, *FEW[:2], *FEW[4:]]
    first, last = str(meshes[0]), str(folder / "last.glb")
    for more in (
        ["--trim", "area"],
        ["--preset", "best", "--exact"],
        ["--ground", "--up", "z", "--seed", str(2**63 - 1)],
        ["--pictures", str(folder / "pictures"), "--report", str(folder / "report.json")],
        ["--budget", "1"],
        ["--smallest-hole", "0.4", "--conservative", "--moves", "0"],
        ["--viewers", "above", "--shrink", "0.05"],
    ):
        yield ["simplify", first, "-o", last, *FEW, *more]
    walk, few = str(folder / "walk.json"), ["--resolution", "10", "--moves", "50"]
    yield ["path", first, "-o", walk, "--frames", "2", "--eye-height", "0.1"]
    for name, more in (("plain", []), ("inside", ["--conservative", "--ground"])):
        built = str(folder / name)
        yield ["scene", first, "-o", built, *few, *more]
        yield ["cull", first, "--occluders", built, "--path", walk, "-o", built, "--image", "32x18"]
    look, near = ["--cells", "1", "--views", "4"], ["--cell-size", "1", "--eye-height", "0.1"]
    for placing, more in (
        ("walkable", ["--pictures", built]),
        ("triangles", ["--fill", "viewers"]),
    ):
        sets = str(folder / f"{placing}.pvs")
        yield ["pvs", first, "-o", sets, "--cells", placing, *near, *more]
        yield ["pvs-check", first, sets, *look, "--pictures", "1"]
    np.save(hills := str(folder / "hills.npy"), np.arange(40.0).reshape(5, 8) % 7.0)
    sets, tiles = str(folder / "hills.pvs"), ["--spacing", "1,1", "--tile", "2"]
    yield ["pvs", hills, "-o", sets, "--cells", "grid", *tiles, *near]
    yield ["pvs-check", hills, sets, *tiles, *look]


def run_all(folder):
    """Run in a fresh process: every command, none of which may need numba."""
    paths = sorted(path for path in Path(folder).iterdir() if path.is_file())
    target = Path(folder) / "out"
    target.mkdir()
    for words in commands(paths, target):
        sys.argv = ["occluder", *words]
        with pytest.MonkeyPatch.context() as patch:
            if words[0] == "pvs":
                draw_small(patch)
            with pytest.raises(SystemExit) as end:
                main()
        assert not end.value.code, words
        assert "numba" not in sys.modules, words


def check_commands(meshes, **variables):
    """No command compiles, and so none imports numba, when ``warmup`` has run."""
    code = f"from {__name__} import run_all; run_all({str(meshes[0].parent)!r})"
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=environment(**variables), capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "compiled" not in done.stderr


def test_nothing_is_compiled_after_warm_up(meshes):
    warm_up()
    check_commands(meshes)


def kernel_files_called_for(rings, budget):
    """Run in a fresh process: of each call for machine code, the names of the files."""
    asked, load = [], kernel._load
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kernel, "_load", lambda names: (asked.append(list(names)), load(names)))
        mesh = sphere(rings=rings)
        made = simplifier.simplify(mesh, preset="draft", budget=budget, moves=50)
        made.measure()
        simplifier.evaluate(mesh, made.occluder)
    return asked


@pytest.mark.parametrize(("rings", "called"), [(4, None), (24, "contours"), (80, "front_contours")])
def test_one_call_for_machine_code_has_all_that_a_run_needs(rings, called):
    """So that what is missing is compiled at once, on all processors: two files that were asked for
    later took a third of a first start, by one processor."""
    code = f"from {__name__} import kernel_files_called_for as f; print(f({rings}, 16))"
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment(), capture_output=True, text=True, check=True
    )
    [names] = ast.literal_eval(done.stdout)
    later = [one for one in ("contours", "clusters", "front_contours") if one in names]
    assert later[-1:] == ([] if called is None else [called])


@pytest.mark.slow
def test_an_empty_cache_is_filled_by_warmup(meshes, tmp_path):
    """With an empty cache: a minute of compilation, then none at all."""
    cache = tmp_path / "cache"
    done = occluder("warmup", timeout=900, NUMBA_CACHE_DIR=str(cache))
    assert done.returncode == 0, done.stderr
    assert all(line.startswith("progress: compiling") for line in done.stderr.splitlines())
    written = times_in(cache)
    assert written
    shutil.rmtree(meshes[0].parent / "out", ignore_errors=True)
    check_commands(meshes, NUMBA_CACHE_DIR=str(cache))
    assert times_in(cache) == written


NO_COMPILER = "from simplifier.kernels.compiled import library; library._BUILD = 'raise SystemExit'"


@pytest.mark.slow
def test_code_that_is_compiled_ahead_makes_the_same_bytes_as_numba(meshes, tmp_path):
    """Which compiles function by function where nothing can be compiled ahead: a minute or two."""
    made = {}
    for way, before in (("ahead", ""), ("numba", NO_COMPILER)):
        target, cache = tmp_path / f"{way}.glb", tmp_path / way
        words = ["occluder", "simplify", str(meshes[0]), "-o", str(target), "--preset", "draft"]
        code = f"{before}\nimport sys\nfrom simplifier.cli.main import main\n" \
               f"sys.argv = {[*words, *FEW, '--moves', '400']!r}\nmain()"  # fmt: skip
        done = subprocess.run(
            [sys.executable, "-c", code], env=environment(NUMBA_CACHE_DIR=str(cache)), text=True,
            capture_output=True, timeout=900, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        assert ("one by one" in done.stderr) == (way == "numba")
        made[way] = target.read_bytes()
        files = {path.name.partition(".")[0] for path in times_in(cache)}
        assert bool(files) == (way == "ahead")
        assert not files & {"text", "box_verdict", "cull_map"}  # which this needs nothing of
    assert made["ahead"] == made["numba"]


def times_in(cache):
    """When each file of machine code was written."""
    return {path: path.stat().st_mtime_ns for path in cache.rglob("*.o")}
