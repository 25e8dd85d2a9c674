"""What an earlier report judged: the mesh, the occluder, and the views that it looked along."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from simplifier.checks import check_kind
from simplifier.errors import OptionError
from simplifier.geometry.mesh import A_MESH, FloatArray, TriangleMesh
from simplifier.geometry.occluder import Occluder


def check_judged(mesh: TriangleMesh, occluder: Occluder, report: Mapping[str, Any]) -> None:
    """Raises :class:`~simplifier.errors.OptionError` for what is no such thing."""
    check_kind("mesh", mesh, TriangleMesh, A_MESH)
    check_kind("occluder", occluder, Occluder, "what simplifier.load_occluder returns")
    check_kind("report", report, dict, "what simplifier.evaluate(...).report() returns")
    if not report.get("by_view"):
        raise OptionError("it has no views", where="report", remedy="choose an accuracy report")


def directions_of(report: Mapping[str, Any]) -> FloatArray:
    """(V, 3) unit vectors along which it looked."""
    return np.array([view["direction"] for view in report["by_view"]], dtype=np.float64)
