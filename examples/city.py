"""A generated city: a scene of many objects to try occluders on.

Blocks between streets that are nearly a grid, cut by an avenue; towers in the middle, rows of
houses around yards, houses in gardens at the rim; squares with trees; lamps along the streets.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence

import numpy as np
from numpy.random import Generator

from examples.city_ground import TILE, Placed, green, ground, lamps, standing
from examples.city_models import Model, building_models, lamp, slab, trees
from examples.city_plan import PAVEMENT, Builder, blocks
from examples.plan import Rect, Spot
from simplifier.errors import OutputError
from simplifier.geometry.scene import Scene
from simplifier.io.scene_writer import write_scene

_A_BLOCK = 13.0  # buildings, and with its streets
_A_BLOCK_SIDE = 97.0  # metres
_SQUARES = 0.04  # share of the blocks
_TREES, _LAMPS = 0.04, 0.03  # per building


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
    spots, used, lawns = _built(builder, buildings)
    placed = [(spot.model, standing(spot.x, spot.z, spot.turn)) for spot in spots]
    placed += green(generator, models, lawns, round(_TREES * buildings))
    placed += lamps(generator, models, used, builder.avenue, round(_LAMPS * buildings))
    placed += ground(models, used, lawns, builder.avenue)
    return _scene(models, placed)


def _built(builder: Builder, buildings: int) -> tuple[list[Spot], list[Rect], list[Rect]]:
    """Where the buildings stand, the blocks that they took, and the lawns of squares.

    The first block beside the avenue is a square.
    """
    spots: list[Spot] = []
    used: list[Rect] = []
    lawns: list[Rect] = []
    # More than twice the blocks that are needed.
    for block in blocks(builder.generator, 2 * math.ceil(1.5 * builder.radius / _A_BLOCK_SIDE) + 5):
        used.append(block)
        square = not lawns or builder.generator.random() < _SQUARES
        if square and not builder.avenue.crosses(block.corners()):
            lawns.append(block.inset(PAVEMENT))
        else:
            spots += builder.spots(block)
        if len(spots) >= buildings:
            break
    return spots[:buildings], used, lawns


def _models(generator: Generator) -> list[Model]:
    ground = [
        slab("pavement", 1.0, 0.15, 1.0, 0.15),
        slab("lawn", 1.0, 0.25, 1.0, 0.25),
        slab("avenue", 1.0, 0.2, 1.0, 0.2),
        slab("ground", TILE, 0.0, TILE, 1.0),
    ]
    return [*building_models(generator), *trees(), lamp(), *ground]


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
