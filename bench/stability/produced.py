"""One extreme case as a row: the occluder's figures, or what it was refused with."""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import simplifier
from bench.machine import ROOT
from bench.record import Row, markdown, read_table, told, write_table
from simplifier.geometry.mesh import TriangleMesh
from simplifier.warmup import warm_up

RESULTS = ROOT / "bench" / "results"


def arguments_of(name: str) -> argparse.ArgumentParser:
    """What every benchmark that makes such rows is told on its command line."""
    parser = argparse.ArgumentParser(prog=f"python -m bench.stability.{name}")
    parser.add_argument("--views", type=int, default=64, help="that accuracy is measured from")
    parser.add_argument("--out", type=Path, default=RESULTS)
    return parser


def words_of(options: Mapping[str, object]) -> str:
    """Options as a row names them; numbers by three digits."""
    return " ".join(
        f"{key}={value:.3g}" if isinstance(value, float) else f"{key}={value}"
        for key, value in options.items()
    )


def produced_row(mesh: TriangleMesh, case: Row, views: int, options: dict[str, Any]) -> Row:
    """``case`` names it; lengths are in voxels, figures of all quads in ``views`` views.

    ``seconds`` are those of the occluder alone.
    """
    try:
        chosen = simplifier.SimplifyOptions.of(options | {"views": views, "exact": True})
        begin = time.perf_counter()
        made = simplifier.simplify(mesh, chosen)
        seconds = time.perf_counter() - begin
    except simplifier.OccluderError as error:
        return {**case, "says": f"refused: {error}"}
    product = made.measure()
    report, finest = product.report(), product.levels[0]
    voxel = report["solid"]["cell_size"]
    return {
        **case,
        "triangles": finest.triangles,
        "recall %": f"{100.0 * report['recall']:.2f}",
        "precision %": f"{100.0 * report['precision']:.3f}",
        "measure %": f"{100.0 * report['occlusion_measure']['ratio']:.2f}",
        "deviation": f"{finest.deviation / voxel:.3f}",
        "error bound": f"{finest.error_bound / voxel:.3f}",
        "s": f"{seconds:.2f}",
        "says": "; ".join(product.warnings),
    }


def record(rows: Iterable[Row], name: str, folder: Path) -> None:
    """Tell each row, write ``stability_NAME.csv``, print it as Markdown."""
    warm_up()
    kept = []
    for row in rows:
        print(told(row), flush=True)
        kept.append(row)
    path = folder / f"stability_{name}.csv"
    write_table(path, kept, f"python -m bench.stability.{name}", "lengths are in voxels")
    print(markdown(read_table(path)))
