"""Strong occluders of a cell -> a plan: which convex bodies hide how many objects by themselves.

Cohen-Or et al., "Conservative Visibility and Strong Occlusion for Viewspace Partitioning of Densely
Occluded Scenes" (1998), figure 6, has what is hidden; here are those that hide it as well.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.pvs import Pvs
from simplifier.visibility.pictures.framed_figure import PIXELS
from simplifier.visibility.pictures.pictures import (
    CELL,
    HIDDEN,
    coloured,
    plan_letters,
    set_sizes,
    window_around,
)
from simplifier.visibility.pictures.plan import Plan
from simplifier.visibility.pictures.plan_figure import STREET, PlanFigure
from simplifier.visibility.strong.strong_occluders import StrongOccluders
from simplifier.wording import count, picture_line

LEFT = "#9fc3dd"
"""Of what no body hides by itself."""

SHADES = ("#fde0a0", "#f3a24a", "#d1531b", "#7f2704")
"""Of what hides: the more, the darker."""

_STEPS = (1, 3, 10, 30)  # objects that a body hides, from which on it has its shade
_HIDDEN, _LEFT, _FIRST = 1, 2, 3


def strong_picture(upright: UprightScene, pvs: Pvs, occluders: StrongOccluders, name: str) -> bytes:
    """PNG of the cell with the median set: objects by how many others their bodies hide wholly.

    ``pvs`` and the targets of ``occluders`` are of this scene in its upright space.
    """
    sizes = set_sizes(pvs)
    done = pvs.computed[np.argsort(sizes[pvs.computed], kind="stable")]
    cell = int(done[len(done) // 2])
    found = occluders.hide(pvs.cells.some(np.array([cell])))
    hidden, hides = found.hidden[0], hidden_by(occluders, found.by[0])
    kinds = np.where(hidden, _HIDDEN, _LEFT)
    kinds = np.where(hides > 0, _FIRST - 1 + np.searchsorted(_STEPS, hides, "right"), kinds)
    low, high = window_around(upright, pvs, cell, kinds != _HIDDEN)
    plan = Plan.of(upright, kinds.astype(np.uint8), low, high, PIXELS)
    strong = hides[hides > 0]
    figure = PlanFigure(
        low, high, origin=upright.origin, letters=plan_letters(pvs),
        title=f"{picture_line(name)}: strong occluders of cell {cell}",
        lines=f"{int(hidden.sum()):,} of {count(len(hidden), 'object')} are hidden from all of the"
        f" cell, {int(strong.sum()):,} of them wholly by one of {len(strong):,} others alone,\n"
        f"of which the strongest hides {int(strong.max(initial=0)):,}.",
    )  # fmt: skip
    figure.show(plan.picture(coloured(plan, (STREET, HIDDEN, LEFT, *SHADES), 0.62)))
    figure.draw_cell(pvs.cells.outline(cell), CELL)
    figure.legend([
        (CELL, "the cell"), (HIDDEN, "hidden"), (LEFT, "left open"),
        *zip(SHADES, _words(), strict=True),
    ])  # fmt: skip
    return figure.png()


def hidden_by(occluders: StrongOccluders, by: NDArray[np.int64]) -> NDArray[np.int64]:
    """(n,) how many targets the bodies of each target hide, by the body that hides each (n,)."""
    owners = np.searchsorted(occluders.body_starts, by[by >= 0], "right") - 1
    return np.bincount(owners, minlength=len(by))


def _words() -> list[str]:
    ends = [f"{low} to {high - 1}" for low, high in pairwise(_STEPS)]
    return [f"hides {ends[0]}", *ends[1:], f"{_STEPS[-1]} or more"]
