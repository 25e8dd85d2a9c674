"""The figures of the golden table, as they are now: ``python -m tests.golden.figures``.

Prints ``expected.json`` with today's figures in it, to be looked at before it replaces the file.
"""

from __future__ import annotations

import json
from pathlib import Path

import simplifier
from examples.castle import castle
from simplifier.accuracy.occlusion import occlusion_measures
from simplifier.options.stages import make_options
from simplifier.pipeline import simplify_mesh
from tests.conftest import ASSETS

EXPECTED = Path(__file__).with_name("expected.json")

TABLE = json.loads(EXPECTED.read_text())

DIGITS = 4


def figures(mesh, options):
    """Precision and recall without sampling noise, 1 less overhang, 1 less front, the share of the
    measure."""
    result = simplify_mesh(mesh, make_options(float(mesh.extent.max()), **options))
    found = simplifier.evaluate(mesh, result.occluder, exact=True)
    return {
        "triangles": len(result.occluder.faces),
        "precision": found.precision,
        "recall": found.recall,
        "within": 1.0 - found.overhang.mean,
        "clear": 1.0 - found.front.mean,
        "measure": occlusion_measures(mesh, result.occluder).ratio,
    }


def main():
    for row in TABLE.values():
        mesh = simplifier.load(ASSETS / row["mesh"]) if row["mesh"] else castle()
        found = figures(mesh, row["options"])
        for name, bound in row["figures"].items():
            bound["expected"] = round(found[name], DIGITS)
    print(json.dumps(TABLE, indent=2))


if __name__ == "__main__":
    main()
