"""A flythrough as JSON, by ``docs/cull.schema.json``, and all the files that are made of one."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from simplifier.culling.drawn import Spread, Way
from simplifier.culling.fate import Counts
from simplifier.culling.flythrough import Flythrough
from simplifier.culling.flythrough_rows import drawn_share, flythrough_csv, median_milliseconds
from simplifier.culling.frame import Frame, FrameFigures
from simplifier.culling.walk_page import walk_page
from simplifier.report.machine import this_machine
from simplifier.version import VERSION

SCHEMA_VERSION = 1
"""Raised when a key changes its meaning or goes; new keys do not raise it."""


def summary(flown: Flythrough, scene_name: str) -> dict[str, Any]:
    """Totals, worst frames and options, ready for ``json.dumps``; shares are fractions."""
    whole = flown.total
    return {
        "schema_version": SCHEMA_VERSION,
        "version": VERSION,
        "scene": {
            "name": scene_name,
            "objects": len(flown.scene),
            "parts": len(flown.parts.object_of),
            "triangles": int(flown.scene.triangle_counts.sum()),
        },
        "path": {"name": flown.path.name, "frames": len(flown.path.cameras)},
        "frames_measured": len(flown.frames),
        "options": {
            "rows": flown.options.rows,
            "columns": flown.options.columns,
            "pixel_error": flown.pixel_error,
            "detail": flown.options.detail,
            "repeats": flown.options.repeats,
            "shots": flown.options.shots,
        },
        "objects": _counts(whole.objects),
        "parts": _counts(whole.parts),
        "pixels": {
            "covered": whole.covered_pixels,
            "wrong": whole.wrong_pixels,
            "wrong_share": whole.wrong_share,
        },
        "worst": {
            "recall": _worst_recall(flown.worst_recall),
            "wrong_pixels": _worst_picture(flown.worst_picture),
        },
        "occluders": _occluders(flown, whole),
        "milliseconds": _milliseconds(flown),
        "drawn": {str(way): _drawn(flown, way) for way in whole.drawn},
        "pvs": _sets(flown),
        "machine": asdict(this_machine()),
    }


def flythrough_files(flown: Flythrough, scene_name: str) -> Iterator[tuple[str, bytes]]:
    """``cull.csv``, ``cull.json``, ``walk.html``, ``cull.png`` and ``frames.png``, each made when
    asked for.

    What cannot be had again without measuring comes first.
    """
    yield "cull.csv", flythrough_csv(flown)
    text = json.dumps(summary(flown, scene_name), indent=2, allow_nan=False) + "\n"
    yield "cull.json", text.encode("utf-8", "backslashreplace")
    yield "walk.html", walk_page(flown, scene_name).encode()
    # Here, not above: matplotlib takes half a second to import, and most commands draw nothing.
    from simplifier.culling.contact_sheet import contact_sheet
    from simplifier.culling.flythrough_plot import flythrough_plot

    yield "cull.png", flythrough_plot(flown, scene_name)
    yield "frames.png", contact_sheet(flown, scene_name)


def _counts(counts: Counts) -> dict[str, Any]:
    return {**asdict(counts), "missed": counts.missed, "recall": counts.recall}


def _worst_recall(frame: Frame | None) -> dict[str, Any] | None:
    if frame is None:
        return None
    return {"frame": frame.index, "recall": frame.figures.parts.recall}


def _worst_picture(frame: Frame) -> dict[str, Any]:
    figures = frame.figures
    return {
        "frame": frame.index,
        "wrong": figures.wrong_pixels,
        "wrong_share": figures.wrong_share,
    }


def _occluders(flown: Flythrough, whole: FrameFigures) -> dict[str, Any]:
    triangles = [frame.figures.occluder_triangles for frame in flown.frames]
    return {
        "drawn_mean": whole.occluders / len(flown.frames),
        "triangles_mean": whole.occluder_triangles / len(flown.frames),
        "triangles_max": max(triangles),
        "triangle_share": whole.triangle_share,
    }


def _drawn(flown: Flythrough, way: Way) -> dict[str, Any]:
    of_frames = [frame.figures.drawn[way] for frame in flown.frames]
    total = flown.total.drawn[way]
    return {
        "objects": asdict(Spread.of([one.objects for one in of_frames])),
        "triangles": asdict(Spread.of([one.triangles for one in of_frames])),
        "share_of_frustum": drawn_share(flown.total, way),
        "wrong_objects": total.wrong_objects,
        "wrong_pixels": total.wrong_pixels,
    }


def _sets(flown: Flythrough) -> dict[str, Any] | None:
    if flown.sets is None:
        return None
    held = flown.sets.pvs
    return {
        "cells": len(held.cells),
        "computed": len(held.computed),
        "method": held.method,
        "conservative": held.conservative,
        "frames_outside": flown.total.outside_cells,
    }


def _milliseconds(flown: Flythrough) -> dict[str, float]:
    times = [frame.figures.milliseconds for frame in flown.frames]
    return {"median": median_milliseconds(flown), "max": max(times)}
