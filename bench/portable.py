"""What machine code for a kind of processors costs beside code for this very one.

    python -m bench.portable [--rounds 3]

Wheels and images hold kernels for kinds of processors (``kernels/compiled/processors.py``).  Here
they are compiled for this very processor, and for each kind that it is of, into caches of their
own.  Processes that load one take turns with those that load the others, so that a change of the
machine meets all.  ``ratio`` is the median of the time for the kind over that
for this processor, round by round; ``same`` whether the occluders have the same bytes.
``portable_works.csv`` holds the figures, ``portable.md`` shows them.
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
from simplifier.kernels.compiled.processors import Processor, kinds_here

RESULTS = Path("bench/results")
MESHES = ("bunny_4968", "dragon_871k", "terrain")
PRESETS = ("draft", "balanced")
_OWN = "itself"
_REPEATS = 3  # of each work in a process, after one that is not counted


def portable_rows(rounds: int) -> Iterator[Row]:
    """A row a mesh, preset and kind."""
    targets = {_OWN: Processor.own()}
    targets |= {kind.name: kind.processor for kind in kinds_here() if kind.runs_here()}
    with tempfile.TemporaryDirectory() as place:
        variables = {
            name: {**target.variables, "NUMBA_CACHE_DIR": str(Path(place) / name)}
            for name, target in targets.items()
        }
        for one in variables.values():
            _run(one, "-m", "simplifier", "warmup")
        measured: dict[str, list[Mapping[str, Any]]] = {name: [] for name in targets}
        for _ in range(rounds):
            for name, one in variables.items():
                measured[name].append(json.loads(_run(one, "-m", "bench.portable", "--here")))
    own = measured.pop(_OWN)
    for work in own[0]:
        for name, found in measured.items():
            pairs = [(one[work], other[work]) for one, other in zip(found, own, strict=True)]
            ratios = [kind["seconds"] / itself["seconds"] for kind, itself in pairs]
            yield {
                "work": work, "kind": name, "rounds": rounds,
                "itself_s": statistics.median(itself["seconds"] for _, itself in pairs),
                "kind_s": statistics.median(kind["seconds"] for kind, _ in pairs),
                "ratio": statistics.median(ratios), "least": min(ratios), "most": max(ratios),
                "processor_ratio": statistics.median(
                    kind["processor"] / itself["processor"] for kind, itself in pairs
                ),
                "same": len({one["digest"] for pair in pairs for one in pair}) == 1,
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


def _run(variables: Mapping[str, str], *arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, *arguments], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True,
        env={**os.environ, **variables},
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
