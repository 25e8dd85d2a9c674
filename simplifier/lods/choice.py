"""Which levels of detail bring something: none that another could stand in for.

At a distance the levels that count are those whose error is small enough there, and each costs its
triangles and hides its share.  A level is in the chain when at some distance no other one that
counts there is as good:

- one that hides nothing is left out;
- a coarser level counts only where the finer one does, too: so it has to be cheaper by a tenth of
  the triangles, or to hide more;
- a finer level is there for its smaller error.  Where the coarser one is cheaper and hides as much
  and as rightly, and was measured to keep the finer one's error bound, it takes over that bound and
  the finer one is left out.

Recall and precision are shares of what there is to hide, so they do not depend on the distance.
"""

from __future__ import annotations

from dataclasses import dataclass

from simplifier.wording import percent

HIDES_MORE = 0.005
"""Recall that counts as a difference: about what two seeds of a search differ by."""

MORE_RIGHTLY = 0.001
"""Precision that counts as a difference."""

CHEAPER = 0.9
"""A level is cheaper when it has at most this share of the triangles."""


HIDES_NOTHING = "it hides nothing"


@dataclass(frozen=True)
class Figures:
    """What a level costs and gives; ``precision`` and ``recall`` from 0 to 1."""

    triangles: int
    precision: float
    recall: float

    @property
    def hides(self) -> bool:
        """Whether it hides anything to speak of."""
        return self.triangles > 0 and self.recall > HIDES_MORE


def why_useless(coarser: Figures, finer: Figures) -> str:
    """Why the coarser level brings nothing beside the finer one; empty when it does."""
    if not coarser.hides:
        return HIDES_NOTHING
    if _cheaper(coarser, finer) or coarser.recall > finer.recall + HIDES_MORE:
        return ""
    return (
        f"{coarser.triangles} triangles for {finer.triangles} and a recall of "
        f"{percent(coarser.recall)} for {percent(finer.recall)}: no better than the finer level"
    )


def why_replaced(finer: Figures, coarser: Figures) -> str:
    """Why the finer level brings nothing once the coarser keeps its error bound; or empty."""
    as_good = (
        coarser.recall >= finer.recall - HIDES_MORE
        and coarser.precision >= finer.precision - MORE_RIGHTLY
    )
    if not _cheaper(coarser, finer) or not as_good:
        return ""
    return (
        f"the coarser level of {coarser.triangles} triangles for {finer.triangles} keeps its error"
        f" bound, with a recall of {percent(coarser.recall)} for {percent(finer.recall)}"
    )


def _cheaper(coarser: Figures, finer: Figures) -> bool:
    return coarser.triangles <= CHEAPER * finer.triangles
