"""One mesh by every method: this library, as shipped and in parts, and its peers."""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import simplifier
from bench.failure import PeerFailedError
from bench.peers import PEERS, missing, occluder_from, prepared, simplified
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder

OURS = "planar-occluder"

_VARIANTS: dict[str, dict[str, Any]] = {
    OURS: {},
    f"{OURS} draft": {"preset": "draft"},
    f"{OURS} best": {"preset": "best"},
    f"{OURS} best, not refined": {"preset": "best", "moves": 0},
    "paper's cut and trim by area": {"preset": "best", "moves": 0, "trim": "area"},
}
"""What is changed of the default options; the last is the method as published."""


@dataclass(frozen=True, eq=False)
class Result:
    """What a method made of a mesh and in how many seconds, or why it was skipped."""

    method: str
    occluder: Occluder | None = None
    seconds: float = 0.0
    reason: str = ""


def results(mesh: TriangleMesh, options: dict[str, Any]) -> Iterator[Result]:
    """All methods; ``options`` as :func:`simplifier.simplify` takes them, with a budget."""
    for method, changes in _VARIANTS.items():
        repeats = 3 if method == OURS else 1
        yield Result(method, *timed(mesh, {**options, **changes}, repeats))
    yield from peer_results(mesh, prepared(mesh), options["budget"])


def peer_results(
    mesh: TriangleMesh, ready: TriangleMesh, budget: int, names: Iterable[str] = PEERS
) -> Iterator[Result]:
    """The peers of those names on a mesh and its :func:`~bench.peers.prepared` form."""
    for name in names:
        if missing(name):
            yield Result(name, reason=missing(name))
            continue
        begin = time.perf_counter()
        try:
            made = simplified(PEERS[name], ready, budget)
        except PeerFailedError as error:
            yield Result(name, reason=str(error))
            continue
        seconds = time.perf_counter() - begin
        yield Result(name, occluder_from(made, mesh), seconds)


def timed(mesh: TriangleMesh, options: dict[str, Any], repeats: int) -> tuple[Occluder, float]:
    """Our occluder and the median of the seconds that it took."""
    seconds = []
    for _ in range(repeats):
        begin = time.perf_counter()
        occluder = simplifier.simplify(mesh, **options).occluder
        seconds.append(time.perf_counter() - begin)
    return occluder, statistics.median(seconds)
