"""What a user pays for whole processes: ``python -m bench.start [--only WORD] [--repeats N]``.

Every start is a process of its own, with a kernel cache in an empty folder.  ``cpu_s`` and
``wall_s`` are medians over the repeats, of the process and all that it starts; what compiles or
takes a minute is run once.  ``work_s`` is the CPU time of the same work done again in a process
that has done it once, so ``cpu_s - work_s`` is the start.  ``compiled`` counts the files of machine
code that were written.  A wheel is made and installed before, which is not counted.

``ratio`` and ``wall_ratio`` are these times over the CPU time of the reference work in the same run
(:mod:`bench.reference`).  Writes ``bench/results/start_all.csv`` and ``start.md``.
"""

from __future__ import annotations

import argparse
import json
import shutil
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import simplifier
from bench.meshes import bumpy_sphere, stand_in_named
from bench.process_tree import run_command
from bench.record import Row, told, write_page, write_table
from bench.reference import reference_seconds, remark, with_ratios
from release.wheel import make_wheel
from simplifier.kernels.compiled.code_files import kernel_files
from simplifier.kernels.compiled.processors import kinds_here

RESULTS = Path("bench/results")

_OCCLUDER = (sys.executable, "-m", "simplifier")
_INSTALLED = (sys.executable, "-P", "-m", "simplifier")  # not from the folder that it is called in
_LITTLE = (
    "--preset", "draft", "--moves", "8", "--resolution", "16", "--budget", "8", "--views", "4",
    "--image", "32", "--quads", "64",
)  # fmt: skip
_WARMUP = "occluder warmup from nothing"
_CODE_SUFFIXES = (".nbc", ".o")
_MANY = 100
_ONE_BY_ONE = """
import json, subprocess, sys
for call in json.loads(sys.argv[1]):
    subprocess.run(call, check=True, capture_output=True)
"""
_AGAIN = """
import contextlib, io, sys, time
from simplifier.cli.main import main
for _ in range(2):
    begin = time.process_time()
    sys.argv = ["occluder", *sys.argv[1:]]
    with contextlib.suppress(SystemExit), contextlib.redirect_stdout(io.StringIO()):
        main()
print(time.process_time() - begin)
"""


@dataclass(frozen=True)
class Start:
    """A command by its title; ``cold`` where no kernel is compiled yet, ``long`` where it is run
    once, since it takes a minute, ``wheel`` where it is of a wheel with machine code.

    ``work`` are words of ``occluder`` whose second run in a process is the work without the start.
    """

    title: str
    command: tuple[str, ...]
    cold: bool = False
    long: bool = False
    wheel: bool = False
    work: tuple[str, ...] = ()


def starts(folder: Path) -> Iterator[Start]:
    """All of them, in an order in which those after ``warmup`` find its kernels."""
    mesh, name = _bunny(folder)
    output = str(folder / "occluder.glb")
    # Else all but the first would find what is current, and make nothing.
    whole = ("simplify", str(mesh), "-o", output, "--ground", "--force")
    box = folder / "small.ply"
    _save(48, box)
    small = ("simplify", str(box), "-o", output, "--force", *_LITTLE)
    yield Start(f"first occluder simplify, {name}", (*_OCCLUDER, *whole), cold=True)
    yield Start(_WARMUP, (*_OCCLUDER, "warmup"), cold=True)
    first = (*_INSTALLED, *whole)
    yield Start(f"first occluder simplify of a wheel, {name}", first, cold=True, wheel=True)
    yield Start("first occluder warmup of a wheel", (*_INSTALLED, "warmup"), cold=True, wheel=True)
    yield Start(f"occluder simplify, {name}", (*_OCCLUDER, *whole), work=whole)
    yield Start("occluder simplify, 48 triangles", (*_OCCLUDER, *small), work=small)
    meshes = [folder / f"small{number}.ply" for number in range(_MANY)]
    for mesh in meshes:
        shutil.copyfile(box, mesh)
    many = ("simplify", *map(str, meshes), "-o", str(folder / "many"), "--force", *_LITTLE)
    calls = [[*_OCCLUDER, "simplify", str(mesh), "-o", output, *_LITTLE] for mesh in meshes]
    yield Start(f"occluder simplify, {_MANY} small meshes in one call", (*_OCCLUDER, *many))
    one_by_one = (sys.executable, "-c", _ONE_BY_ONE, json.dumps(calls))
    yield Start(f"occluder simplify, {_MANY} small meshes in {_MANY} calls", one_by_one, long=True)
    yield Start("occluder --help", (*_OCCLUDER, "--help"))
    yield Start("occluder --version", (*_OCCLUDER, "--version"))
    yield Start("import simplify", (sys.executable, "-c", "from simplifier import simplify"))
    yield Start("python alone", (sys.executable, "-c", "pass"))


