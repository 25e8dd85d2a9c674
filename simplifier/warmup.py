"""Run everything once on a small mesh, so that every kernel is compiled and cached."""

from __future__ import annotations

import tempfile
from itertools import product
from pathlib import Path
from typing import cast, get_args

import numpy as np

from simplifier.evaluation.accuracy import AccuracyOptions, evaluate_accuracy
from simplifier.evaluation.report import build_report
from simplifier.geometry.mesh import TriangleMesh
from simplifier.io import load_occluder, save_occluder
from simplifier.options import Trim, make_options
from simplifier.pipeline import simplify_mesh


def warm_up() -> None:
    """Fill the cache; a later process of the same user on the same processor compiles nothing."""
    mesh = _nested_boxes()
    for trim, exact in product(get_args(Trim), (False, True)):
        options = make_options(1.0, budget=8, resolution=16, trim=cast(Trim, trim))
        result = simplify_mesh(mesh, options)
        accuracy = evaluate_accuracy(
            mesh, result.occluder, AccuracyOptions(views=4, image=32, quads=64, exact=exact)
        )
        build_report(mesh, result.occluder, result.solid, accuracy, options={}, timings={})
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "occluder.glb"
        save_occluder(result.occluder, path)
        load_occluder(path)


def _nested_boxes() -> TriangleMesh:
    """An open box around a box: its sections have holes, so bridging is compiled too."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    quads = np.array(
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    )
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    outer, inner = faces[(faces != 7).all(axis=1)], faces + 8
    return TriangleMesh.from_soup(
        np.concatenate([corners, 0.4 * corners]), np.concatenate([outer, inner])
    )
