"""The report of one occluder as JSON: stable keys, shares as fractions from 0 to 1.

What the report says of levels of detail: a row each, and those that were left out.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from simplifier.accuracy.accuracy import AccuracyReport
from simplifier.accuracy.deviation import deviation_from_solid
from simplifier.accuracy.front import measure_front
from simplifier.accuracy.occlusion import occlusion_measures
from simplifier.accuracy.overhang import Overhang, measure_overhang
from simplifier.accuracy.verdict import EngineVerdict, VerdictFigures, verdict_on
from simplifier.device.device import PROCESSOR, Device
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import LodChain, Occluder
from simplifier.geometry.solid import Solid
from simplifier.geometry.views import ViewShares
from simplifier.io.files import write_whole
from simplifier.progress import STAGES
from simplifier.version import VERSION

SCHEMA_VERSION = 1
"""Raised when a key changes its meaning or goes; new keys do not raise it."""

Report = dict[str, Any]


def build_report(
    mesh: TriangleMesh,
    occluder: Occluder,
    solid: Solid,
    accuracy: AccuracyReport,
    *,
    options: Mapping[str, Any],
    timings: Mapping[str, float],
    warnings: Sequence[str] = (),
    decisions: Sequence[str] = (),
    seed: int = 0,
    levels: Sequence[Report] = (),
    left_out: Sequence[Report] = (),
    strays: float | None = None,
    overhang: Overhang | None = None,
    front: ViewShares | None = None,
    verdict: EngineVerdict | None = None,
    command: str | None = None,
    device: Device = PROCESSOR,
) -> Report:
    """All that is known of an occluder, ready for ``json.dumps``.

    ``options`` as resolved; ``timings`` seconds by stage, stages that did not run count 0.  With
    ``levels`` of detail and those ``left_out``, rows of :mod:`simplifier.report.report`,
    the occluder is that of the finest.  ``strays`` is its deviation, ``overhang`` what it covers
    beside the mesh, ``front`` what it stands before, and ``verdict`` what is to be thought of it;
    each is found here if it is None.  ``command`` is what to try next, ``decisions`` are what was
    decided while the occluder was made, a sentence each.  The ``device`` draws.
    """
    measures = occlusion_measures(mesh, occluder, device)
    if overhang is None:
        overhang = measure_overhang(mesh, occluder, accuracy.directions, device)
    if front is None:
        front = measure_front(mesh, occluder, accuracy.directions, device)
    if strays is None:
        strays = deviation_from_solid(occluder, mesh, solid)
    if verdict is None:
        verdict = verdict_on(verdict_figures(occluder, accuracy, overhang))
    return {
        "schema_version": SCHEMA_VERSION,
        "version": VERSION,
        "verdict": verdict_row(verdict, command),
        "triangles": len(occluder.faces),
        "precision": accuracy.precision,
        "recall": accuracy.recall,
        "coverage": accuracy.coverage,
        "by_view": [_view(accuracy, index) for index in range(len(accuracy.directions))],
        "worst_view": {"index": accuracy.worst_view, **_view(accuracy, accuracy.worst_view)},
        "overhang": _overhang(overhang),
        "front": _shares(front),
        "occlusion_measure": {
            "occluder": measures.occluder,
            "original": measures.original,
            "ratio": measures.ratio,
        },
        "error_bound": _finite(occluder.error_bound),
        "deviation": strays,
        "timings": {stage: timings.get(stage, 0.0) for stage in STAGES},
        "device": device.name,
        "options": dict(options),
        "input": _input(mesh),
        "solid": _solid(solid),
        "levels": list(levels),
        "left_out": list(left_out),
        "decisions": list(decisions),
        "warnings": list(warnings),
        "seed": seed,
    }


def write_report(report: Report, path: Path) -> None:
    """Write strict JSON (no NaN, no infinity), whole or not at all.

    Raises :class:`~simplifier.errors.OutputError`.
    """
    text = json.dumps(report, indent=2, allow_nan=False) + "\n"
    write_whole(path, text.encode())


def verdict_figures(
    occluder: Occluder, accuracy: AccuracyReport, overhang: Overhang
) -> VerdictFigures:
    """What is known of an occluder that a verdict is made of."""
    return VerdictFigures(
        len(occluder.faces), accuracy.precision, accuracy.recall, overhang.mean, accuracy.coverage
    )


def verdict_row(verdict: EngineVerdict, command: str | None) -> Report:
    """A word, its reason, and the command to try next, if there is one."""
    return {"word": verdict.word, "reason": verdict.reason, "next": command}


def _view(accuracy: AccuracyReport, index: int) -> Report:
    return {
        "direction": [float(x) for x in accuracy.directions[index]],
        "precision": float(accuracy.precision_by_view[index]),
        "recall": float(accuracy.recall_by_view[index]),
    }


def _overhang(found: Overhang) -> Report:
    return {**_shares(found), "stick_out": found.stick_out}


def _shares(found: ViewShares) -> Report:
    worst = found.worst_view
    return {
        "share": found.mean,
        "worst_view": {
            "index": worst,
            "direction": [float(x) for x in found.directions[worst]],
            "share": found.worst,
        },
    }


def _finite(value: float) -> float | None:
    """None for "no promise was made": JSON has no infinity."""
    return value if math.isfinite(value) else None


def _input(mesh: TriangleMesh) -> Report:
    return {
        "triangles": len(mesh.faces),
        "vertices": len(mesh.vertices),
        "bounds": mesh.bounds.tolist(),
        "dropped": mesh.dropped.counts,
        "omitted": [asdict(one) for one in mesh.omitted],
    }


def _solid(solid: Solid) -> Report:
    return {
        "resolution": list(solid.filled.shape),
        "cell_size": solid.filled.cell_size,
        "inside_fraction": solid.inside_fraction,
        "closed_by": [
            {"by": closing.by, "volume": closing.voxels * solid.filled.cell_size**3}
            for closing in solid.closed_by
        ],
    }


Rows = list[dict[str, Any]]


def level_rows(
    chain: LodChain,
    accuracies: Sequence[AccuracyReport],
    overhangs: Sequence[Overhang],
    verdicts: Sequence[Report],
    files: Sequence[Path] | None,
) -> Rows:
    """A row a level, finest first; the rest in the same order.

    ``verdicts`` are rows as :func:`verdict_row` has them; ``files`` is None where the levels were
    not written.
    """
    names = [None] * len(chain.levels) if files is None else [file.name for file in files]
    return [
        {
            "level": index,
            "triangles": level.triangles,
            "error_bound": _finite(level.error_bound),
            "deviation": level.deviation,
            "resolution": level.resolution,
            "switch_distance": _finite(chain.switch_distance(index)),
            "precision": accuracy.precision,
            "recall": accuracy.recall,
            "overhang": _overhang(overhang),
            "verdict": verdict,
            "file": name,
        }
        for index, (level, accuracy, overhang, verdict, name) in enumerate(
            zip(chain.levels, accuracies, overhangs, verdicts, names, strict=True)
        )
    ]


def left_out_rows(chain: LodChain) -> Rows:
    """Resolution and reason of each level that brought nothing."""
    return [asdict(one) for one in chain.left_out]
