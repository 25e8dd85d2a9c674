"""The pictures and the page of a report that was written before.

They are those that ``write_pictures`` of a result draws, as far as a file keeps an occluder:
formats round its corners to 32 bits, which moves a pixel at most by chance.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from simplifier.accuracy.accuracy import AccuracyOptions, AccuracyReport
from simplifier.checks import as_path, check_kind
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.production.judged import check_judged, directions_of
from simplifier.report.page import write_pictures
from simplifier.report.report import Report


def draw_report(
    folder: str | Path, mesh: TriangleMesh, occluder: Occluder, report: Report, *, name: str
) -> list[Path]:
    """Write silhouettes, histograms and an HTML page of what was judged; what was written.

    ``mesh``, ``occluder``  those that the report is about, of levels of detail the finest one.
    ``report``  as ``docs/report.schema.json`` says; ``name`` is what the page calls the mesh.

    Raises :class:`~simplifier.errors.OutputError`, and :class:`~simplifier.errors.OptionError` for
    what is no such argument.
    """
    place = as_path("folder", folder)
    check_judged(mesh, occluder, report)
    check_kind("name", name, str, "a text")
    return write_pictures(place, mesh, occluder, _accuracy_of(report), report, name=name)


def _accuracy_of(report: Report) -> AccuracyReport:
    """What a report tells of accuracy; of pixels a quad it tells nothing."""
    views = report["by_view"]
    untold = np.full(len(views), np.nan)
    return AccuracyReport(
        precision=report["precision"],
        recall=report["recall"],
        directions=directions_of(report),
        precision_by_view=np.array([view["precision"] for view in views], dtype=np.float64),
        recall_by_view=np.array([view["recall"] for view in views], dtype=np.float64),
        nt=untold,
        pf=untold,
        nf=untold,
        coverage=report["coverage"],
        options=AccuracyOptions(**report["options"]["accuracy"]),
    )
