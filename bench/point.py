"""One measured point in a process of its own: the times of a piece of work and its peak memory.

``measure`` starts a fresh interpreter (never a fork, so nothing of the caller counts), which makes
the mesh, loads the kernels by the same work on a tiny mesh, and then does it once a repeat.

    seconds        of each repeat
    stages         seconds by stage, the median over the repeats
    work_mib       most memory resident during the work, what was there before included
    before_mib     resident just before it: interpreter, libraries, kernels and mesh
    process_mib    most resident in the life of the process, reading or making the mesh included

Memory is in MiB (2**20 bytes).
"""

from __future__ import annotations

import json
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import simplifier
from bench.machine import ROOT
from bench.meshes import bumpy_sphere, mesh_named
from simplifier.cli.main import app

Stages = Mapping[str, float]


@dataclass(frozen=True)
class Measurement:
    """What a point came to; see the module."""

    triangles: int
    seconds: list[float]
    stages: dict[str, float]
    before_mib: float
    work_mib: float
    process_mib: float

    @property
    def summary(self) -> dict[str, float]:
        """Median, least and most of the times, seconds."""
        seconds = self.seconds
        return {
            "median_s": statistics.median(seconds),
            "min_s": min(seconds),
            "max_s": max(seconds),
        }


def measure(work: str, mesh: str, repeats: int, **options: Any) -> Measurement:
    """Measure ``simplify`` or ``evaluate`` on a named mesh in a fresh process.

    ``options`` go to the function of that name; ``evaluate`` takes those of the occluder's making
    as ``simplify``.  Raises CalledProcessError when the work fails.
    """
    request = {"work": work, "mesh": mesh, "repeats": repeats, "options": options}
    return Measurement(**_answer("point", json.dumps(request)))


def measure_command(*arguments: str) -> tuple[float, float]:
    """Seconds and peak MiB of one ``occluder`` command, all of the process but its start."""
    seconds, mib = _answer("command", *arguments)
    return seconds, mib


def _answer(*arguments: str) -> Any:
    """The last line that a fresh process of this module prints."""
    command = [sys.executable, "-m", "bench.point", *arguments]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def measured_here(work: str, mesh: str, repeats: int, options: dict[str, Any]) -> Measurement:
    """The same in this process, whose memory then counts too."""
    soup = mesh_named(mesh)
    load_kernels()
    job = _JOBS[work](soup, options)
    before, made = resident_mib("VmRSS"), resident_mib("VmHWM")
    forget_peak()
    seconds, stages = [], []
    for _ in range(repeats):
        begin = time.perf_counter()
        stages.append(job())
        seconds.append(time.perf_counter() - begin)
    peak = resident_mib("VmHWM")
    names = dict.fromkeys(name for times in stages for name in times)
    medians = {name: statistics.median(times[name] for times in stages) for name in names}
    return Measurement(len(soup.faces), seconds, medians, before, peak, max(peak, made))


def load_kernels() -> None:
    """Do everything once on a tiny mesh, so that what is timed next loads nothing."""
    tiny = bumpy_sphere(48)
    occluder = simplifier.simplify(tiny, budget=4, resolution=8, preset="draft").occluder
    for exact in (False, True):
        simplifier.evaluate(tiny, occluder, views=2, image=16, quads=8, exact=exact)


def _simplify(soup: simplifier.TriangleMesh, options: dict[str, Any]) -> Callable[[], Stages]:
    return lambda: simplifier.simplify(soup, **options).occluder.timings


def _evaluate(soup: simplifier.TriangleMesh, options: dict[str, Any]) -> Callable[[], Stages]:
    made = options.pop("simplify")
    occluder = simplifier.simplify(soup, **made).occluder

    def job() -> Stages:
        simplifier.evaluate(soup, occluder, **options)
        return {}

    return job


_JOBS = {"simplify": _simplify, "evaluate": _evaluate}


def resident_mib(key: str) -> float:
    """``VmRSS`` now or ``VmHWM`` at most, from Linux; elsewhere the most that getrusage tells.

    Not ru_maxrss on Linux: a started program inherits there the peak of the one that started it.
    """
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20  # bytes on macOS
    kib = next(line.split()[1] for line in lines if line.startswith(f"{key}:"))
    return int(kib) / 2**10


def forget_peak() -> None:
    """Let VmHWM begin again at what is resident; where that is refused it covers the mesh too."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        return


def _command(arguments: list[str]) -> tuple[float, float]:
    begin = time.perf_counter()
    status = app(arguments, standalone_mode=False)
    if status:
        sys.exit(status)
    return time.perf_counter() - begin, resident_mib("VmHWM")


def main() -> None:
    """``python -m bench.point point REQUEST`` or ``... command ARGUMENT...``: answer in JSON."""
    kind, *rest = sys.argv[1:]
    answer = asdict(measured_here(**json.loads(rest[0]))) if kind == "point" else _command(rest)
    print(json.dumps(answer))


if __name__ == "__main__":
    main()
