"""A real result, made once: files as a job leaves them."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import simplifier
from examples.castle import castle


@dataclass(frozen=True)
class CastleFiles:
    """``folder`` has original.glb, lod0.glb, lod1.glb and report.json."""

    folder: Path
    mesh: simplifier.TriangleMesh
    levels: tuple[simplifier.Occluder, ...]
    report: dict[str, Any]


def castle_files(folder: Path) -> CastleFiles:
    mesh = castle()
    options = simplifier.SimplifyOptions(preset="draft", lods=2, ground=True, resolution=32)
    product = simplifier.produce(mesh, options)
    levels = tuple(level.occluder for level in product.levels)
    for number, occluder in enumerate(levels):
        simplifier.save(occluder, folder / f"lod{number}.glb")
    simplifier.save_for_viewing(mesh, folder / "original.glb")
    report = product.report()
    (folder / "report.json").write_text(json.dumps(report))
    return CastleFiles(folder, mesh, levels, report)
