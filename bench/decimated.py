"""Decimated starts beside sections: ``python -m bench.decimated [MESH ...]``.

Two tables as Markdown, of the stand-ins or of the named assets, recall at precision from 128 views
with all quads counted.

    decimators  both surfaces in 64 triangles by the decimator here, which needs no dependency, and
                by two libraries: triangles reached, milliseconds
    starts      sections (of the balanced preset), the enclosed and the sheet start at 16, 64 and
                256 triangles, as they are and refined with 8,000 and 30,000 moves
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import simplifier
from bench.meshes import STAND_INS, readable_assets
from bench.peers import PEERS, missing
from simplifier.geometry.mesh import FloatArray, IntArray, TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.room import WHOLE, Room
from simplifier.geometry.solid import Solid
from simplifier.options.stages import RefineOptions, make_options
from simplifier.pipeline import cut_solid
from simplifier.progress import Deadline, Stopwatch
from simplifier.refinement.annealing import RefineViews, by_looks
from simplifier.refinement.decimate import decimate_into, decimated
from simplifier.refinement.search import refine
from simplifier.refinement.starts import (
    cluster_vertices,
    enclosed_start,
    inner_surface,
)
from simplifier.selection.measure import search_projections, silhouettes
from simplifier.steps.solid import solidify
from simplifier.voxel.room import coarse_room

BUDGETS = (16, 64, 256)
MOVES = (8_000, 30_000)

Surface = tuple[FloatArray, IntArray]


@dataclass(frozen=True, eq=False)
class Scene:
    """A mesh, its solid, and the voxels that occluders keep to."""

    name: str
    mesh: TriangleMesh
    solid: Solid
    room: Room

    @classmethod
    def load(cls, path: Path, typed: dict[str, object]) -> Scene:
        mesh = simplifier.load(path)
        options = make_options(float(mesh.extent.max()), **typed)  # type: ignore[arg-type]
        solid = solidify(mesh, options.solid, Stopwatch())
        return cls(path.stem, mesh, solid, coarse_room(solid.core, solid.reach))

    def judged(self, surface: Surface) -> str:
        """Recall, precision and triangles."""
        vertices, faces = surface
        occluder = Occluder(self.solid.filled.to_world(vertices), faces.copy())
        report = simplifier.evaluate(self.mesh, occluder, views=128, exact=True).accuracy
        return f"{report.recall:.1%} at {report.precision:.2%} ({len(faces)})"

    def refined(self, surface: Surface, moves: int) -> Surface:
        seen_from = search_projections(self.solid, make_options(1.0), 64, self.room.margin)
        projections = by_looks(seen_from)
        points = self.solid.filled.to_grid(self.mesh.vertices) + self.room.margin
        seen = RefineViews(projections, silhouettes(points, self.mesh.faces, projections))
        start = surface[0][surface[1]] + self.room.margin
        found = refine([start], self.room, seen, len(start), RefineOptions(moves, overhang=1.0), 0)
        return _surface(found[0] - self.room.margin)

    def enclosed(self, budget: int) -> Surface:
        return enclosed_start(self.room, budget)

    def sheet(self, budget: int) -> Surface:
        return decimate_into(*cluster_vertices(self.mesh, self.solid.filled), self.room, budget)

    def sections(self, budget: int) -> Surface:
        options = make_options(1.0, budget=budget)
        found = cut_solid(self.mesh, self.solid, options, Stopwatch(), Deadline.after(None))
        return _surface(found)


def _surface(triangles: FloatArray) -> Surface:
    return triangles.reshape(-1, 3), np.arange(3 * len(triangles), dtype=np.int32).reshape(-1, 3)


def decimators(scenes: Sequence[Scene]) -> None:
    """Print the first table."""
    names = [name for name in PEERS if name.startswith(("fast", "meshopt")) and not missing(name)]
    print("| mesh | surface | triangles | here | " + " | ".join(names) + " |")
    print("|---" * (len(names) + 4) + "|")
    for scene in scenes:
        surfaces = {
            "enclosed": inner_surface(WHOLE * scene.solid.filled.inside.astype(np.uint8)),
            "sheet": cluster_vertices(scene.mesh, scene.solid.filled),
        }
        for kind, surface in surfaces.items():
            makers = [partial(_here, scene), *(partial(_library, name) for name in names)]
            cells = [_timed(scene, surface, make) for make in makers]
            row = [scene.name, kind, str(len(surface[1])), *cells]
            print("| " + " | ".join(row) + " |", flush=True)


def _here(scene: Scene, points: FloatArray, faces: NDArray[np.int64]) -> Surface:
    moved, corners = decimated(points, faces.astype(np.int32), scene.room, 64)
    return moved - scene.room.margin, corners


def _library(name: str, points: FloatArray, faces: NDArray[np.int64]) -> Surface:
    made = PEERS[name](points, faces, 64)
    return np.asarray(made[0], dtype=np.float64), np.asarray(made[1], dtype=np.int32)


def _timed(scene: Scene, surface: Surface, make: Callable[..., Surface]) -> str:
    if len(surface[1]) == 0:
        return "no surface"
    begin = time.perf_counter()
    made = make(surface[0].copy(), surface[1].astype(np.int64))
    took = 1e3 * (time.perf_counter() - begin)
    return f"{scene.judged(made)}, {took:.0f} ms"


def starts(scenes: Sequence[Scene]) -> None:
    """Print the second table."""
    print("| mesh | budget | start | ms | as it is | " + " | ".join(f"{m} moves" for m in MOVES))
    print("|---" * (len(MOVES) + 5) + "|")
    for scene in scenes:
        kinds = {"sections": scene.sections, "enclosed": scene.enclosed, "sheet": scene.sheet}
        for budget in BUDGETS:
            for kind, start in kinds.items():
                begin = time.perf_counter()
                surface = start(budget)
                took = 1e3 * (time.perf_counter() - begin)
                cells = [scene.judged(scene.refined(surface, moves)) for moves in MOVES]
                row = [scene.name, str(budget), kind, f"{took:.0f}", scene.judged(surface), *cells]
                print("| " + " | ".join(row) + " |", flush=True)


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(prog="python -m bench.decimated", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("mesh", nargs="*", help="names of assets (the stand-ins)")
    names = parser.parse_args().mesh or [item.path.stem for item in STAND_INS]
    scenes = [Scene.load(path, typed) for path, typed in readable_assets() if path.stem in names]
    decimators(scenes)
    starts(scenes)


if __name__ == "__main__":
    main()
