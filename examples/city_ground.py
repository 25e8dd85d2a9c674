"""What a generated city has besides buildings: trees, lamps, pavements, lawns, ground."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.random import Generator

from examples.city_models import Model
from examples.city_plan import PAVEMENT
from examples.plan import Avenue, Rect, turned
from simplifier.geometry.mesh import FloatArray

TILE = 120.0  # metres, edge of a piece of ground
_STREET = 13.0  # around a block, half of the widest
_AVENUE_PIECE = 100.0

Placed = tuple[int, FloatArray]
"""A model's place in a list and a transform (4, 4)."""


def standing(
    x: float, z: float, turn: float = 0.0, width: float = 1.0, depth: float = 1.0
) -> FloatArray:
    """Stretch, turn about +y, move."""
    result = np.eye(4)
    result[np.ix_([0, 2], [0, 2])] = turned(turn).T * [width, depth]
    result[[0, 2], 3] = x, z
    return result


def green(
    generator: Generator, models: Sequence[Model], lawns: Sequence[Rect], count: int
) -> Iterator[Placed]:
    """Trees on the lawns, eight metres apart."""
    kinds = [i for i, model in enumerate(models) if model.kind == "tree"]
    places = [
        (x, z)
        for lawn in lawns
        for x in np.arange(lawn.x0 + 5.0, lawn.x1 - 4.0, 8.0)
        for z in np.arange(lawn.z0 + 5.0, lawn.z1 - 4.0, 8.0)
    ]
    for place in generator.permutation(len(places))[:count].tolist():
        x, z = np.array(places[place]) + generator.uniform(-1.0, 1.0, 2)
        kind = kinds[int(generator.integers(len(kinds)))]
        yield kind, standing(x, z, generator.uniform(0.0, 2.0 * math.pi))


def lamps(
    generator: Generator,
    models: Sequence[Model],
    used: Sequence[Rect],
    avenue: Avenue,
    count: int,
) -> Iterator[Placed]:
    """At the kerbs, the arm over the street; none on the avenue."""
    kind = next(i for i, model in enumerate(models) if model.kind == "lamp")
    places = []
    for block in used:
        x, z = block.centre
        edge = PAVEMENT / 6.0
        for share in (-0.3, 0.3):
            along_x, along_z = x + share * block.width, z + share * block.depth
            places += [(along_x, block.z1 - edge, 0.0), (block.x1 - edge, along_z, math.pi / 2.0)]
            places += [(along_x, block.z0 + edge, math.pi)]
            places += [(block.x0 + edge, along_z, 1.5 * math.pi)]
    clear = np.abs(avenue.across(np.array(places)[:, :2])) > avenue.half + 3.0
    free = [place for place, keep in zip(places, clear.tolist(), strict=True) if keep]
    for place in generator.permutation(len(free))[:count].tolist():
        yield kind, standing(*free[place])


def ground(
    models: Sequence[Model], used: Sequence[Rect], lawns: Sequence[Rect], avenue: Avenue
) -> Iterator[Placed]:
    """Pavements under blocks, lawns on squares, the avenue in pieces, and tiles below all."""
    place = {model.kind: i for i, model in enumerate(models)}
    for kind, rects in (("pavement", used), ("lawn", lawns)):
        for rect in rects:
            yield place[kind], standing(*rect.centre, 0.0, rect.width, rect.depth)
    low, high = _spans(used)
    along = turned(avenue.turn)[0]
    reach = float(np.abs([low, high]).max()) * math.sqrt(2.0)
    for at in np.arange(-reach, reach, _AVENUE_PIECE):
        x, z = (at + _AVENUE_PIECE / 2.0) * along
        if _near(low, high, x, z, _AVENUE_PIECE / 2.0):
            size = _AVENUE_PIECE, 2.0 * avenue.half
            yield place["avenue"], standing(x, z, avenue.turn, *size)
    counts = np.ceil((high.max(axis=0) - low.min(axis=0)) / TILE).astype(int)
    for i, j in np.ndindex(*counts):
        x, z = low.min(axis=0) + (np.array([i, j]) + 0.5) * TILE
        if _near(low, high, x, z, TILE / 2.0):
            yield place["ground"], standing(x, z)


def _spans(used: Sequence[Rect]) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest (x, z) of the blocks with the streets around them, (n, 2) each."""
    rects = [rect.inset(-_STREET) for rect in used]
    low = np.array([[rect.x0, rect.z0] for rect in rects])
    return low, np.array([[rect.x1, rect.z1] for rect in rects])


def _near(low: FloatArray, high: FloatArray, x: float, z: float, reach: float) -> bool:
    """Whether a square around (x, z) meets any of the boxes."""
    place = np.array([x, z])
    return bool(((low < place + reach) & (high > place - reach)).all(axis=1).any())
