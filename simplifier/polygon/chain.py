"""Loop -> Chain: ever simpler polygons inside the first one (section 4.4 of the paper).

The paper removes, again and again, the vertex whose triangle with its neighbours has the least
area, such that the polygon stays inside the original.  Only ears qualify: a reflex vertex is a
point of the original's boundary, and without it the polygon would cover a neighbourhood of that
point, which is partly outside.  So each step cuts the smallest ear, each polygon lies in all that
came before it, and an ear is never lacking (G. Meisters, "Polygons have ears", 1975).
"""

from __future__ import annotations

import numpy as np

from simplifier.geometry.polygon import Chain, Loop
from simplifier.geometry.section import Plane
from simplifier.kernels.chain import clip_ears


def simplification_chain(ring: Loop, plane: Plane) -> Chain:
    """Collapse vertices one by one, down to a single triangle.

    ``ring``   (n, 2) plane coordinates, n >= 3, of positive area: counter-clockwise, weakly simple
               as :func:`~simplifier.polygon.bridge.bridge_holes` makes it.
    ``plane``  the plane that it lies in; passed on.

    Vertices that are straight, spikes or repeated go first.  Of equal areas the vertex that comes
    first in the ring goes first.
    """
    ears = clip_ears(ring)
    lowest = np.ones(len(ring), dtype=np.int32)
    lowest[ears[:, 1]] = np.arange(len(ears), 0, -1, dtype=np.int32)
    return Chain(plane, ring, lowest)
