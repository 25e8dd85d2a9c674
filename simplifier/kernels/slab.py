"""Points between two parallel planes, the slab that a thin mesh lies in."""

from __future__ import annotations

from simplifier.kernels.compiled.kernel import inner_kernel


@inner_kernel
def keep_between(point, slab):
    """Move ``point`` (3,) to the nearest place in a ``slab`` (5,): the normal of its planes, of
    length 1, and the least and the most along it."""
    along = slab[0] * point[0] + slab[1] * point[1] + slab[2] * point[2]
    off = min(max(along, slab[3]), slab[4]) - along
    if off != 0.0:
        for axis in range(3):
            point[axis] += off * slab[axis]
