"""Rooms that stay open for viewers inside, and what that costs.

    python -m bench.indoors

Buildings and a level with the defaults and with ``viewers="inside"``: how much of what would be
inside stays open, which share of the occluder's area stands in those rooms, more than two voxels
from the surface, and recall, overhang and seconds of both.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from scipy import ndimage

import simplifier
from bench.meshes import ASSETS
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.solid import BoolArray, VoxelGrid

MESHES = (
    ("building_fzk_haus.glb", "z"),
    ("building_duplex.glb", "z"),
    ("sponza_dabrovic.glb", "y"),
    ("level_dungeon.ply", "z"),
)
_POINTS = 3000  # of each triangle
_AWAY = 2.0  # voxels


def main() -> None:
    """Print a line a mesh and kind of viewers."""
    argparse.ArgumentParser(prog="python -m bench.indoors", description=__doc__).parse_args()
    for name, up in MESHES:
        mesh = simplifier.load(ASSETS / name)
        made, seconds = {}, {}
        for viewers in ("all", "inside"):
            simplifier.simplify(mesh, up=up, viewers=viewers)  # kernels warm
            begin = time.perf_counter()
            made[viewers] = simplifier.simplify(mesh, up=up, viewers=viewers)
            seconds[viewers] = time.perf_counter() - begin
        solid, filled = made["inside"].made.solid, made["all"].made.solid.filled
        away = ndimage.distance_transform_edt(~solid.touched.inside) > _AWAY
        rooms = filled.inside & ~solid.filled.inside & away
        opened = solid.opened / (solid.filled.count + solid.opened)
        print(f"{name}: {opened:.1%} of the solid stays open")
        for viewers, one in made.items():
            found = one.measure()
            print(
                f"  viewers {viewers:7} in rooms {_share_within(one.occluder, rooms, filled):6.2%}"
                f"  recall {found.accuracies[0].recall:.1%}"
                f"  overhang {found.overhangs[0].mean:.2%}  {seconds[viewers]:.1f} s",
                flush=True,
            )


def _share_within(occluder: Occluder, rooms: BoolArray, grid: VoxelGrid) -> float:
    """Share of the occluder's area in the voxels ``rooms``, by random points."""
    triangles = grid.to_grid(occluder.vertices)[occluder.faces]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    weights = np.random.default_rng(0).dirichlet(np.ones(3), _POINTS)
    voxels = np.floor(np.einsum("kc,mcd->mkd", weights, triangles)).astype(np.int64)
    inside = ((voxels >= 0) & (voxels < rooms.shape)).all(axis=2)
    within = np.zeros(inside.shape, dtype=np.bool_)
    within[inside] = rooms[tuple(voxels[inside].T)]
    return float(within.mean(axis=1) @ areas / areas.sum())


if __name__ == "__main__":
    main()
