"""How likely an object is visible, and that no strong occluder hides it, in a scene of spheres.

Cohen-Or et al., "Conservative Visibility and Strong Occlusion for Viewspace Partitioning of Densely
Occluded Scenes" (1998), section 4: spheres of a radius R below 1, one in each square (2D) or cube
(3D) of edge 2, seen from a cell of size 2 epsilon.  Between cell and object at a distance d about
K of them stand in the way; what they cover is taken as a strip of half width b, and m = R / b.

Some things are printed wrongly there.  Lemma 4.2 spreads the circles over a radius of 2R + epsilon;
its proof, and these formulas, have their centres within R + b of the middle, as Lemma 4.1 has those
of intervals.  The closed bound for what may be visible lacks the square of the logarithm that it is
divided by.
"""

from __future__ import annotations

from math import exp, log, pi

from simplifier.checks import check_length
from simplifier.errors import OptionError


def strip_between(radius: float, epsilon: float) -> float:
    """Half the width b of the strip between cell and object: the mean of both."""
    return 0.5 * (radius + epsilon)


def blockers_2d(distance: float, radius: float, epsilon: float) -> float:
    """K of equation 1: circles that reach into the trapezoid between cell and object."""
    return 0.25 * (3.0 * radius + epsilon) * distance


def blockers_3d(distance: float, radius: float, epsilon: float) -> float:
    """K of section 4.2: spheres that reach into the truncated cone."""
    square = 7.0 * radius**2 + 4.0 * epsilon * radius + epsilon**2
    return pi * distance / 24.0 * square


def visible_2d(blockers: float, ratio: float) -> float:
    """P1 of Lemma 4.1: ``blockers`` intervals, ``ratio`` (m, at least 1) times as long as another
    that all of them touch, together leave some of it bare."""
    _check(blockers, ratio)
    return min(float((blockers + 1.0) * (ratio + 1.0) ** -blockers), 1.0)


def not_strongly_occluded_2d(blockers: float, ratio: float) -> float:
    """P2 of Lemma 4.1: none of the intervals covers it by itself."""
    _check(blockers, ratio)
    return float((2.0 / (ratio + 1.0)) ** blockers)


def not_strongly_occluded_3d(blockers: float, ratio: float) -> float:
    """P2 of Lemma 4.2: none of ``blockers`` circles, ``ratio`` times as wide as another that all of
    them touch, covers it by itself."""
    _check(blockers, ratio)
    return float((4.0 * ratio / (1.0 + ratio) ** 2) ** blockers)


def most_visible_2d(radius: float, epsilon: float, near: float) -> float:
    """Bound for the number of visible circles: all up to a distance ``near``, and beyond it the
    integral of P1."""
    ratio, rate = _ratio_and_rate(radius, epsilon, near)
    steep = log(ratio + 1.0)
    reach = near * rate
    terms = 2.0 + (2.0 * reach + 1.0) * steep + (reach**2 + reach) * steep**2
    beyond = pi / (2.0 * rate**2 * steep**3) * exp(-steep * reach) * terms
    return 0.25 * pi * (epsilon + near) ** 2 + beyond


def most_not_strongly_occluded_2d(radius: float, epsilon: float, near: float) -> float:
    """Bound for the number of circles that no strong occluder hides: as above, of P2.

    Infinite where the cell is as large as the objects.
    """
    ratio, rate = _ratio_and_rate(radius, epsilon, near)
    if ratio <= 1.0:
        return float("inf")
    steep = log(0.5 * (ratio + 1.0))
    reach = near * rate
    beyond = 0.5 * pi * (1.0 + reach * steep) / (rate * steep) ** 2 * exp(-steep * reach)
    return 0.25 * pi * (epsilon + near) ** 2 + beyond


def _ratio_and_rate(radius: float, epsilon: float, near: float) -> tuple[float, float]:
    """m, and K for each unit of distance."""
    check_length("near", near)
    check_length("epsilon", epsilon)
    if not 0.0 < radius < 1.0:
        raise OptionError(
            f"{radius:g} is not a radius of spheres in cubes of edge 2", where="radius",
            remedy="choose one above 0 and below 1",
        )  # fmt: skip
    ratio = radius / strip_between(radius, epsilon)
    return ratio, blockers_2d(1.0, radius, epsilon)


def _check(blockers: float, ratio: float) -> None:
    check_length("blockers", blockers)
    if not ratio >= 1.0:
        raise OptionError(
            f"{ratio:g} is below 1: the cell is larger than the objects", where="ratio",
            remedy="choose a smaller cell",
        )  # fmt: skip
