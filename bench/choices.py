"""What each part of the search gives: ``python -m bench.choices [WORD ...]``.

One row a variant, the stand-ins as columns: recall at precision, the share of the
original's occlusion measure, and the time from mesh to occluder.  The notes in ``docs/decisions``
draw their conclusions from this table.
"""

from __future__ import annotations

import argparse
from contextlib import ExitStack
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import simplifier
from bench.meshes import STAND_INS, load_stand_in
from simplifier.accuracy.occlusion import occlusion_measures
from simplifier.geometry.mesh import TriangleMesh
from simplifier.options.stages import Options, RefineOptions, make_options
from simplifier.pipeline import simplify_mesh
from simplifier.refinement import annealing, search
from simplifier.selection import exchange
from simplifier.warmup import warm_up

CUT_ONLY = {"preset": "best", "moves": 0}

CONSTANTS = {
    "_POWERS": exchange, "TOGETHER": search, "_LAST_HEAT": annealing, "_STEPS": annealing,
}  # fmt: skip

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
    "refined, best": {"preset": "best"},
    "balanced, start of best": {"sections": {"directions": 128}, "selection": {"exchanges": 8}},
    "balanced, one search": {"refine": {"searches": 1}},
    "balanced, four searches": {"refine": {"searches": 4}},
    "balanced, 32 views": {"refine": {"views": 32}},
    "balanced, 64 views": {"refine": {"views": 64}},
    "balanced, 256 views": {"refine": {"views": 256}},
    "balanced, half the moves": {"refine": {"moves": 11_400}},
    "balanced, four times the moves": {"refine": {"moves": 91_200}},
    "balanced, overcover 0.25": {"refine": {"overcover": 0.25}},
    "balanced, overcover 1": {"refine": {"overcover": 1.0}},
    "balanced, overcover 2": {"refine": {"overcover": 2.0}},
    "balanced, no aim for the precision": {"refine": {"precision": 0.0}},
    "balanced, hill climbing": {"TOGETHER": 1e-12, "_LAST_HEAT": 1e-12},
    "balanced, four times as hot": {
        "TOGETHER": 4.0 * annealing.TOGETHER,
        "_LAST_HEAT": 4.0 * annealing._LAST_HEAT,
    },
    "balanced, from sections alone": {"refine": {"decimated": False}},
    "balanced, steps to 0.1 voxels": {"_STEPS": (6.0 / 64.0, 0.1 / 64.0)},
}


def main() -> None:
    """Print the table as Markdown."""
    parser = argparse.ArgumentParser(prog="python -m bench.choices", description=__doc__)
    parser.add_argument("words", nargs="*", help="only variants whose names hold one of these")
    words = parser.parse_args().words
    warm_up()
    meshes = [(stand_in, load_stand_in(stand_in)) for stand_in in STAND_INS if not stand_in.missing]
    print("| variant | " + " | ".join(item.name for item, _ in meshes) + " |")
    print("|---" * (len(meshes) + 1) + "|")
    for name, changes in VARIANTS.items():
        if words and not any(word in name for word in words):
            continue
        cells = [_cell(mesh, stand_in.options, changes) for stand_in, mesh in meshes]
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


def _cell(mesh: TriangleMesh, typed: dict[str, Any], changes: dict[str, Any]) -> str:
    with ExitStack() as stack:
        for constant in CONSTANTS:
            if constant in changes:
                stack.enter_context(patch.object(CONSTANTS[constant], constant, changes[constant]))
        occluder = simplify_mesh(mesh, varied(mesh, typed, changes)).occluder
    report = simplifier.evaluate(mesh, occluder, exact=True).accuracy
    ratio = occlusion_measures(mesh, occluder).ratio
    seconds = sum(occluder.timings.values())
    return f"{report.recall:.1%} at {report.precision:.2%}, M {ratio:.1%}, {seconds:.2f} s"


def varied(mesh: TriangleMesh, typed: dict[str, Any], changes: dict[str, Any]) -> Options:
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