def start_rows(repeats: int, only: str = "") -> Iterator[Row]:
    """A row a start whose title holds ``only``."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        warm = folder / "warm"
        for number, start in enumerate(starts(folder)):
            if only not in start.title:
                continue
            cache = folder / f"cold{number}" if start.cold else warm
            if not start.cold and not warm.exists():
                run_command((*_OCCLUDER, "warmup"), {"NUMBA_CACHE_DIR": str(warm)})
            variables = {"NUMBA_CACHE_DIR": str(cache)}
            if start.wheel:
                variables["PYTHONPATH"] = str(_installed_wheel(folder))
            yield measured(start, variables, 1 if start.cold or start.long else repeats)
            if start.title == _WARMUP:
                cache.rename(warm)


def measured(start: Start, variables: Mapping[str, str], repeats: int) -> Row:
    """The row of one start with those variables, of which one names the folder of kernels."""
    cache = Path(variables["NUMBA_CACHE_DIR"])
    before = _machine_code(cache)
    runs = [run_command(start.command, variables) for _ in range(repeats)]
    row: dict[str, object] = {
        "start": start.title,
        "cpu_s": statistics.median(run.cpu_seconds for run in runs),
        "wall_s": statistics.median(run.seconds for run in runs),
        "peak_mib": statistics.median(run.peak_mib for run in runs),
        "work_s": None,
        "repeats": repeats,
        "compiled": len(_machine_code(cache) - before),
    }
    if start.work:
        again = (sys.executable, "-c", _AGAIN, *start.work)
        works = [run_command(again, variables).output.split()[-1] for _ in range(repeats)]
        row["work_s"] = statistics.median(map(float, works))
    return row


def _installed_wheel(folder: Path) -> Path:
    """Where a wheel with machine code is installed, beside all that it needs."""
    site = folder / "site"
    if not site.exists():
        wheel = make_wheel(folder, kernel_files(), kinds_here())
        pip = (sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target")
        subprocess.run([*pip, str(site), str(wheel)], check=True)
    return site


def _bunny(folder: Path) -> tuple[Path, str]:
    """The real one, or a generated solid of as many triangles."""
    bunny = stand_in_named("bunny_4968")
    if bunny.path.exists():
        return bunny.path, bunny.name
    path = folder / "bumpy.ply"
    _save(4968, path)
    return path, "bumpy-4968"


def _save(triangles: int, path: Path) -> None:
    mesh = bumpy_sphere(triangles)
    simplifier.save(simplifier.Occluder(mesh.vertices, mesh.faces), path)


def _machine_code(cache: Path) -> set[tuple[Path, int]]:
    """Files and when they were written: one that is written again counts as compiled again."""
    return {
        (path, path.stat().st_mtime_ns)
        for path in cache.rglob("*")
        if path.suffix in _CODE_SUFFIXES
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Parse the command line, measure, and write the table."""
    parser = argparse.ArgumentParser(prog="python -m bench.start", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--only", default="", help="starts whose title holds this; nothing is kept")
    parser.add_argument("--repeats", type=int, default=5, help="of what does not compile (5)")
    parser.add_argument("-o", "--output", type=Path, default=RESULTS, help="folder of the results")
    given = parser.parse_args(arguments)
    around = [reference_seconds()]
    rows: list[Row] = []
    for row in start_rows(given.repeats, given.only):
        rows.append(row)
        print(told(row), flush=True)
    around.append(reference_seconds())
    rows = with_ratios(rows, {"cpu_s": "ratio", "wall_s": "wall_ratio"}, around)
    command = f"python -m bench.start --repeats {given.repeats}"
    if given.only:
        print(remark(around))
        return
    write_table(given.output / "start_all.csv", rows, command, remark(around))
    print(write_page(given.output, "start", ("all",)))


if __name__ == "__main__":
    main()
