"""What the choice under a budget gains from each of its parts: ``python -m bench.choices``.

One row a variant, the paper's three statues as columns: recall, the share of the original's
occlusion measure, and the time of the cut.  ``docs/decisions/0002-choice-under-a-budget.md`` draws
its conclusions from this table.
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from unittest.mock import patch

import simplifier
from bench.meshes import STAND_INS, load_stand_in
from simplifier.evaluation.occlusion import occlusion_measures
from simplifier.geometry.mesh import TriangleMesh
from simplifier.options import Options, SectionOptions, make_options
from simplifier.pipeline import simplify_mesh
from simplifier.selection import exchange

VARIANTS: dict[str, dict[str, object]] = {
    "as shipped": {},
    "published: greedy, trim by area": {"selection": {"trim": "area"}},
    "no exchange": {"_EXCHANGES": 0},
    "50 exchanges": {"_EXCHANGES": 50},
    "200 exchanges": {"_EXCHANGES": 200},
    "one search, gain a triangle": {"_POWERS": (1.0,)},
    "one search, cost to the 0.5": {"_POWERS": (0.5,)},
    "24 views": {"selection": {"views": 24}},
    "96 views": {"selection": {"views": 96}},
    "32 directions, 8 depths": {"sections": {"directions": 32, "depths": 8}},
    "64 directions, 8 depths": {"sections": {"directions": 64, "depths": 8}},
    "128 directions, 2 depths": {"sections": {"directions": 128, "depths": 2}},
    "256 directions, 4 depths": {"sections": {"directions": 256, "depths": 4}},
}


def main() -> None:
    """Print the table as Markdown."""
    statues = [stand_in for stand_in in STAND_INS if stand_in.figure is not None]
    meshes = [(stand_in, load_stand_in(stand_in)) for stand_in in statues]
    print("| variant | " + " | ".join(item.name for item, _ in meshes) + " |")
    print("|---" * (len(meshes) + 1) + "|")
    for name, changes in VARIANTS.items():
        cells = []
        for stand_in, mesh in meshes:
            options = make_options(
                float(mesh.extent.max()), budget=stand_in.budget, up=stand_in.up,
                ground=stand_in.ground,
            )  # fmt: skip
            cells.append(_cell(mesh, options, changes))
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


def _cell(mesh: TriangleMesh, options: Options, changes: dict[str, object]) -> str:
    with ExitStack() as stack:
        for constant, value in changes.items():
            if constant.startswith("_"):
                stack.enter_context(patch.object(exchange, constant, value))
        sections = replace(SectionOptions(), **changes.get("sections", {}))  # type: ignore[arg-type]
        selection = replace(options.selection, **changes.get("selection", {}))  # type: ignore[arg-type]
        varied = replace(options, sections=sections, selection=selection)
        simplify_mesh(mesh, varied)
        occluder = simplify_mesh(mesh, varied).occluder
    report = simplifier.evaluate(mesh, occluder, exact=True)
    ratio = occlusion_measures(mesh, occluder).ratio
    seconds = occluder.timings["cut"]
    return f"{report.recall:.1%}, M {ratio:.1%}, {1000.0 * seconds:.0f} ms"


if __name__ == "__main__":
    main()
