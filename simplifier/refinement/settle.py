"""Triangles that share corners -> the same, with each corner where they are worth most.

A search moves a corner of one triangle at a time, which opens a surface.  So it leaves a sheet that
was decimated as it is, though what such a sheet lacks is mostly a few corners that stick out in a
view or two.  Here all that meets at a corner moves with it, along its normal, as long as that
raises the worth by the judge.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.room import Room
from simplifier.kernels.threads import run_each
from simplifier.refinement.containment import are_inside
from simplifier.refinement.finalists import FinalistScore, Judge

_STEPS = (1.0, 0.5, 0.25, 0.125)  # cells, in each of which all corners take a turn
_MOST = 250  # moves to try, of up to a millisecond each
_LEAST = 1e-5  # of worth, that a move has to bring
_FAULTLESS = 0.003  # of recall: with fewer faults there is nothing to settle
_MANY = 0.05  # of recall: faults that more turns make none the fewer
_SHARE = 0.1  # of these, that a turn has to take away


def settled(
    triangles: FloatArray,
    room: Room,
    judge: Judge,
    enough: float,
    stopped: Callable[[], bool] = lambda: False,
) -> FloatArray:
    """A soup (m, 3, 3) in the place of the ``room``, all of it inside, or one that is worth more.

    Corners at one place stay together, and in the room.  It ends once the worth is ``enough`` or
    the faults cost next to nothing, as pictures of half the size tell; where a turn of all corners
    leaves most of many faults; after some hundred tries; or soon after ``stopped()``.
    """
    coarser = judge.coarser()
    places, corners = _shared(triangles)
    found, left = coarser.score(triangles), _MOST

    def better(moved: FloatArray) -> FinalistScore:
        """As much as now where it is no more."""
        least = coarser.worth_of(found) + _LEAST
        return coarser.score_above(least, moved[corners]) or found

    for step in _STEPS:
        before = coarser.faults_of(found)
        for corner, normal in _normals(places, corners):
            is_done = coarser.worth_of(found) >= enough or coarser.faults_of(found) < _FAULTLESS
            if is_done or left <= 0 or stopped():
                break
            ways = [
                moved
                for moved in (_moved(places, corner, way * normal) for way in (-step, step))
                if are_inside(moved[corners[(corners == corner).any(axis=1)]], room).all()
            ]
            left -= len(ways)
            scores = run_each(better, ways)
            best = max(scores, key=coarser.worth_of, default=found)
            if best is not found:
                found, places = best, ways[scores.index(best)]
        faults = coarser.faults_of(found)
        if faults > max(_MANY, (1.0 - _SHARE) * before):
            break
    soups = [triangles, places[corners]]
    worths = judge.worths(soups)
    return soups[worths.index(max(worths))]


def _shared(triangles: FloatArray) -> tuple[FloatArray, IntArray]:
    """Vertices (n, 3), one at each place, and faces (m, 3) int32."""
    places, corners = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    faces: IntArray = corners.reshape(-1, 3).astype(np.int32)
    return places, faces


def _normals(places: FloatArray, corners: IntArray) -> Iterator[tuple[int, FloatArray]]:
    """Each corner that has a normal, and that, as they are when the turn begins."""
    p, q, r = np.moveaxis(places[corners], 1, 0)
    across = np.cross(q - p, r - p)  # twice the area long
    normals = np.zeros_like(places)
    for k in range(3):
        np.add.at(normals, corners[:, k], across)
    lengths = np.linalg.norm(normals, axis=1)
    for corner in np.flatnonzero(lengths > 0.0):
        yield int(corner), normals[corner] / lengths[corner]


def _moved(places: FloatArray, corner: int, by: FloatArray) -> FloatArray:
    moved = places.copy()
    moved[corner] += by
    return moved
