"""What each device takes for a report, silhouettes, an occluder, and the scores of candidates.

The renderer's name stands in each row: Mesa's llvmpipe is the processor in a card's place, and what
it takes tells nothing of a card.  ``same`` says whether the result is the processor's to the bit.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

import simplifier
from bench.meshes import bumpy_sphere
from bench.record import Row
from simplifier.accuracy.accuracy import AccuracyOptions, evaluate_accuracy
from simplifier.accuracy.front import measure_front
from simplifier.accuracy.overhang import measure_overhang
from simplifier.accuracy.silhouette_views import SilhouetteViews
from simplifier.device.choice import open_device
from simplifier.device.device import PROCESSOR, Device
from simplifier.device.remembering import remembering
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.views import random_directions
from simplifier.options.simplify import DeviceChoice
from simplifier.options.stages import make_options
from simplifier.progress import Stopwatch
from simplifier.selection.candidates import Candidates
from simplifier.selection.measure import search_projections
from simplifier.slicing.sampler import GridSampler
from simplifier.steps.cut import build_chains, cut_sections, trace_outlines
from simplifier.steps.solid import solidify

_TRIANGLES = 100_000
_IMAGE = 512  # pixels of the larger pictures

Work = Callable[[Device], NDArray[np.generic]]


def device_times(repeats: int) -> Iterator[Row]:
    """A row a piece of work and device; without OpenGL a note in place of its rows."""
    card = open_device("gpu")
    mesh = bumpy_sphere(_TRIANGLES)
    for name, work in _works(mesh).items():
        expected, took = _timed(work, PROCESSOR, repeats)
        yield {"work": name, "device": PROCESSOR.name, **took, "same": True}
        if card.name == PROCESSOR.name:
            yield {"work": name, "device": "gpu", "note": f"skipped: {'; '.join(card.remarks)}"}
            continue
        found, took = _timed(work, card, repeats)
        same = found.tobytes() == expected.tobytes()
        yield {"work": name, "device": card.name, **took, "same": same}


def _timed(work: Work, device: Device, repeats: int) -> tuple[NDArray[np.generic], Row]:
    result = work(device)  # compiles kernels or programs
    seconds = []
    for _ in range(repeats):
        begin = time.perf_counter()
        work(device)
        seconds.append(time.perf_counter() - begin)
    row = {"median_s": statistics.median(seconds), "min_s": min(seconds), "max_s": max(seconds)}
    return result, row


def _works(mesh: TriangleMesh) -> Mapping[str, Work]:
    few = simplifier.simplify(mesh, preset="draft", moves=0).occluder
    views = AccuracyOptions().views
    lines = random_directions(views, 0)
    candidates = _candidates(mesh)

    def report(device: Device, image: int) -> NDArray[np.generic]:
        drawing = remembering(device)
        options = AccuracyOptions(image=image)
        accuracy = evaluate_accuracy(mesh, few, options, directions=lines, device=drawing)
        shares = [
            measure(mesh, few, lines, drawing) for measure in (measure_overhang, measure_front)
        ]
        return np.concatenate([accuracy.recall_by_view, *(one.by_view for one in shares)])

    def silhouettes(device: Device) -> NDArray[np.generic]:
        drawn = SilhouetteViews.of(mesh, [few], lines, _IMAGE).masks(device, 0, views)
        return np.concatenate(drawn)

    def best(device: Device) -> NDArray[np.generic]:
        asked: DeviceChoice = "cpu" if device.name == PROCESSOR.name else "gpu"
        return simplifier.simplify(mesh, preset="best", device=asked).occluder.vertices

    return {
        **{
            f"report of {views} views of {image} pixels, {_TRIANGLES:,} triangles": partial(
                report, image=image
            )
            for image in (AccuracyOptions().image, _IMAGE)
        },
        f"silhouettes of {_IMAGE} pixels, sent back": silhouettes,
        "an occluder by preset best": best,
        f"scores of {len(candidates):,} candidates in {candidates.views} views": (
            lambda device: replace(candidates, device=device).full_gains()
        ),
    }


def _candidates(mesh: TriangleMesh) -> Candidates:
    """The sections that the preset best chooses among."""
    options, watch = make_options(float(mesh.extent.max()), preset="best"), Stopwatch()
    solid = solidify(mesh, options.solid, watch)
    slicer, flats = GridSampler(solid.core), np.empty((0, 3))
    sections = cut_sections(slicer, solid, flats, options.sections, watch)
    chains = build_chains(sections, trace_outlines(sections, watch), watch)
    return Candidates.from_chains(
        chains, search_projections(solid, options, options.selection.views)
    )
