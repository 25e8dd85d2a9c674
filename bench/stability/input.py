"""What bad input costs and what becomes of it: ``python -m bench.stability.input``.

Writes two tables and prints them as Markdown.  ``far``: one vertex of a mesh further and further
out, judged against the mesh as it was; with the real truck that has one at 1e30.  ``nonsense``:
files of 1 GiB that are no meshes, under every suffix.
"""

from __future__ import annotations

import argparse
import tempfile
import time
import tracemalloc
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import simplifier
from bench.machine import ROOT
from bench.meshes import ASSETS, bumpy_sphere
from bench.record import Row, markdown, read_table, write_table
from simplifier.geometry.mesh import TriangleMesh
from simplifier.io.formats import readable_suffixes
from simplifier.options.simplify import SimplifyOptions
from simplifier.warmup import warm_up

COMMAND = "python -m bench.stability.input"
RESULTS = ROOT / "bench" / "results"

FAR = (1.0, 10.0, 100.0, 1e3, 1e6, 1e30)
"""Lengths of the mesh that one vertex is moved out by."""

SIZE = 1 << 30

_BLOCKS = {
    "zeros": bytes(1 << 20),
    "noise": np.random.default_rng(0).bytes(1 << 20),
    "words": (b"lorem ipsum dolor sit am\n" * 41_944)[: 1 << 20],
    "one line": b"x" * (1 << 20),
}


def far_rows() -> Iterator[Row]:
    """The sphere undisturbed, then with a vertex further and further out; then the truck."""
    whole = bumpy_sphere(4968)
    yield judged("bumpy sphere", "", whole, whole)
    for lengths in FAR:
        vertices = np.array(whole.vertices)
        vertices[0, 0] += lengths * whole.extent.max()
        moved = TriangleMesh.from_soup(vertices, whole.faces)
        yield judged("bumpy sphere", f"{lengths:g} lengths", whole, moved)
    paths = [ASSETS / name for name in ("broken_truck.ply", "broken_DERIVED_truck_nan.ply")]
    if all(path.exists() for path in paths):
        truck, damaged = map(simplifier.load, paths)
        yield judged("truck", "", truck, truck)
        yield judged("truck", "1e30 units, and NaN", truck, damaged)


def judged(name: str, far: str, whole: TriangleMesh, mesh: TriangleMesh) -> Row:
    made = simplifier.simplify(mesh, SimplifyOptions())
    report = simplifier.evaluate(whole, made.occluder, exact=True).accuracy
    told = " ".join(made.warnings)
    return {
        "mesh": name, "one vertex is out by": far, "dropped": mesh.dropped.total,
        "triangles": len(made.occluder.faces), "recall": report.recall,
        "precision": report.precision,
        "warned": "dropped" if "left out" in told else "stretched" if "lie within" in told else "",
    }  # fmt: skip


def nonsense_rows(size: int) -> Iterator[Row]:
    """A row a kind of nonsense: the slowest and the largest of all suffixes."""
    with tempfile.TemporaryDirectory() as name:
        for kind, block in _BLOCKS.items():
            runs = [_refused(Path(name), suffix, block, size) for suffix in readable_suffixes()]
            seconds, peaks = zip(*runs, strict=True)
            yield {
                "file": kind, "MiB": size >> 20, "suffixes": len(runs),
                "longest_s": max(seconds), "peak_MiB": max(peaks) / (1 << 20),
            }  # fmt: skip


def _refused(folder: Path, suffix: str, block: bytes, size: int) -> tuple[float, int]:
    """Seconds until the refusal, and bytes at the peak."""
    path = folder / f"nonsense{suffix}"
    with path.open("wb") as file:
        for _ in range(size // len(block)):
            file.write(block)
    _refuse(path)  # modules that are loaded with the first file are not to count
    tracemalloc.start()
    begin = time.perf_counter()
    _refuse(path)
    seconds, peak = time.perf_counter() - begin, tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    path.unlink()
    return seconds, peak


def _refuse(path: Path) -> None:
    try:
        simplifier.load(path)
    except simplifier.UnreadableMeshError:
        return
    raise AssertionError(f"{path.name} was read")


def main() -> None:
    """Measure, write the tables, and print them."""
    argparse.ArgumentParser(prog=COMMAND, description=__doc__).parse_args()
    warm_up()
    for name, rows in (("far", list(far_rows())), ("nonsense", list(nonsense_rows(SIZE)))):
        path = RESULTS / f"stability_input_{name}.csv"
        write_table(path, rows, COMMAND)
        print(markdown(read_table(path)), end="\n\n")


if __name__ == "__main__":
    main()
