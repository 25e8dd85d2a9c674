"""A generated city: a scene of many objects to try occluders on.

Blocks between streets that are nearly a grid, cut by an avenue; towers in the middle, rows of
houses around yards, houses in gardens at the rim; squares with trees; lamps along the streets.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.random import Generator

from examples.city_models import Model, building_models, lamp, slab, trees
from examples.city_plan import PAVEMENT, Builder, Rect, Spot, blocks, turned
from simplifier.errors import OutputError
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.scene import Scene
from simplifier.io import write_scene

_A_BLOCK = 13.0  # buildings, and with its streets
_A_BLOCK_SIDE = 97.0  # metres
_SQUARES = 0.04  # share of the blocks
_TREES, _LAMPS = 0.04, 0.03  # per building
_STREET = 13.0  # metres around a block that are paved
_TILE = 120.0
_AVENUE_PIECE = 100.0

Placed = tuple[int, FloatArray]  # a model's place and a transform (4, 4)


def city(buildings: int = 10_000, seed: int = 0) -> Scene:
    """A city of exactly that many buildings, of a thousand triangles each on average.

    Metres, +y up; the streets lie at y = 0, pavements and lawns a little above.  Every mesh is
    closed and wound outwards; buildings keep apart from each other and from all streets.  Objects
    are named by kind: "tower 3", "row 120", "tree 7", "lamp 1", "pavement 2", "lawn 1", "avenue 1",
    "ground 5".  ``buildings`` is at least 1; the same arguments give the same scene.
    """
    if buildings < 1:
        raise ValueError(f"{buildings} buildings: choose 1 or more")
    generator = np.random.default_rng(seed)
    models = _models(generator)
    radius = _A_BLOCK_SIDE * math.sqrt(buildings / _A_BLOCK / math.pi) + _A_BLOCK_SIDE
    builder = Builder(generator, models, radius)
    spots: list[Spot] = []
    used: list[Rect] = []
    lawns: list[Rect] = []
    for block in blocks(generator, 2 * math.ceil(1.5 * radius / _A_BLOCK_SIDE) + 5):
        used.append(block)
        if not builder.avenue.crosses(_corners(block)) and (
            not lawns or generator.random() < _SQUARES
        ):
            lawns.append(block.inset(PAVEMENT))
        else:
            spots += builder.spots(block)
        if len(spots) >= buildings:
            break
    placed = [(spot.model, _standing(spot.x, spot.z, spot.turn)) for spot in spots[:buildings]]
    if len(placed) < buildings:
        raise AssertionError("the plan has too few blocks")
    placed += _green(generator, models, lawns, round(_TREES * buildings))
    placed += _lamps(generator, models, used, builder, round(_LAMPS * buildings))
    placed += _ground(models, used, lawns, builder)
    return _scene(models, placed)


def _models(generator: Generator) -> list[Model]:
    ground = [
        slab("pavement", 1.0, 0.15, 1.0, 0.15),
        slab("lawn", 1.0, 0.25, 1.0, 0.25),
        slab("avenue", 1.0, 0.2, 1.0, 0.2),
        slab("ground", _TILE, 0.0, _TILE, 1.0),
    ]
    return [*building_models(generator), *trees(), lamp(), *ground]


def _corners(rect: Rect) -> FloatArray:
    return np.array(
        [[rect.x0, rect.z0], [rect.x1, rect.z0], [rect.x1, rect.z1], [rect.x0, rect.z1]]
    )


def _standing(
    x: float, z: float, turn: float = 0.0, width: float = 1.0, depth: float = 1.0
) -> FloatArray:
    """Stretch, turn about +y, move."""
    result = np.eye(4)
    result[np.ix_([0, 2], [0, 2])] = turned(turn).T * [width, depth]
    result[[0, 2], 3] = x, z
    return result


def _green(
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
        yield kind, _standing(x, z, generator.uniform(0.0, 2.0 * math.pi))


def _lamps(
    generator: Generator,
    models: Sequence[Model],
    used: Sequence[Rect],
    builder: Builder,
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
    clear = np.abs(builder.avenue.across(np.array(places)[:, :2])) > builder.avenue.half + 3.0
    free = [place for place, keep in zip(places, clear.tolist(), strict=True) if keep]
    for place in generator.permutation(len(free))[:count].tolist():
        yield kind, _standing(*free[place])


def _ground(
    models: Sequence[Model], used: Sequence[Rect], lawns: Sequence[Rect], builder: Builder
) -> Iterator[Placed]:
    """Pavements under blocks, lawns on squares, the avenue in pieces, and tiles below all."""
    place = {model.kind: i for i, model in enumerate(models)}
    for kind, rects in (("pavement", used), ("lawn", lawns)):
        for rect in rects:
            yield place[kind], _standing(*rect.centre, 0.0, rect.width, rect.depth)
    low, high = _spans(used)
    along = turned(builder.avenue.turn)[0]
    reach = float(np.abs([low, high]).max()) * math.sqrt(2.0)
    for at in np.arange(-reach, reach, _AVENUE_PIECE):
        x, z = (at + _AVENUE_PIECE / 2.0) * along
        if _near(low, high, x, z, _AVENUE_PIECE / 2.0):
            size = _AVENUE_PIECE, 2.0 * builder.avenue.half
            yield place["avenue"], _standing(x, z, builder.avenue.turn, *size)
    counts = np.ceil((high.max(axis=0) - low.min(axis=0)) / _TILE).astype(int)
    for i, j in np.ndindex(*counts):
        x, z = low.min(axis=0) + (np.array([i, j]) + 0.5) * _TILE
        if _near(low, high, x, z, _TILE / 2.0):
            yield place["ground"], _standing(x, z)


def _spans(used: Sequence[Rect]) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest (x, z) of the blocks with the streets around them, (n, 2) each."""
    rects = [rect.inset(-_STREET) for rect in used]
    low = np.array([[rect.x0, rect.z0] for rect in rects])
    return low, np.array([[rect.x1, rect.z1] for rect in rects])


def _near(low: FloatArray, high: FloatArray, x: float, z: float, reach: float) -> bool:
    """Whether a square around (x, z) meets any of the boxes."""
    place = np.array([x, z])
    return bool(((low < place + reach) & (high > place - reach)).all(axis=1).any())


def _scene(models: Sequence[Model], placed: Sequence[Placed]) -> Scene:
    """Only the models that stand somewhere."""
    chosen = np.array([model for model, _ in placed])
    used, mesh_of = np.unique(chosen, return_inverse=True)
    counts: dict[str, int] = {}
    names = []
    for model in chosen.tolist():
        kind = models[model].kind
        counts[kind] = counts.get(kind, 0) + 1
        names.append(f"{kind} {counts[kind]}")
    return Scene(
        tuple(models[model].mesh for model in used.tolist()),
        tuple(names),
        mesh_of.reshape(-1).astype(np.int32),
        np.array([transform for _, transform in placed]),
    )


def main() -> None:
    """``python -m examples.city OUT.glb``: write a city."""
    parser = argparse.ArgumentParser(prog="python -m examples.city", description=__doc__)
    parser.add_argument("out", metavar="OUT.glb")
    parser.add_argument("--buildings", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args()
    if chosen.buildings < 1:
        parser.error("--buildings must be 1 or more")
    try:
        write_scene(city(chosen.buildings, chosen.seed), chosen.out)
    except OutputError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
