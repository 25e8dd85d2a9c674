"""Foretold memory beside the true peak: ``python -m bench.stability.memory [--large]``.

A row a run of the command line, in a process of its own: what :func:`simplifier.estimate_memory`
says of the file and of its mesh, and the most that was resident in the process.  Meshes: those of
the assets that are there, and balls written in each format.  With ``--large`` also 20 million
triangles, and a grid of 512 voxels.  Writes ``bench/results/stability_memory.csv`` and prints it.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import simplifier
from bench.machine import ROOT
from bench.meshes import ASSETS, bumpy_sphere, readable_assets
from bench.point import measure_command
from bench.record import Row, markdown, read_table, told, write_table
from bench.stability.balls import write_ball
from simplifier.geometry.occluder import Occluder
from simplifier.io.save import save_occluder
from simplifier.warmup import warm_up

RESULT = ROOT / "bench" / "results" / "stability_memory.csv"

Given = dict[str, int | float | str | bool]

_SMALL = 100_000  # triangles of a ball, where they are not what grows
_LEAKY = ASSETS / "bunny_4968.ply"  # its base is open: remedies are tried, in memory of their own
_FORMATS = (".ply", ".stl", ".obj", ".off", ".glb")
_QUICK: Given = {"preset": "draft", "moves": 600, "views": 16}  # time, not memory, is saved


@dataclass(frozen=True)
class Case:
    """A run: a mesh file, its options by keyword, and whether pictures are drawn too."""

    path: Path
    given: Given = field(default_factory=dict)
    pictures: bool = False

    def row(self, folder: Path) -> Row:
        """Foretold, measured, and the one as a share of the other."""
        options = simplifier.SimplifyOptions.of(self.given)
        need = simplifier.estimate_memory(self.path, options, pictures=self.pictures)
        mesh = simplifier.load(self.path)
        need = need.joined(simplifier.estimate_memory(mesh, options, pictures=self.pictures))
        triangles = len(mesh.faces)
        del mesh
        arguments = [_typed(name, value) for name, value in self.given.items()]
        if self.pictures:
            arguments.append(f"--pictures={folder / 'pictures'}")
        seconds, mib = measure_command(
            "simplify", str(self.path), "-o", str(folder / "made.glb"), "--memory-limit=1000",
            *arguments,
        )  # fmt: skip
        shown = " ".join(f"{name}={value}" for name, value in self.given.items())
        return {
            "mesh": self.path.name, "triangles": triangles,
            "options": shown + (" pictures" if self.pictures else ""),
            "stage": need.largest, "foretold_mib": need.gib * 1024.0, "peak_mib": mib,
            "ratio": need.gib * 1024.0 / mib, "seconds": seconds,
        }  # fmt: skip


def _typed(name: str, value: object) -> str:
    option = f"--{name.replace('_', '-')}"
    return option if value is True else f"{option}={value}"


def cases(folder: Path, *, large: bool) -> Iterator[Case]:
    """All of them, smallest kinds first."""
    for path, standing in readable_assets() if ASSETS.is_dir() else ():
        yield Case(path, {name: value for name, value in standing.items() if value is not False})
    if _LEAKY.exists():
        yield Case(_LEAKY, {**_QUICK, "resolution": 512})
    small = write_ball(folder / "small.ply", _SMALL)
    yield Case(write_ball(folder / "ball_4m.ply", 4_000_000), _QUICK)
    for suffix in _FORMATS:
        yield Case(_in_format(folder / f"ball{suffix}", 1_000_000), _QUICK)
    for resolution in (128, 256):
        yield Case(small, {**_QUICK, "resolution": resolution})
        yield Case(small, {**_QUICK, "resolution": resolution, "smallest_hole": 0.2})
        yield Case(small, {**_QUICK, "resolution": resolution, "shrink": 0.05})
    for image, views in ((1024, 64), (4096, 16)):
        yield Case(small, {**_QUICK, "image": image, "views": views})
        yield Case(small, {**_QUICK, "image": image, "views": views, "exact": True})
    for budget in (500, 4000):
        yield Case(small, {"moves": 600, "views": 16, "budget": budget})
    yield Case(small, {"preset": "best", "moves": 600, "resolution": 128})
    yield Case(small, {"lods": 3, "moves": 600})
    yield Case(small, _QUICK, pictures=True)
    if large:
        for suffix in (".ply", ".stl"):
            ball = write_ball(folder / f"ball_20m{suffix}", 20_000_000)
            yield Case(ball, {"views": 16})
            ball.unlink()
        yield Case(small, {**_QUICK, "resolution": 512})
        yield Case(write_ball(folder / "ball_20m.ply", 20_000_000), {**_QUICK, "resolution": 512})


def _in_format(path: Path, triangles: int) -> Path:
    if path.suffix in (".ply", ".stl"):
        return write_ball(path, triangles)
    mesh = bumpy_sphere(triangles)
    save_occluder(Occluder(mesh.vertices, mesh.faces, 0.0), path)
    return path


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, write the table and print it."""
    parser = argparse.ArgumentParser(prog="python -m bench.stability.memory", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--large", action="store_true", help="20 million triangles, 512 voxels")
    large = parser.parse_args(arguments).large
    warm_up()
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as name:
        for case in cases(Path(name), large=large):
            rows.append(case.row(Path(name)))
            print(told(rows[-1]), flush=True)
    command = "python -m bench.stability.memory" + (" --large" if large else "")
    write_table(RESULT, rows, command, "peak: most resident in the process, MiB")
    print(markdown(read_table(RESULT)))


if __name__ == "__main__":
    main()
