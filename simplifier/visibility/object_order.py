"""Sets of visible objects -> an order of the objects in which the sets make few runs.

The sum over all sets of where runs begin and end is the sum over neighbours in the order of how
many cells see one and not the other.  The shortest way through all objects by that distance is
sought from each to the nearest one left, among those nearby in the plan.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray

_NEAR = 64  # objects around each, of which one may be next
_MOST_CELLS = 4096  # that are looked at; more, evenly left out, hardly change the order
_CODE = 16  # bits of a place along each axis
_BITS = np.array([number.bit_count() for number in range(1 << 16)], dtype=np.int32)


def few_runs(sets: Sequence[BoolArray], places: FloatArray) -> NDArray[np.int32]:
    """(n,) the objects in order.

    ``sets``    (n,) what is seen from each cell.
    ``places``  (n, 2) the objects' middles in plan.
    """
    count = len(places)
    along = z_curve(places)
    if count == 0 or len(sets) == 0:
        return along
    # Imported where it is used: it takes long to load.
    from scipy.spatial import KDTree

    step = -(-len(sets) // _MOST_CELLS)
    seen_by = _words(np.array(sets[::step]).T)
    _, near = KDTree(places).query(places, k=np.arange(1, min(_NEAR, count) + 1))
    left = np.ones(count, dtype=np.bool_)
    order = np.empty(count, dtype=np.int32)
    here, begin = int(along[0]), 0
    for place in range(count):
        order[place] = here
        left[here] = False
        around = near[here][left[near[here]]]
        if len(around):
            apart = _BITS[seen_by[around] ^ seen_by[here]].sum(axis=1)
            here = int(around[np.argmin(apart)])
            continue
        while begin < count and not left[along[begin]]:
            begin += 1
        here = int(along[min(begin, count - 1)])
    return order


def z_curve(places: FloatArray) -> NDArray[np.int32]:
    """(n,) objects (n, 2) along a Z-curve over the plan."""
    low = places.min(axis=0, initial=np.inf)
    extent = np.ptp(places, axis=0).max() if len(places) else 0.0
    cells = ((places - low) / max(extent, 1e-300) * (2**_CODE - 1)).astype(np.uint64)
    code = np.zeros(len(places), dtype=np.uint64)
    for bit in range(_CODE):
        for axis in (0, 1):
            code |= (cells[:, axis] >> np.uint64(bit) & np.uint64(1)) << np.uint64(2 * bit + axis)
    return np.argsort(code, kind="stable").astype(np.int32)


def _words(rows: BoolArray) -> NDArray[np.uint16]:
    """Rows of bits (n, k) as words of 16, of which bits alone are counted."""
    packed = np.packbits(np.ascontiguousarray(rows), axis=1)
    return np.ascontiguousarray(np.pad(packed, ((0, 0), (0, packed.shape[1] % 2)))).view(np.uint16)
