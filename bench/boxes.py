"""Boxes around the parts of an approximate convex decomposition (CoACD), as users make occluders.

    python -m bench.boxes MESH.npz BOXES.npz BUDGET

CoACD cuts the mesh into nearly convex parts, with 12 / BUDGET as the concavity allowed, so that it
does not cut far beyond BUDGET / 12 of them, and merges the parts down to that number.  Each is
replaced by its oriented bounding box of least volume, 12 triangles.  The boxes are not shrunk: they
reach past the mesh where a part is no box, as such tools have it.  It runs in a process of its own,
because it may take minutes and much memory, and cannot be stopped from within.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from importlib import import_module
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from bench.failure import PeerFailedError
from bench.machine import ROOT
from simplifier.geometry.mesh import FloatArray

Faces = NDArray[np.int64]

TRIANGLES = 12  # of a box
TIME_LIMIT = 60.0  # seconds
_QUICK = {"mcts_iterations": 60, "mcts_nodes": 10, "resolution": 1000}
"""The least that CoACD's documentation allows; with its defaults the 4,968 triangles of a bunny
take more than two minutes on one core."""


def convex_boxes(
    points: FloatArray, faces: Faces, budget: int, time_limit: float | None = None
) -> tuple[FloatArray, Faces]:
    """At most ``budget // 12`` boxes, the largest where there are more.

    Raises :class:`PeerFailedError` after ``time_limit`` seconds (:data:`TIME_LIMIT`) and when
    CoACD fails on the mesh.
    """
    limit = TIME_LIMIT if time_limit is None else time_limit
    if budget < TRIANGLES:
        return np.empty((0, 3)), np.empty((0, 3), np.int64)
    with tempfile.TemporaryDirectory() as folder:
        mesh, boxes = Path(folder) / "mesh.npz", Path(folder) / "boxes.npz"
        np.savez(mesh, points=points, faces=faces)
        command = [sys.executable, "-m", "bench.boxes", str(mesh), str(boxes), str(budget)]
        try:
            done = subprocess.run(command, cwd=ROOT, timeout=limit, capture_output=True, text=True)
        except subprocess.TimeoutExpired:
            raise PeerFailedError(f"took longer than {limit:g} s") from None
        if done.returncode != 0:
            raise PeerFailedError(f"CoACD ended with status {done.returncode}")
        with np.load(boxes) as made:
            return made["points"], made["faces"]


def boxes_of(parts: list[FloatArray], most: int) -> tuple[FloatArray, Faces]:
    """The oriented bounding boxes of point sets (n, 3), the ``most`` largest, largest first."""
    boxes = [_box(part) for part in parts]
    kept = sorted(boxes, key=lambda box: -float(np.prod(box.extents)))[:most]
    if not kept:
        return np.empty((0, 3)), np.empty((0, 3), np.int64)
    starts = np.cumsum([0, *(len(box.vertices) for box in kept[:-1])])
    return (
        np.concatenate([box.vertices for box in kept]),
        np.concatenate([box.faces + start for box, start in zip(kept, starts, strict=True)]),
    )


def _box(part: FloatArray) -> trimesh.Trimesh:
    try:
        to_origin, extents = trimesh.bounds.oriented_bounds(part)
    except Exception:  # flat or too few points for a hull: qhull has an error of its own for each
        return trimesh.creation.box(bounds=[part.min(axis=0), part.max(axis=0)])
    return trimesh.creation.box(extents=extents, transform=np.linalg.inv(to_origin))


def main() -> None:
    """Decompose in this process."""
    mesh, boxes, budget = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])
    coacd = import_module("coacd")
    coacd.set_log_level("off")
    with np.load(mesh) as read:
        shape = coacd.Mesh(read["points"], read["faces"])
    most = budget // TRIANGLES
    found = coacd.run_coacd(
        shape, threshold=1.0 / most, max_convex_hull=most, merge=True, preprocess_mode="auto",
        seed=0, **_QUICK,
    )  # fmt: skip
    points, faces = boxes_of([np.asarray(part[0], dtype=np.float64) for part in found], most)
    np.savez(boxes, points=points, faces=faces)


if __name__ == "__main__":
    main()
