"""Objects over pixels -> up to where each pixel is solid from the ground, by what all of them fill.

Any set of objects that stand on the ground, or on what is solid up to their base, is solid up to
the lowest of its roofs in a pixel that their plans cover together.  So the highest of what several
sets give is right, and which sets are tried is a matter of what is found.
"""

from __future__ import annotations

import numpy as np
import shapely

from simplifier.geometry.solid import BoolArray
from simplifier.visibility.solid.object_heights import Heights, ObjectHeights, covered_by

_STOREYS = 8  # objects on top of each other; what stands higher hides nothing

Standing = list[tuple[ObjectHeights, Heights]]
"""Objects and their roofs: minus infinite in pixels over which they do not stand."""


def solid_heights(made: list[ObjectHeights], shape: tuple[int, int]) -> tuple[Heights, float]:
    """(nx, ny) up to where each pixel is solid from the ground, all over; minus infinite where it
    is not.  And how much of what the objects fill that is, as pixels times height.

    What does not reach down to the ground stands on what is solid up to its base.
    """
    inner = np.full(shape, -np.inf, dtype=np.float32)
    standing: Standing = []
    raised = [one for one in made if one.plan is not None and one.needs > -np.inf]
    for storey in range(_STOREYS):
        before = standing
        standing = [
            (one, one.roofs) for one in made if one.plan is not None and one.needs == -np.inf
        ]
        standing += [some for one in raised if (some := _held(one, inner)) is not None]
        if storey > 0 and _as_many(before) == _as_many(standing):
            break
        for one, roofs in standing:
            own = np.where(one.covered & np.isfinite(roofs), roofs, -np.inf)
            inner[one.place] = np.maximum(inner[one.place], own)
        _fill_joints(standing, inner)
        if not raised:
            break
    kept = 0.0
    for one, roofs in standing:
        solid = one.inside & np.isfinite(roofs)
        kept += float((roofs[solid] - np.float64(one.low)).sum())
    return inner, kept


def _held(one: ObjectHeights, inner: Heights) -> tuple[ObjectHeights, Heights] | None:
    """An object that stands on what is solid somewhere, and its roofs there; None if nowhere."""
    held = inner[one.place] >= one.needs
    if not (held & one.covered).any():
        return None
    return one, np.where(held | np.isposinf(one.roofs), one.roofs, np.float32(-np.inf))


def _as_many(standing: Standing) -> int:
    return sum(int(np.isfinite(roofs).sum()) for _, roofs in standing)


def _fill_joints(standing: Standing, inner: Heights) -> None:
    """Where objects touch or overlap each other, none of them may cover a pixel, but all do.

    What is below others, a ground or a podium, would lower the walls between them.  So it is left
    out once what it takes part in is filled, and the others are looked at by themselves.
    """
    left = standing
    while len(left) > 1:
        _fill_together(left, inner)
        left = _above_others(left, inner.shape)


def _fill_together(left: Standing, inner: Heights) -> None:
    """Raise ``inner`` to the lowest roof where the objects cover pixels together."""
    least = np.full(inner.shape, np.inf, dtype=np.float32)
    for one, roofs in left:
        least[one.place] = np.minimum(least[one.place], roofs)
    start = np.zeros(2, dtype=np.int64)
    joint, _ = covered_by(shapely.union_all([one.plan for one, _ in left]), start, inner.shape)
    joint &= np.isfinite(least)
    np.maximum(inner, least, out=inner, where=joint)


def _above_others(standing: Standing, shape: tuple[int, ...]) -> Standing:
    """What stands over pixels that a lower object covers, without these lower ones; of what is
    piled up, the lowest alone are left out.
    """
    under = _under_others(standing, shape)
    floors = np.full(shape, np.inf, dtype=np.float32)
    for (one, roofs), some in zip(standing, under, strict=True):
        floors[one.place] = np.minimum(floors[one.place], np.where(some, roofs, np.inf))
    lowest = [
        bool(some.any() and (roofs <= floors[one.place])[some].all())
        for (one, roofs), some in zip(standing, under, strict=True)
    ]
    if not any(lowest):
        lowest = [bool(some.any()) for some in under]
    over = np.zeros(shape, np.bool_)
    for (one, _), some, out in zip(standing, under, lowest, strict=True):
        if out:
            over[one.place] |= some
    return [
        one
        for one, out in zip(standing, lowest, strict=True)
        if not out and (over[one[0].place] & np.isfinite(one[1])).any()
    ]


def _under_others(standing: Standing, shape: tuple[int, ...]) -> list[BoolArray]:
    """Of each object the pixels that it covers below a higher one."""
    # How many have a part in a pixel alone, and the higher of the roofs there.
    parts, highest = np.zeros(shape, np.uint8), np.full(shape, -np.inf, dtype=np.float32)
    for one, roofs in standing:
        some = np.isfinite(roofs) & ~one.covered
        parts[one.place] = np.minimum(parts[one.place], 254) + some
        highest[one.place] = np.maximum(highest[one.place], np.where(some, roofs, -np.inf))

    def below(one: ObjectHeights, roofs: Heights) -> BoolArray:
        under = one.covered & np.isfinite(roofs) & (parts[one.place] > 1)
        return np.asarray(under & (highest[one.place] > roofs))

    return [below(*one) for one in standing]
