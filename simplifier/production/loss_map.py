"""The loss map of what was judged, as a file that a 3D view paints a mesh with."""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from simplifier.accuracy.loss import LossMap, measure_loss
from simplifier.checks import as_path
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.io.files import write_whole
from simplifier.production.judged import check_judged, directions_of

SCHEMA_VERSION = 1

_TRUST = 16  # of 255, that a pixel adds to what is thought of a cell


def save_loss_map(
    path: str | Path, mesh: TriangleMesh, occluder: Occluder, report: Mapping[str, Any]
) -> None:
    """Write where recall is lost over the views of a report, as JSON of some 30 kB.

    ``mesh``, ``occluder``  those that the report is about, of levels of detail the finest one.
    ``report``  as ``docs/report.schema.json`` says.

    The keys: ``cells`` along each side of the cube around the sphere of ``centre`` and ``radius``,
    in world units; ``views`` that were looked from; ``share`` of all that they see which is not
    covered, 0 to 1; and ``data``, two bytes a cell, x fastest and z slowest, packed by zlib and
    written in base64: the cell's loss, 255 for all of it, and how much it is to be trusted, 0 where
    no view sees the mesh.

    Raises :class:`~simplifier.errors.OutputError`, and :class:`~simplifier.errors.OptionError` for
    what is no such argument.
    """
    place = as_path("path", path)
    check_judged(mesh, occluder, report)
    directions = directions_of(report)
    found = measure_loss(mesh, occluder, directions)
    document = {
        "schema_version": SCHEMA_VERSION,
        "cells": len(found.seen),
        "centre": found.sphere.centre.tolist(),
        "radius": found.sphere.radius,
        "views": len(directions),
        "share": found.share,
        "data": _packed(found),
    }
    write_whole(place, json.dumps(document, allow_nan=False).encode())


def _packed(found: LossMap) -> str:
    cells = np.empty((*found.seen.shape, 2), dtype=np.uint8)
    cells[..., 0] = np.rint(255.0 * np.nan_to_num(found.shares))
    cells[..., 1] = np.minimum(_TRUST * found.seen, 255)
    raw = np.ascontiguousarray(cells.transpose(2, 1, 0, 3)).tobytes()
    return base64.b64encode(zlib.compress(raw, 9)).decode("ascii")
