"""The same mesh moved, scaled, turned and rewritten: ``python -m bench.stability.transforms``.

Every row is one mesh in one guise, made and judged like the undisturbed one, which comes first with
other seeds beside it: what they differ by is what chance alone does.  Writes
``bench/results/stability_transforms.csv`` and prints the table as Markdown.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import simplifier
from bench.machine import ROOT
from bench.meshes import ASSETS
from bench.record import Row, markdown, read_table, told, write_table
from simplifier.accuracy.deviation import deviation
from simplifier.accuracy.occlusion import occlusion_measures
from simplifier.geometry.mesh import TriangleMesh
from simplifier.options.simplify import Axis
from simplifier.options.stages import ERROR_VOXELS, make_options
from simplifier.pipeline import Simplification, simplify_mesh
from tests.extremes.transforms import (
    OFFSETS,
    POWERS,
    REWRITINGS,
    SCALED_AWAY,
    SCALES,
    TILTS,
    Placement,
    Rewriting,
    turns,
)

_RESOLUTION = 64
_SEEDS = 5


@dataclass(frozen=True)
class Subject:
    """A mesh and how it stands; ``closed`` ones may be tilted."""

    file: str
    budget: int
    up: Axis = "y"
    closed: bool = False

    @property
    def options(self) -> dict[str, Any]:
        """Keyword arguments of :func:`simplifier.simplify`."""
        return {"budget": self.budget, "up": self.up, "ground": not self.closed}

    @property
    def guises(self) -> tuple[Placement | Rewriting, ...]:
        turned = turns(self.up) + (TILTS if self.closed else ())
        return (*POWERS[1::2], *SCALES, *OFFSETS, *SCALED_AWAY, *turned, *REWRITINGS)


SUBJECTS = (
    Subject("bunny_4968.ply", 53),
    Subject("broken_lyon_palais_de_justice.ply", 64, "z"),
    Subject("terrain_jacksboro_60160.ply", 256, "z"),
    Subject("dragon_871k.ply", 36, closed=True),
)


@dataclass(frozen=True, eq=False)
class Judge:
    """Makes and judges one subject; ``longest`` edge of the undisturbed mesh."""

    subject: Subject
    mesh: TriangleMesh
    views: int
    longest: float = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "longest", float(self.mesh.extent.max()))

    def rows(self) -> Iterator[Row]:
        """The undisturbed mesh, other seeds, all guises."""
        first = self._made(self.mesh, _RESOLUTION)
        yield self._row("undisturbed", "", self.mesh, first)
        for seed in range(1, _SEEDS):
            made = self._made(self.mesh, _RESOLUTION, seed)
            yield self._row(f"seed {seed}", "", self.mesh, made)
        for guise in self.subject.guises:
            mesh = guise.of(self.mesh)
            placement = guise if isinstance(guise, Placement) else Placement("here")
            made = self._made(mesh, self._resolution(mesh, placement))
            alike = _likeness(first, made, placement, self.longest)
            yield self._row(guise.name, alike, mesh, made, placement.scale)

    def _resolution(self, mesh: TriangleMesh, placement: Placement) -> int:
        """That keeps the voxel: a turned mesh has another bounding box."""
        return round(_RESOLUTION * float(mesh.extent.max()) / (self.longest * placement.scale))

    def _made(self, mesh: TriangleMesh, resolution: int, seed: int = 0) -> Simplification:
        chosen = {**self.subject.options, "resolution": resolution, "seed": seed}
        return simplify_mesh(mesh, make_options(float(mesh.extent.max()), **chosen))

    def _row(
        self, case: str, alike: str, mesh: TriangleMesh, made: Simplification, scale: float = 1.0
    ) -> Row:
        """Lengths are in voxels of the undisturbed mesh."""
        report = simplifier.evaluate(mesh, made.occluder, views=self.views, exact=True).accuracy
        strays = deviation(made.occluder, mesh, made.solid.interior)
        voxel = self.longest * scale / _RESOLUTION
        return {
            "mesh": Path(self.subject.file).stem, "case": case, "occluder": alike,
            "triangles": len(made.occluder.faces), "recall %": f"{100.0 * report.recall:.2f}",
            "precision %": f"{100.0 * report.precision:.3f}",
            "measure %": f"{100.0 * occlusion_measures(mesh, made.occluder).ratio:.2f}",
            "deviation": f"{strays / voxel:.3f}",
            "error bound": f"{made.occluder.error_bound / voxel:.6f}",
        }  # fmt: skip


def _likeness(
    here: Simplification, there: Simplification, placement: Placement, longest: float
) -> str:
    """How the occluder of a guise relates to that of the undisturbed mesh."""
    one, other = here.occluder, there.occluder
    if not np.array_equal(one.faces, other.faces):
        return "another"
    expected = placement.place(one.vertices, longest)
    if np.array_equal(expected, other.vertices):
        return "the same bits"
    off = float(np.abs(expected - other.vertices).max()) / (longest * placement.scale)
    return f"the same to {off:.0e} of the longest edge" if off < 1e-3 else "another"


def main(arguments: Sequence[str] | None = None) -> None:
    """Parse the command line, measure, write and print."""
    parser = argparse.ArgumentParser(prog="python -m bench.stability.transforms")
    parser.add_argument("--only", nargs="+", metavar="FILE", help="meshes, all by default")
    parser.add_argument("--views", type=int, default=64, help="that accuracy is measured from")
    parser.add_argument("--out", type=Path, default=ROOT / "bench" / "results")
    given = parser.parse_args(arguments)
    rows: list[Row] = []
    path = given.out / "stability_transforms.csv"
    for subject in SUBJECTS:
        source = ASSETS / subject.file
        if source.exists() and (given.only is None or subject.file in given.only):
            for row in Judge(subject, simplifier.load(source), given.views).rows():
                print(told(row), flush=True)
                rows.append(row)
            remark = (
                f"lengths in voxels of the undisturbed mesh, {ERROR_VOXELS:.4f} are promised; "
                "turned meshes have voxels of that size as near as whole numbers allow"
            )
            write_table(path, rows, "python -m bench.stability.transforms", remark)
    if rows:
        print(markdown(read_table(path)))


if __name__ == "__main__":
    main()
