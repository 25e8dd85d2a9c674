"""Walks through scenes: triangles that are drawn by visible sets, by occluders, and by both.

Sets are found for the cells alone that a walk crosses, since the others are never looked up.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from bench.record import Row, tell_parts
from bench.visibility_cases import Case, interior, lyon, mountains, walkable_city
from simplifier.camera_paths.generate import generate_path
from simplifier.culling.drawn import Way
from simplifier.culling.flythrough import Flythrough, fly
from simplifier.culling.visible_sets import VisibleSets
from simplifier.geometry.camera import CameraPath
from simplifier.hierarchy.occluder_tree import OccluderTree
from simplifier.hierarchy.scene_build import build_occluders
from simplifier.hierarchy.scene_file import load_occluder_tree, occluder_store, write_manifest
from simplifier.options.scene import CullOptions, PathKind, PathOptions, SceneOptions
from simplifier.visibility.checking.exact_view import prisms_of
from simplifier.visibility.checking.panorama import Panorama
from simplifier.visibility.find import Found, Watch, find_pvs

_FRAMES = 600
_EACH, _PIXELS = 15, 256  # of frames, in which pictures all around are drawn over a ground
_ABOVE = 1.2  # eye heights of the walk: a voxel of its floors may lift a step over a cell's top

Walk = tuple[Callable[[float], Case], PathKind, float]
"""What makes the scene with cells up to a height over the ground, and the walk with its eyes."""

WALKS: Mapping[str, Walk] = {
    "city of 6 x 6 blocks": (lambda eye: walkable_city(6, eye), "street", 1.7),
    "city of 16 x 16 blocks": (lambda eye: walkable_city(16, eye), "street", 1.7),
    "Lyon": (lyon, "street", 1.7),
    "duplex": (lambda eye: interior(0, eye), "inside", 1.5),
    "dungeon": (lambda eye: interior(1, eye), "inside", 1.5),
    "Sponza": (lambda eye: interior(2, eye), "inside", 1.5),
    # A walker at 2 m gets through four cells of 800 m in as many frames; so high it is a bird.
    "mountains": (mountains, "street", 30.0),
}


def walk_rows(names: Sequence[str] | None = None, frames: int = _FRAMES) -> Iterator[Row]:
    """A row a scene, of those that are named: means of a frame, shares of the frustum's triangles.

    Raises :class:`AssertionError` where in some frame sets and occluders together draw more than
    either, or where conservative sets leave out what is seen.
    """
    for name, (make, kind, eye) in WALKS.items():
        if names is None or name in names:
            begin = time.process_time(), time.perf_counter()
            row = _walked(name, make(_ABOVE * eye), kind, eye, frames)
            took = time.process_time() - begin[0], time.perf_counter() - begin[1]
            yield {**row, "processor_seconds": took[0], "seconds": took[1]}


def _walked(name: str, case: Case, kind: PathKind, eye: float, frames: int) -> Row:
    options, scene = case.options, case.upright.scene
    walk = PathOptions(kind=kind, up=options.up, frames=frames, eye_height=eye)
    path = generate_path(scene, walk)
    found = _found(name, case, path)
    sets = VisibleSets.of(found.pvs, scene, scene)
    tell = tell_parts(f"walks: {name}, frames")
    flown = fly(
        scene, _occluders(name, case), path, CullOptions((160, 90), shots=0, repeats=1),
        lambda done, _: tell(done, frames), sets=sets,
    )  # fmt: skip
    if options.ground:
        _check_over_ground(case, sets, path)
    _check(flown, sure=found.pvs.conservative and not options.ground)
    return {"scene": name, "objects": len(scene), **_figures(flown, found)}


def _found(name: str, case: Case, path: CameraPath) -> Found:
    """The sets of the cells that a path crosses."""
    upright = case.upright
    eyes = np.array([camera.position for camera in path.cameras])[:, upright.order]
    met = [case.cells.containing(eye - upright.origin) for eye in eyes]
    crossed = case.cells.some(np.unique(np.concatenate(met)))
    watch = Watch(tell_parts(f"walks: {name}, cells"))
    return find_pvs(upright, crossed, case.options, None, watch, terrain=case.terrain)


def _occluders(name: str, case: Case) -> OccluderTree:
    """Small ones, made fast: a node has at most twelve triangles, cut from 16 voxels."""
    scene, options = case.upright.scene, case.options
    built = SceneOptions(
        budget=12, resolution=16, moves=50, up=options.up, pixel_error=2.0,
        ground=options.ground or case.terrain is not None,
    )  # fmt: skip
    with tempfile.TemporaryDirectory() as name_of_folder:
        folder = Path(name_of_folder)
        tell = tell_parts(f"walks: {name}, occluders")
        made = build_occluders(scene, built, occluder_store(folder), {}, tell)
        write_manifest(folder, scene, built, made)
        return load_occluder_tree(folder)


def _check_over_ground(case: Case, sets: VisibleSets, path: CameraPath) -> None:
    """Frames show what is behind the open bases of houses uphill.  With ground under them nothing
    is missing in some of the frames, looked at all around.
    """
    scene, up = case.upright.scene, case.options.up
    panorama = Panorama(scene, up, _PIXELS, prisms_of(scene, up))
    for camera in path.cameras[::_EACH]:
        shown = ~np.isnan(panorama.seen_from(camera.position)[:, 0])
        missing = np.flatnonzero(shown & ~sets.seen_from(camera.position))
        assert len(missing) == 0, (camera.position, missing)


def _check(flown: Flythrough, *, sure: bool) -> None:
    """``sure``  whether nothing that frames show may be missing from the sets."""
    for frame in flown.frames:
        drawn = {way: frame.figures.drawn[way].triangles for way in Way}
        assert drawn[Way.BOTH] <= min(drawn[Way.PVS], drawn[Way.OCCLUDERS]), frame
        assert max(drawn[Way.PVS], drawn[Way.OCCLUDERS]) <= drawn[Way.FRUSTUM], frame
        assert not sure or frame.figures.drawn[Way.PVS].wrong_pixels == 0, frame


def _figures(flown: Flythrough, found: Found) -> Row:
    total, count = flown.total, len(flown.frames)
    whole = max(total.drawn[Way.FRUSTUM].triangles, 1)
    return {
        "frames": count,
        "cells": len(found.pvs.cells),
        "taken": " and ".join(found.way),
        "frustum": whole / count,
        **{way.value: total.drawn[way].triangles / count for way in list(Way)[1:]},
        **{f"{way.value}_share": total.drawn[way].triangles / whole for way in list(Way)[1:]},
        "frames_outside": total.outside_cells,
        "wrong_pixels_pvs": total.drawn[Way.PVS].wrong_pixels,
        "wrong_pixels_occluders": total.drawn[Way.OCCLUDERS].wrong_pixels,
    }
