"""A route of places -> a walk: smooth, in equal steps, looking ahead and about.

Places and the ways between them -> a tour of far-apart ones.

Farthest-point sampling: each next stop is the one that is hardest to reach from all stops so far
(T. Gonzalez, "Clustering to minimize the maximum intercluster distance", 1985), here by the cost of
the way and not as the crow flies.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray

_ROUNDS = 60  # of smoothing; a corner is rounded over about the square root of it in places
_SHORTER = 0.85  # what is left of a walk after it cut a corner
_LEAST = 1e-6  # of a route; steps so short stay within a cell, and nothing is crossed
_PARTS = 9  # of a route that are tried


@dataclass(frozen=True)
class Space:
    """Where one may be.

    ``allows``  takes places (n, 3), returns (n,) bool: whether an eye may be there.
    ``clear``   takes ends a, b (n, 3), returns (n,) bool: whether the straight way between them
                crosses nothing.
    """

    allows: Callable[[FloatArray], BoolArray]
    clear: Callable[[FloatArray, FloatArray], BoolArray]


def smooth(route: FloatArray, space: Space) -> FloatArray:
    """The route (n, 3) with every place drawn between its neighbours, as far as is allowed.

    Places of a route are neighbours in a grid, and no eye is allowed in the cells on both sides of
    a wall, so none can be drawn through it.
    """
    points = route.copy()
    for _ in range(_ROUNDS):
        for first in (1, 2):  # every other place, so that no two neighbours move at once
            moving = np.arange(first, len(points) - 1, 2)
            drawn = 0.5 * points[moving] + 0.25 * (points[moving - 1] + points[moving + 1])
            fine = space.allows(drawn)
            points[moving[fine]] = drawn[fine]
    return points


def equal_steps(route: FloatArray, frames: int, longest: float, space: Space) -> FloatArray:
    """(frames, 3) places along the route in equal steps of at most ``longest``.

    Where a step would cut a corner through something, another part of the route is taken, and a
    shorter one where none will do.
    """
    along = _lengths(route)
    length = min(float(along[-1]), longest * max(frames - 1, 1))
    while True:
        for start in np.linspace(0.0, along[-1] - length, _PARTS):
            points = _at(route, along, start + np.linspace(0.0, length, frames))
            if space.clear(points[:-1], points[1:]).all():
                return points
        if length <= _LEAST * along[-1]:
            return np.repeat(route[:1], frames, axis=0)
        length *= _SHORTER


def _lengths(route: FloatArray) -> FloatArray:
    """(n,) the way from the start to each place."""
    steps = np.linalg.norm(np.diff(route, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _at(route: FloatArray, along: FloatArray, wanted: FloatArray) -> FloatArray:
    return np.stack([np.interp(wanted, along, column) for column in route.T], axis=1)


def views(places: FloatArray, rng: np.random.Generator, *, turn: float, tilt: float) -> FloatArray:
    """(n, 3) unit directions along the walk, turning to both sides by ``turn`` degrees.

    ``tilt`` degrees up; the turning starts at a random phase and takes about seven frames from
    side to side, so that neighbouring frames see different things.
    """
    count = len(places)
    ahead = np.gradient(places, axis=0)[:, :2] if count > 1 else np.zeros((1, 2))
    ahead = ndimage.gaussian_filter1d(ahead, 1.0, axis=0, mode="nearest")
    heading = _headings(ahead)
    phase = 2.0 * math.pi * (rng.random() + np.arange(count) / 13.7)
    heading = heading + math.radians(turn) * np.sin(phase)
    rise = math.radians(tilt)
    return np.stack(
        [
            math.cos(rise) * np.cos(heading),
            math.cos(rise) * np.sin(heading),
            np.full(count, math.sin(rise)),
        ],
        axis=1,
    )


def _headings(ahead: FloatArray) -> FloatArray:
    """(n,) angles of directions (n, 2); one of no length has that of the last before it."""
    lengths = np.linalg.norm(ahead, axis=1)
    known = lengths > 1e-9 * max(float(lengths.max()), 1e-300)
    last = np.maximum.accumulate(np.where(known, np.arange(len(ahead)), 0))
    return np.asarray(np.arctan2(ahead[last, 1], ahead[last, 0]))


def crossed_cells(start: FloatArray, end: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
    """(m, d) the cells that a segment in grid space (d,) passes through, and (m, 2) from where to
    where, as shares of it."""
    cuts = [np.array([0.0, 1.0])]
    for a, b in zip(start, end, strict=True):
        low, high = min(a, b), max(a, b)
        if high > low:
            planes = np.arange(math.ceil(low), math.floor(high) + 1)
            cuts.append((planes - a) / (b - a))
    shares = np.unique(np.clip(np.concatenate(cuts), 0.0, 1.0))
    spans = np.stack([shares[:-1], shares[1:]], axis=1)
    middles = start + spans.mean(axis=1)[:, None] * (end - start)
    if len(spans) == 0:
        spans, middles = np.array([[0.0, 1.0]]), start[None]
    return np.floor(middles).astype(np.int64), spans


Ids = NDArray[np.int64]

_STOPS = 6
_NEAREST = 1e-6  # shares of the reach; a stop nearer than this is no new one


@dataclass(frozen=True, eq=False)
class Ways:
    """Places and what it costs to go from one to a neighbour.

    ``places``  (n, 3) float64.
    ``costs``   (n, n) sparse, each pair once: a length, more where the way is less welcome.
    """

    places: FloatArray
    costs: sparse.csr_array

    @classmethod
    def between(cls, places: FloatArray, pairs: Ids, factors: FloatArray) -> Ways:
        """``pairs`` (m, 2), each once; ``factors`` (n,), 1 or more: how unwelcome a place is."""
        a, b = pairs.T
        lengths = np.linalg.norm(places[a] - places[b], axis=1)
        weights = lengths * 0.5 * (factors[a] + factors[b])
        shape = (len(places), len(places))
        return cls(places, sparse.csr_array((weights, (a, b)), shape=shape))

    def parts(self) -> NDArray[np.int32]:
        """(n,) the number of the connected part of each place."""
        return np.asarray(csgraph.connected_components(self.costs, directed=False)[1])


def tour(ways: Ways, sights: BoolArray, reach: float, rng: np.random.Generator) -> FloatArray:
    """(m, 3) a way from place to place that visits far-apart ``sights`` (n,), at least one.

    Starts are drawn from the sights; no stop costs more than ``reach`` from there.
    """
    centre = int(rng.choice(np.nonzero(sights)[0]))
    costs, _ = _costs_from(ways, centre, reach)
    within = sights & np.isfinite(costs)
    stops = [int(np.where(within, costs, -1.0).argmax())]
    found = [_costs_from(ways, stops[0], 2.0 * reach)]
    while len(stops) < _STOPS:
        nearest = np.min([costs for costs, _ in found], axis=0)
        reachable = within & np.isfinite(nearest)
        stop = int(np.where(reachable, nearest, -1.0).argmax())
        if nearest[stop] <= _NEAREST * reach:
            break
        stops.append(stop)
        found.append(_costs_from(ways, stop, 2.0 * reach))
    return ways.places[_visit(stops, found)]


def _costs_from(ways: Ways, place: int, limit: float) -> tuple[FloatArray, NDArray[np.int32]]:
    """Cost to every place, infinite past the limit, and the place before it on the way there."""
    costs, before = csgraph.dijkstra(
        ways.costs, directed=False, indices=place, return_predecessors=True, limit=limit
    )
    return costs, before


def _visit(stops: list[int], found: list[tuple[FloatArray, NDArray[np.int32]]]) -> Ids:
    """The places on the way through all stops, always on to the nearest one left."""
    left = dict(zip(stops, found, strict=True))
    here = stops[0]
    route = [here]
    costs, before = left.pop(here)
    while left:
        there = min(left, key=lambda stop: (costs[stop], stop))
        route += _backwards(before, here, there)
        here = there
        costs, before = left.pop(here)
    return np.array(route, dtype=np.int64)


def _backwards(before: NDArray[np.int32], start: int, end: int) -> list[int]:
    """The places after ``start`` up to ``end``."""
    way = []
    place = end
    while place != start:
        way.append(place)
        place = int(before[place])
    return way[::-1]
