"""Rooms that stay open for viewers inside, and what that costs.

    python -m bench.indoors

Buildings and a level with the defaults and with ``viewers="inside"``: how much of what would be
inside stays open, and recall, overhang and seconds of both.
"""

from __future__ import annotations

import time

import simplifier
from bench.meshes import ASSETS

MESHES = (
    ("building_fzk_haus.glb", "z"),
    ("building_duplex.glb", "z"),
    ("sponza_dabrovic.glb", "y"),
    ("level_dungeon.ply", "z"),
)


def main() -> None:
    """Print a line a mesh and kind of viewers."""
    for name, up in MESHES:
        mesh = simplifier.load(ASSETS / name)
        for viewers in ("all", "inside"):
            simplifier.simplify(mesh, up=up, viewers=viewers)  # kernels warm
            begin = time.perf_counter()
            made = simplifier.simplify(mesh, up=up, viewers=viewers)
            seconds = time.perf_counter() - begin
            solid, found = made.made.solid, made.measure()
            share = solid.opened / (solid.filled.count + solid.opened)
            print(
                f"{name:24} {viewers:6} open {share:6.1%}  recall {found.accuracies[0].recall:.1%}"
                f"  overhang {found.overhangs[0].mean:.2%}  {seconds:.1f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
