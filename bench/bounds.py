"""An error bound that is asked for, kept by the room, or by the grid of the sections alone.

    python -m bench.bounds

For each bound, a share of the mesh's longest edge: recall, the bound that the result has, and
seconds, with ``error_share``, and with the resolution at which any occluder keeps that bound.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import simplifier
from bench.meshes import ASSETS
from simplifier.options.stages import ERROR_VOXELS, resolution_for

MESHES: tuple[tuple[str, dict[str, Any]], ...] = (
    ("bunny_4968.ply", {"budget": 64}),
    ("dragon_871k.ply", {"budget": 36}),
    ("building_fzk_haus.glb", {"budget": 64, "up": "z"}),
    ("cad_reciprocating_saw.glb", {"budget": 64}),
)
SHARES = (0.03, 0.02, 0.01)


def main() -> None:
    """Print a line a mesh and bound."""
    argparse.ArgumentParser(prog="python -m bench.bounds", description=__doc__).parse_args()
    for name, options in MESHES:
        mesh = simplifier.load(ASSETS / name)
        for share in SHARES:
            resolution = resolution_for(share, 1.0, voxels=ERROR_VOXELS)
            ways: dict[str, dict[str, Any]] = {
                "room": {"error_share": share},
                f"grid of {resolution}": {"resolution": resolution},
            }
            print(f"{name:26} {share:4.0%}", end="", flush=True)
            for way, chosen in ways.items():
                begin = time.perf_counter()
                made = simplifier.simplify(mesh, **options, **chosen)
                seconds = time.perf_counter() - begin
                recall = made.measure().accuracies[0].recall
                bound = made.occluder.error_bound / float(mesh.extent.max())
                print(f"   {way}: {recall:.1%} at {bound:.2%}, {seconds:.1f} s", end="", flush=True)
            print(flush=True)


if __name__ == "__main__":
    main()
