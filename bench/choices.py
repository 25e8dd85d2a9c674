"""What each part of the search gives: ``python -m bench.choices``.

One row a variant, the paper's three statues as columns: recall at precision, the share of the
original's occlusion measure, and the time from mesh to occluder.  The notes in ``docs/decisions``
draw their conclusions from this table.
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import simplifier
from bench.meshes import STAND_INS, load_stand_in
from simplifier.evaluation.occlusion import occlusion_measures
from simplifier.geometry.mesh import TriangleMesh
from simplifier.options import Options, RefineOptions, make_options
from simplifier.pipeline import simplify_mesh
from simplifier.selection import exchange
from simplifier.selection import refine as refinement

CUT_ONLY = {"preset": "best", "moves": 0}

VARIANTS: dict[str, dict[str, Any]] = {
    "cut as published: greedy, trim by area": {**CUT_ONLY, "trim": "area"},
    "cut by gain, 8 exchanges (best)": CUT_ONLY,
    "cut, no exchange": {**CUT_ONLY, "selection": {"exchanges": 0}},
    "cut, 50 exchanges": {**CUT_ONLY, "selection": {"exchanges": 50}},
    "cut, gain a triangle only": {**CUT_ONLY, "_POWERS": (1.0,)},
    "cut, cost to the power 0.5": {**CUT_ONLY, "_POWERS": (0.5,)},
    "cut, 24 views": {**CUT_ONLY, "selection": {"views": 24}},
    "cut, 96 views": {**CUT_ONLY, "selection": {"views": 96}},
    "cut, 32 directions, 8 depths": {**CUT_ONLY, "sections": {"directions": 32, "depths": 8}},
    "cut, 64 directions, 8 depths": {**CUT_ONLY, "sections": {"directions": 64, "depths": 8}},
    "cut, 256 directions, 4 depths": {**CUT_ONLY, "sections": {"directions": 256, "depths": 4}},
    "refined, draft": {"preset": "draft"},
    "refined, balanced": {},
    "refined, start of best": {"preset": "best", "moves": 12_000},
    "refined, one search": {"refine": {"searches": 1}},
    "refined, four searches": {"refine": {"searches": 4}},
    "refined, 32 views": {"refine": {"views": 32}},
    "refined, 128 views": {"refine": {"views": 128}},
    "refined, overcover 4": {"refine": {"overcover": 4.0}},
    "refined, overcover 8": {"refine": {"overcover": 8.0}},
    "refined, overcover 20": {"refine": {"overcover": 20.0}},
    "refined, hill climbing": {"_HEATS": (1e-12, 1e-12)},
    "refined, four times as hot": {"_HEATS": (2e-3, 4e-5)},
    "refined, best": {"preset": "best"},
}


def main() -> None:
    """Print the table as Markdown."""
    statues = [stand_in for stand_in in STAND_INS if stand_in.figure is not None]
    meshes = [(stand_in, load_stand_in(stand_in)) for stand_in in statues]
    print("| variant | " + " | ".join(item.name for item, _ in meshes) + " |")
    print("|---" * (len(meshes) + 1) + "|")
    for name, changes in VARIANTS.items():
        cells = [_cell(mesh, stand_in.options, changes) for stand_in, mesh in meshes]
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


def _cell(mesh: TriangleMesh, typed: dict[str, Any], changes: dict[str, Any]) -> str:
    with ExitStack() as stack:
        for constant in ("_POWERS", "_HEATS"):
            if constant in changes:
                module = exchange if constant == "_POWERS" else refinement
                stack.enter_context(patch.object(module, constant, changes[constant]))
        varied = _options(mesh, typed, changes)
        simplify_mesh(mesh, varied)
        occluder = simplify_mesh(mesh, varied).occluder
    report = simplifier.evaluate(mesh, occluder, exact=True)
    ratio = occlusion_measures(mesh, occluder).ratio
    seconds = sum(occluder.timings.values())
    return f"{report.recall:.1%} at {report.precision:.2%}, M {ratio:.1%}, {seconds:.2f} s"


def _options(mesh: TriangleMesh, typed: dict[str, Any], changes: dict[str, Any]) -> Options:
    named = {key: changes[key] for key in ("preset", "moves", "trim") if key in changes}
    options = make_options(float(mesh.extent.max()), **typed, **named)
    refine: RefineOptions = replace(options.refine, **changes.get("refine", {}))
    return replace(
        options,
        sections=replace(options.sections, **changes.get("sections", {})),
        selection=replace(options.selection, **changes.get("selection", {})),
        refine=refine,
    )


if __name__ == "__main__":
    main()
