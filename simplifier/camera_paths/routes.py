"""Places and the ways between them -> a tour of far-apart ones.

Farthest-point sampling: each next stop is the one that is hardest to reach from all stops so far
(T. Gonzalez, "Clustering to minimize the maximum intercluster distance", 1985), here by the cost of
the way and not as the crow flies.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import csgraph

from simplifier.geometry.grid import BoolArray
from simplifier.geometry.mesh import FloatArray

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
