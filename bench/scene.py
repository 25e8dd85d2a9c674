"""What the scene's own facts cost: ``python -m bench.scene``.

Recall and precision by option on a smooth solid and two statues, and the time of the steps that
decide what is inside, beside scipy's distance transform.  ``docs/decisions/0005`` cites both.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any
from unittest.mock import patch

import numpy as np
from scipy import ndimage

import simplifier
from bench.meshes import STAND_INS, bumpy_sphere, load_stand_in
from simplifier.geometry.mesh import TriangleMesh
from simplifier.kernels.morphology import squared_distances
from simplifier.options.stages import make_options
from simplifier.pipeline import simplify_mesh
from simplifier.voxel.core import core
from simplifier.voxel.fill import close_holes, fill
from simplifier.voxel.voxelize import voxelize

_STATUES = ("bunny_4968", "buddha_113k")
_HOLE, _SHRINK = 4.0, 4.0  # voxels
_NOWHERE = np.zeros(3)

VARIANTS: dict[str, dict[str, Any]] = {
    "balanced": {},
    "balanced, cut as it is": {"moves": 0},
    "conservative": {"conservative": True},
    "conservative, cut as it is": {"conservative": True, "moves": 0},
    "conservative, exact outlines": {"conservative": True, "tolerance": 0.0},
    "conservative, 128 voxels": {"conservative": True, "resolution": 128},
    "shrink by a fiftieth": {"shrink": 0.02},
}


def main(resolutions: tuple[int, ...] = (64, 128, 256)) -> None:
    """Print both tables as Markdown."""
    statues = [
        item
        for item in STAND_INS
        if item.name in ("bunny_4968", "buddha_113k") and not item.missing
    ]
    meshes = {"bumpy sphere": (bumpy_sphere(4000), {"budget": 48})}
    meshes |= {item.name: (load_stand_in(item), item.options) for item in statues}
    print("| variant | " + " | ".join(meshes) + " |")
    print("|---" * (len(meshes) + 1) + "|")
    for name, changes in VARIANTS.items():
        cells = [_cell(mesh, {**typed, **changes}) for mesh, typed in meshes.values()]
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)
    print("\n| voxels a side | distances | scipy's | smallest hole | core, shrunk |")
    print("|---|---|---|---|---|")
    for resolution in resolutions:
        print(f"| {resolution} | " + " | ".join(_times(resolution)) + " |", flush=True)


def _cell(mesh: TriangleMesh, changes: dict[str, Any]) -> str:
    longest = float(mesh.extent.max())
    typed = {key: value for key, value in changes.items() if key != "tolerance"}
    if "shrink" in typed:
        typed["shrink"] *= longest
    with patch("simplifier.steps.cut.TOLERANCE_VOXELS", changes.get("tolerance", 1.0)):
        occluder = simplify_mesh(mesh, make_options(longest, **typed)).occluder
    report = simplifier.evaluate(mesh, occluder, exact=True).accuracy
    return f"{report.recall:.1%} at {report.precision:.2%}"


def _times(resolution: int) -> list[str]:
    """The best of three."""
    touched = voxelize(bumpy_sphere(4000), resolution)
    filled = fill(touched)
    steps: list[Callable[[], object]] = [
        lambda: squared_distances(touched.inside, 1),
        lambda: ndimage.distance_transform_edt(~touched.inside),
        lambda: close_holes(touched, _HOLE),
        lambda: core(touched, filled, _SHRINK, _NOWHERE, frozenset()),
    ]
    return [f"{1000.0 * min(_seconds(step) for _ in range(3)):,.0f} ms" for step in steps]


def _seconds(step: Callable[[], object]) -> float:
    begin = time.perf_counter()
    step()
    return time.perf_counter() - begin


if __name__ == "__main__":
    argparse.ArgumentParser(prog="python -m bench.scene", description=__doc__).parse_args()
    main()
