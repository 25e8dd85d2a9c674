"""The plan of a generated city: streets, blocks, and which buildings stand where in them.

Coordinates are (x, z) in metres around the middle of the city.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.random import Generator

from examples.city_models import Model
from examples.plan import Avenue, Rect, Spot, overlap, turned, within

PAVEMENT = 3.0  # metres between the kerb and the houses
_STREET, _WIDE_STREET = (12.0, 16.0), 26.0
_BLOCK = (60.0, 104.0)
_ROW_DEPTH = 12.0
_SHORTEST = 10.0  # of the row houses


@dataclass(eq=False)
class Builder:
    """Fills blocks with buildings; ``radius`` is that of the city, about."""

    generator: Generator
    models: Sequence[Model]
    radius: float
    avenue: Avenue = field(default_factory=Avenue)

    def __post_init__(self) -> None:
        kinds = {model.kind for model in self.models}
        self.of_kind = {
            kind: [i for i, model in enumerate(self.models) if model.kind == kind] for kind in kinds
        }

    def spots(self, block: Rect) -> list[Spot]:
        """The buildings of a block, apart from each other and from all streets."""
        free = block.inset(PAVEMENT)
        far = math.hypot(*block.centre) / self.radius
        if not self.avenue.crosses(block.corners()):
            return self._filled(free, far)
        return self._along_the_avenue(free, far)

    def _filled(self, free: Rect, far: float) -> list[Spot]:
        """Offices and towers in the middle, rows of houses around yards, then houses in gardens."""
        draw = self.generator.random()
        if draw < 1.25 - 2.7 * far:
            return self._lots(free, 56.0, ("tower", "tower", "office", "corner"))
        if far > 0.65 and draw < 0.16:
            return self._lots(free, 60.0, ("hall", "slab", "row"))
        if far > 0.55 and draw < 1.4 * far - 0.77:
            return self._lots(free, 20.0, ("house",))
        if draw > 0.76:
            return self._lots(free, 52.0, ("horseshoe", "courtyard", "slab", "corner"))
        yard = free.inset(_ROW_DEPTH + 4.0)
        if min(yard.width, yard.depth) > 22.0 and self.generator.random() < 0.6:
            return [*self._rows(free, far), *self._lots(yard, 32.0, ("row", "corner", "row"))]
        return self._rows(free, far)

    def _rows(self, free: Rect, far: float) -> list[Spot]:
        """Rows along all four sides; those to the east and west between the other two."""
        spots: list[Spot] = []
        for quarter in range(4):
            along, out = (free.width, free.depth) if quarter % 2 == 0 else (free.depth, free.width)
            length = along if quarter % 2 == 0 else along - 2.0 * (_ROW_DEPTH + 0.5)
            turn = quarter * math.pi / 2.0
            for model, at in self._row(length, far):
                offset = np.array([at, (out - self.models[model].depth) / 2.0]) @ turned(turn)
                x, z = np.array(free.centre) + offset
                spots.append(Spot(model, float(x), float(z), turn))
        return spots

    def _row(self, length: float, far: float) -> Iterator[tuple[int, float]]:
        """Row houses and where their middles are, from the middle of the row."""
        chosen: list[int] = []
        left = length
        rows = self.of_kind["row"]
        lowest = int(max(0.0, 0.9 - far) * 0.6 * len(rows))  # they are sorted by storeys
        while left >= _SHORTEST + 0.01:
            fit = [i for i in rows[lowest : lowest + 20] if self.models[i].width <= left - 0.01]
            chosen.append(fit[int(self.generator.integers(len(fit)))])
            left -= self.models[chosen[-1]].width
        passage = int(self.generator.integers(len(chosen) + 1))
        at = -length / 2.0
        for number, model in enumerate(chosen):
            at += left if number == passage else 0.0
            width = self.models[model].width
            yield model, at + width / 2.0
            at += width

    def _lots(self, free: Rect, largest: float, kinds: Sequence[str]) -> list[Spot]:
        """Halve the block until lots are small enough; one building in the middle of each."""
        if max(free.width, free.depth) > largest:
            share = self.generator.uniform(0.44, 0.56)
            x, z = free.x0 + share * free.width, free.z0 + share * free.depth
            if free.width > free.depth:
                halves = Rect(free.x0, free.z0, x, free.z1), Rect(x, free.z0, free.x1, free.z1)
            else:
                halves = Rect(free.x0, free.z0, free.x1, z), Rect(free.x0, z, free.x1, free.z1)
            return [spot for half in halves for spot in self._lots(half, largest, kinds)]
        return self._lot(free.inset(1.0), kinds)

    def _lot(self, lot: Rect, kinds: Sequence[str]) -> list[Spot]:
        """A building that fits, turned at random; of the last kind only where no other does."""
        for kind in [*self.generator.permutation(list(kinds[:-1])).tolist(), kinds[-1]]:
            own = self.of_kind[kind]
            model = own[int(self.generator.integers(len(own)))]
            width, depth = self.models[model].width, self.models[model].depth
            quarter = int(self.generator.integers(4))
            for turn in (quarter, quarter + 1):
                w, d = (width, depth) if turn % 2 == 0 else (depth, width)
                if w <= lot.width and d <= lot.depth:
                    return [Spot(model, *lot.centre, turn % 4 * math.pi / 2.0)]
        return []

    def _along_the_avenue(self, free: Rect, far: float) -> list[Spot]:
        """Houses that face the avenue, and of a usual block what does not meet it or them."""
        spots = [spot for side in (0, 1) for spot in self._avenue_side(free, side)]
        taken = [spot.corners(self.models) for spot in spots]
        for spot in self._rows(free, far):
            corners = spot.corners(self.models)
            if self.avenue.crosses(corners) or any(overlap(corners, other) for other in taken):
                continue
            spots.append(spot)
        return spots

    def _avenue_side(self, free: Rect, side: int) -> Iterator[Spot]:
        """March along one side of the avenue and put a house wherever one fits into the block."""
        turn = self.avenue.turn + math.pi * side
        along, out = turned(turn)
        reach = math.hypot(free.width, free.depth) / 2.0
        middle = float(along @ free.centre)
        at = middle - reach
        while at < middle + reach:
            rows = self.of_kind["row"]
            model = rows[int(self.generator.integers(len(rows) // 2, len(rows)))]
            width, depth = self.models[model].width, self.models[model].depth
            x, z = (at + width / 2.0) * along - (self.avenue.half + 2.0 + depth / 2.0) * out
            spot = Spot(model, float(x), float(z), turn)
            if within(spot.corners(self.models), free):
                yield spot
                at += width + 0.02
            else:
                at += 1.0


def blocks(generator: Generator, count: int) -> list[Rect]:
    """``count`` by ``count`` blocks, kerb to kerb, from the middle outwards, about in circles."""
    spans = [_spans(generator, count) for _ in range(2)]
    found = [Rect(x[0], z[0], x[1], z[1]) for x in spans[0] for z in spans[1]]
    spread = 60.0 * generator.random(len(found))
    order = np.argsort([math.hypot(*b.centre) + s for b, s in zip(found, spread, strict=True)])
    return [found[i] for i in order.tolist()]


def _spans(generator: Generator, count: int) -> list[tuple[float, float]]:
    """Where blocks begin and end along one axis; every fifth street is wide."""
    sizes = generator.uniform(*_BLOCK, count)
    streets = generator.uniform(*_STREET, count)
    streets[count // 2 % 5 :: 5] = _WIDE_STREET
    starts = np.cumsum(sizes + streets) - sizes
    starts -= starts[count // 2] + sizes[count // 2] / 2.0
    return [(float(low), float(low + size)) for low, size in zip(starts, sizes, strict=True)]
