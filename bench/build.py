"""Checking and joining many assets: ``python -m bench.build [--assets N] [--kib K]``.

How long ``occluder build --check`` takes for assets that are all current, from a fresh process,
with warm files: wall clock of the whole command, the median of some runs, beside what reading and
hashing the same bytes takes by itself.  Likewise ``--check`` of one shard, and ``--join`` of all.
``build_check.csv`` and ``build_join.csv`` hold the figures, ``build.md`` shows them.
"""

from __future__ import annotations

import argparse
import random
import shutil
import statistics
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from bench.process_tree import run_command
from bench.record import Row, told, write_page, write_table
from simplifier.builds.build import build_assets
from simplifier.builds.digests import Digests
from simplifier.builds.making import AssetJob
from simplifier.builds.record import record_path
from simplifier.builds.shard_record import shards_folder
from simplifier.builds.shards import Shard
from simplifier.kernels.threads import thread_count
from simplifier.version import VERSION

RESULTS = Path("bench/results")
_FOLDER = 100  # meshes in each folder
_SHARDS = 10
_OCCLUDER = 3000  # bytes of an output
_MANIFEST = """[defaults]
ground = true
require = { min_recall = 0.5 }

[[asset]]
files = "**/*.ply"

[[asset]]
files = "folder_0/*.ply"
budget = 32
"""


def check_times(counts: Sequence[int], kib: int, repeats: int) -> Iterator[Row]:
    """A row a number of assets, each of ``kib`` KiB."""
    for count in counts:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            manifest = _built(folder, count, kib)
            command = [sys.executable, "-m", "simplifier", "build", "--check", str(manifest)]
            runs = [run_command(command) for _ in range(repeats)]
            seconds = [run.seconds for run in runs]
            yield {
                "assets": count, "mesh_kib": kib, "median_s": statistics.median(seconds),
                "min_s": min(seconds), "max_s": max(seconds), "repeats": repeats,
                "hashing_s": statistics.median(_hashing(folder) for _ in range(repeats)),
                "peak_mib": max(run.peak_mib for run in runs),
            }  # fmt: skip


def join_times(counts: Sequence[int], kib: int, repeats: int) -> Iterator[Row]:
    """A row a number of assets, made by shards."""
    for count in counts:
        with tempfile.TemporaryDirectory() as name:
            manifest = _written(Path(name, "assets"), count, kib)
            for number in range(1, _SHARDS + 1):
                shard = Shard(number, _SHARDS)
                build_assets(manifest, threading.Event(), maker=_pretended, shard=shard)
            kept = Path(name, "kept")
            shutil.copytree(shards_folder(manifest), kept)
            command = [sys.executable, "-m", "simplifier", "build", str(manifest)]
            check = [*command, "--check", "--shard", f"1/{_SHARDS}"]
            checks = [run_command(check).seconds for _ in range(repeats)]
            joins = []
            for _ in range(repeats):
                record_path(manifest).unlink(missing_ok=True)
                shutil.copytree(kept, shards_folder(manifest), dirs_exist_ok=True)
                joins.append(run_command([*command, "--join", "--quiet"]))
            yield {
                "assets": count, "mesh_kib": kib, "shards": _SHARDS,
                "check_of_one_s": statistics.median(checks),
                "join_s": statistics.median(run.seconds for run in joins), "repeats": repeats,
                "join_peak_mib": max(run.peak_mib for run in joins),
            }  # fmt: skip


def _built(folder: Path, count: int, kib: int) -> Path:
    """Meshes of noise, and a record as if occluders had been made of them."""
    manifest = _written(folder, count, kib)
    build_assets(manifest, threading.Event(), maker=_pretended)
    return manifest


def _written(folder: Path, count: int, kib: int) -> Path:
    noise = random.Random(0).randbytes(kib * 1024)
    for index in range(count):
        mesh = folder / f"folder_{index // _FOLDER}" / f"mesh_{index:06}.ply"
        mesh.parent.mkdir(parents=True, exist_ok=True)
        mesh.write_bytes(index.to_bytes(8, "little") + noise)
    manifest = folder / "occluders.toml"
    manifest.write_text(_MANIFEST)
    return manifest


def _pretended(job: AssetJob) -> Mapping[str, Any]:
    for target in job.targets:
        target.draft.write_bytes(job.mesh.read_bytes()[:_OCCLUDER])
    return {
        "triangles": job.options.budget, "precision": 0.999, "recall": 0.9, "deviation": 0.01,
        "error_bound": 0.05, "warnings": [], "version": VERSION, "overhang": {"share": 0.004},
        "verdict": {"word": "good", "reason": "it is pretended", "next": None},
    }  # fmt: skip


def _hashing(folder: Path) -> float:
    paths = [path for path in folder.rglob("*") if path.suffix in (".ply", ".glb")]
    begin = time.perf_counter()
    Digests().all_of(paths, thread_count())
    return time.perf_counter() - begin


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--assets", type=int, nargs="+", default=[100, 1000, 10_000])
    parser.add_argument("--kib", type=int, default=50)
    parser.add_argument("--repeats", type=int, default=5)
    chosen = parser.parse_args()
    for table, times in (("check", check_times), ("join", join_times)):
        rows = []
        for row in times(chosen.assets, chosen.kib, chosen.repeats):
            print(told(row), flush=True)
            rows.append(row)
        command = " ".join(["python -m bench.build", *sys.argv[1:]])
        write_table(RESULTS / f"build_{table}.csv", rows, command)
    write_page(RESULTS, "build", ["check", "join"])


if __name__ == "__main__":
    main()
