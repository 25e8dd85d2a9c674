"""What a user waits for before any work begins: compiling, loading kernels, importing.

Wall time of whole processes.  ``compilations`` counts the machine code files that the process wrote
to the kernel cache; every kernel is cached, so 0 means that nothing was compiled.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import simplifier
from bench.machine import ROOT
from bench.meshes import bumpy_sphere, stand_in_named
from bench.record import Row

_OCCLUDER = ("-m", "simplifier")


def start_times(repeats: int) -> Iterator[Row]:
    """The first start once, as a fresh install has it; the others ``repeats`` times."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        yield _timed("occluder warmup, kernel cache empty", [*_OCCLUDER, "warmup"], folder, 1)
        mesh, title = _bunny(folder)
        simplify = [*_OCCLUDER, "simplify", str(mesh), "-o", str(folder / "occluder.glb")]
        yield _timed(f"occluder simplify {title}, started after it", simplify, folder, repeats)
        yield _timed("occluder --version", [*_OCCLUDER, "--version"], folder, repeats)
        work = "from simplifier import simplify"
        yield _timed(work, ["-c", work], folder, repeats)
        yield _timed("python alone", ["-c", "pass"], folder, repeats)


def _bunny(folder: Path) -> tuple[Path, str]:
    """The real one, or a generated solid of as many triangles."""
    bunny = stand_in_named("bunny_4968")
    if bunny.path.exists():
        return bunny.path, bunny.name
    mesh, path = bumpy_sphere(4968), folder / "bumpy.ply"
    simplifier.save(simplifier.Occluder(mesh.vertices, mesh.faces), path)
    return path, "bumpy-4968"


def _timed(title: str, arguments: list[str], folder: Path, repeats: int) -> Row:
    cache = folder / "kernels"
    environment = os.environ | {"NUMBA_CACHE_DIR": str(cache)}
    seconds, before = [], _machine_code(cache)
    for _ in range(repeats):
        begin = time.perf_counter()
        subprocess.run(
            [sys.executable, *arguments], cwd=ROOT, env=environment, check=True, capture_output=True
        )
        seconds.append(time.perf_counter() - begin)
    return {
        "start": title, "median_s": statistics.median(seconds), "min_s": min(seconds),
        "max_s": max(seconds), "repeats": repeats,
        "compilations": len(_machine_code(cache) - before),
    }  # fmt: skip


def _machine_code(cache: Path) -> set[tuple[Path, int]]:
    """Files and when they were written: one that is written again counts as compiled again."""
    return {(path, path.stat().st_mtime_ns) for path in cache.rglob("*.nbc")}
