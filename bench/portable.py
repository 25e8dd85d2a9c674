"""What machine code for a kind of processors costs beside code for this very one.

    python -m bench.portable [--rounds 3]

The image holds kernels for x86-64-v3, so that no host has to compile (``docker/processor.sh``).
Here each of the two is compiled into a cache of its own, and processes that load one take turns
with those that load the other, so that a change of the machine meets both.  ``ratio`` is the median
of the time for the kind over that for this processor, round by round; ``same`` whether the
occluders have the same bytes.  ``portable_works.csv`` holds the figures, ``portable.md`` shows
them.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import simplifier
from bench.machine import ROOT
from bench.meshes import STAND_INS, load_stand_in, stand_in_named
from bench.record import Row, told, write_page, write_table

RESULTS = Path("bench/results")
MESHES = ("bunny_4968", "dragon_871k", "terrain")
PRESETS = ("draft", "balanced")
TARGETS: Mapping[str, Mapping[str, str]] = {
    "this": {},
    "kind": {"NUMBA_CPU_NAME": "x86-64-v3", "NUMBA_CPU_FEATURES": ""},
}
_REPEATS = 3  # of each work in a process, after one that is not counted


def portable_rows(rounds: int) -> Iterator[Row]:
    """A row a mesh and preset."""
    with tempfile.TemporaryDirectory() as place:
        caches = {target: Path(place) / target for target in TARGETS}
        for target, cache in caches.items():
            _run(target, cache, "-m", "simplifier", "warmup")
        measured: dict[str, list[Mapping[str, Any]]] = {target: [] for target in TARGETS}
        for _ in range(rounds):
            for target, cache in caches.items():
                told = _run(target, cache, "-m", "bench.portable", "--here")
                measured[target].append(json.loads(told))
    for work in measured["this"][0]:
        this, kind = ([one[work] for one in measured[target]] for target in ("this", "kind"))
        ratios = [b["seconds"] / a["seconds"] for a, b in zip(this, kind, strict=True)]
        costs = [b["processor"] / a["processor"] for a, b in zip(this, kind, strict=True)]
        yield {
            "work": work, "rounds": rounds,
            "this_s": statistics.median(one["seconds"] for one in this),
            "kind_s": statistics.median(one["seconds"] for one in kind),
            "ratio": statistics.median(ratios), "least": min(ratios), "most": max(ratios),
            "processor_ratio": statistics.median(costs),
            "same": len({one["digest"] for one in (*this, *kind)}) == 1,
        }  # fmt: skip


def measure_here() -> dict[str, dict[str, Any]]:
    """Median wall and processor seconds of each work in this process, and what it gave."""
    found = {}
    for name in MESHES:
        stand_in = stand_in_named(name)
        mesh = load_stand_in(stand_in)
        for preset in PRESETS:
            walls, processors, digest = [], [], ""
            for _ in range(1 + _REPEATS):
                wall, processor = time.perf_counter(), time.process_time()
                made = simplifier.simplify(mesh, preset=preset, **stand_in.options)
                made.measure()
                walls.append(time.perf_counter() - wall)
                processors.append(time.process_time() - processor)
                digest = hashlib.sha256(
                    made.occluder.vertices.tobytes() + made.occluder.faces.tobytes()
                ).hexdigest()
            found[f"{name}, {preset}"] = {
                "seconds": statistics.median(walls[1:]),
                "processor": statistics.median(processors[1:]), "digest": digest,
            }  # fmt: skip
    return found


def _run(target: str, cache: Path, *arguments: str) -> str:
    environment = {
        name: value
        for name, value in os.environ.items()
        if name not in ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES")
    }
    done = subprocess.run(
        [sys.executable, *arguments], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True,
        env={**environment, "NUMBA_CACHE_DIR": str(cache), **TARGETS[target]},
    )  # fmt: skip
    return done.stdout


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.portable")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--here", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.here:
        print(json.dumps(measure_here()))
        return
    missing = [one.missing for one in STAND_INS if one.name in MESHES and one.missing]
    if missing:
        parser.error("; ".join(missing))
    rows = []
    for row in portable_rows(arguments.rounds):
        print(told(row), flush=True)
        rows.append(row)
    command = " ".join(["python -m bench.portable", *sys.argv[1:]])
    write_table(RESULTS / "portable_works.csv", rows, command)
    write_page(RESULTS, "portable", ["works"])


if __name__ == "__main__":
    main()
