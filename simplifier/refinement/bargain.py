"""What a search pays for hiding too much, and how much room it has, round after round.

A search learns its own views by heart, and what sticks out by less than its pixels can show costs
it nothing.  So overhang is judged in finer pictures from elsewhere, and prices follow.
"""

from __future__ import annotations

import numpy as np

from simplifier.geometry.room import SURFACE, Room
from simplifier.kernels.soup_views import UNIT
from simplifier.options.stages import RefineOptions
from simplifier.refinement.annealing import Annealing, Prices, RefineViews
from simplifier.refinement.finalists import Outlines

_DEARER, _CHEAPER = 1.5, 0.8  # what a round changes the price by, at most
_DEAREST = 200 * UNIT
_OVERLOOKED = 1.5  # what is hidden wrongly in all views, beside those that the search looks from

_FINE = 800.0  # of a pixel past the outline at first: 25 units of twice a measure
_HIGHER, _LOWER = 2.0, 0.6  # what a round changes all fines by, at most and at first
_MOST, _LEAST = 64.0, 1.0 / _FINE  # times the first

_CLOSE = 0.85  # of the overhang asked for: what the search aims at, since views differ
_UNSEEN = 2.5  # times the overhang in the search's own pictures: that in fine ones
_SHOWN = 0.35  # of the aim: where its own pictures show less than that, fines do not reach the rest
_FAR, _SETTLED = 1.25, 0.7  # times the aim that call for less room, until that share of the search


class Bargain:
    """Prices that rise while too much is hidden wrongly or sticks out, and a room that narrows.

    Fines are in proportion to what share of a view's silhouette a pixel is, so that they price the
    mean of these shares.  Changes get smaller as the search cools: a late one could only take out
    triangles, not move them, and where pixels are too coarse for the precision that is asked for
    the price would rise without end.  What sticks out by less than the search's pixels can show is
    kept in by a narrower room.

    ``outlines``  where overhang is judged; None: by the search's own views.
    """

    def __init__(
        self, options: RefineOptions, views: RefineViews, outlines: Outlines | None, room: Room
    ) -> None:
        self.room = room
        self._least = self._price = round(UNIT * options.overcover)
        self._wrong = (1.0 - options.precision) / _OVERLOOKED
        self._overhang, self._outlines = options.overhang, outlines
        areas = np.maximum(np.bitwise_count(views.originals).sum(axis=1, dtype=np.int64), 1)
        self._fines = _FINE * areas.mean() / areas
        self._level = 1.0

    @property
    def prices(self) -> Prices:
        """As they are now."""
        if self._overhang >= 1.0:
            return Prices(self._price)
        fines = np.ceil(self._level * self._fines)
        return Prices(self._price, fines.astype(np.int64))

    def follow(self, search: Annealing, share: float) -> None:
        """Change by what a search hides wrongly and beside, ``share`` of the way through."""
        wrong = (1.0 - search.precision()) / max(self._wrong, 1e-9)
        if wrong > 1.0:
            change = min(wrong**0.5, _DEARER) ** (1.0 - share) ** 0.5
            self._price = min(int(self._price * change) + 1, _DEAREST)
        elif self._price > self._least:
            self._price = max(int(self._price * max(wrong, _CHEAPER)), self._least)
        if self._overhang < 1.0:
            self._follow_overhang(search, share)

    def _follow_overhang(self, search: Annealing, share: float) -> None:
        aim = max(_CLOSE * self._overhang, 1e-6)
        shown = float(search.overhang().mean())
        if self._outlines is None:
            found = _UNSEEN * shown
        else:
            found = float(self._outlines.overhang(search.current()).mean())
        warmth = 1.0 - share
        if found <= aim or shown > _SHOWN * aim:
            change = min(max(found / aim, _LOWER), _HIGHER) ** warmth
            self._level = min(max(self._level * change, _LEAST), _MOST)
        elif found > _FAR * aim and share < _SETTLED and self.room.limit > SURFACE:
            self.room = self.room.up_to(self.room.limit - 1)
