"""What a generated city is built of: some hundred buildings, trees, lamps and slabs.

Metres, +y up.  Each model stands on y = 0 around the y axis, is made of closed pieces wound
outwards, and its front faces +z.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from examples.building import box, prism, revolved
from examples.facade import Facade, body, rectangle, storeys
from examples.part import Part, joined
from simplifier.geometry.mesh import FloatArray, TriangleMesh

OVERHANG = 0.4  # of eaves, over the street


@dataclass(frozen=True, eq=False)
class Model:
    """``width`` along x and ``depth`` along z of the ground it takes, eaves included."""

    kind: str
    mesh: TriangleMesh
    width: float
    depth: float

    @classmethod
    def of(cls, kind: str, part: Part) -> Model:
        # float32 numbers, so that a file keeps them.
        vertices = part.vertices.astype(np.float32).astype(np.float64)
        mesh = TriangleMesh.from_soup(vertices, part.faces, where=kind)
        width, _, depth = 2.0 * np.abs(mesh.bounds).max(axis=0)
        return cls(kind, mesh, float(width), float(depth))


def building_models(generator: Generator) -> list[Model]:
    """117 models; of each kind several, no two alike."""
    kinds: tuple[tuple[str, int, Callable[[Generator, int], Part]], ...] = (
        ("house", 14, _house),
        ("row", 40, _row),
        ("corner", 8, _corner),
        ("horseshoe", 8, _horseshoe),
        ("courtyard", 8, _courtyard),
        ("slab", 8, _slab),
        ("hall", 5, _hall),
        ("office", 12, _office),
        ("tower", 14, _tower),
    )
    return [
        Model.of(kind, make(generator, index))
        for kind, count, make in kinds
        for index in range(count)
    ]


def trees() -> list[Model]:
    """A round one, a tall one and a fir."""
    trunk = revolved([(0.0, 0.0), (0.25, 0.0), (0.18, 3.0), (0.0, 3.0)], 5)
    crowns = (
        [(0.0, 2.2), (1.9, 3.0), (2.6, 4.8), (1.7, 6.6), (0.0, 7.2)],
        [(0.0, 2.0), (1.2, 3.2), (1.7, 6.0), (1.1, 9.0), (0.0, 11.0)],
        [(0.0, 1.2), (2.3, 1.6), (1.2, 4.0), (0.0, 9.0)],
    )
    return [Model.of("tree", joined([trunk, revolved(crown, 8)])) for crown in crowns]


def lamp() -> Model:
    """A post with an arm."""
    post = revolved([(0.0, 0.0), (0.09, 0.0), (0.06, 5.6), (0.0, 5.6)], 5)
    arm = box(0.2, 0.12, 1.4).moved(y=5.5, z=0.55)
    return Model.of("lamp", joined([post, arm]))


def slab(kind: str, width: float, top: float, depth: float, thickness: float) -> Model:
    """A flat block whose top lies at ``top``, for streets, pavements and lawns."""
    return Model.of(kind, body([rectangle(width, depth)], top - thickness, top))


def _house(generator: Generator, index: int) -> Part:
    width, depth = generator.uniform(8.0, 12.0), generator.uniform(8.0, 10.0)
    height, rows = storeys(1 + index % 2, ground=3.2)
    shell = body([rectangle(width, depth)], 0.0, height, Facade(rows, 1.1, 2.0))
    roof = (_gable if index % 3 else _hip)(width, depth, height, 0.9)
    return joined([shell, roof, _chimney(width, height, 3.0)])


def _row(generator: Generator, index: int) -> Part:
    """Between blank walls to both sides, 11.2 m deep without its eaves."""
    width = 10.0 + 1.5 * (index % 8)
    height, rows = storeys(3 + index // 8, height=generator.uniform(3.0, 3.5))
    facade = Facade(rows, generator.uniform(0.9, 1.3), generator.uniform(1.9, 2.5))
    shell = body([rectangle(width, 11.2)], 0.0, height, facade, blank=(1, 3))
    if index % 4 == 3:
        return joined([shell, _hut(5.0, 2.6, 4.0, height)])
    roof = _gable(width, 11.2, height, generator.uniform(0.55, 0.95), sides=0.0)
    return joined([shell, roof, _chimney(width, height, 4.2)])


def _corner(generator: Generator, index: int) -> Part:
    a, wing = generator.uniform(10.0, 13.0), 10.0
    height, rows = storeys(4 + index % 4)
    ring = [(-a, -a), (a, -a), (a, wing - a), (wing - a, wing - a), (wing - a, a), (-a, a)]
    shell = body([ring], 0.0, height, Facade(rows, 1.4, generator.uniform(3.0, 3.8)))
    return joined([shell, _hut(4.0, 3.0, 4.0, height).moved(x=4.0 - a, z=a - 5.0)])


def _horseshoe(generator: Generator, index: int) -> Part:
    a, b, wing = generator.uniform(17.0, 21.0), generator.uniform(13.0, 17.0), 9.5
    height, rows = storeys(4 + index % 4)
    ring = [
        (-a, -b), (a, -b), (a, b), (a - wing, b),
        (a - wing, wing - b), (wing - a, wing - b), (wing - a, b), (-a, b),
    ]  # fmt: skip
    shell = body([ring], 0.0, height, Facade(rows, 1.8, generator.uniform(3.8, 4.6)))
    return joined([shell, _hut(8.0, 2.8, 4.0, height).moved(z=b - 5.0)])


def _courtyard(generator: Generator, index: int) -> Part:
    width, depth = generator.uniform(34.0, 44.0), generator.uniform(32.0, 40.0)
    height, rows = storeys(4 + index % 3)
    court = rectangle(width - 22.0, depth - 22.0)[::-1]
    facade = Facade(rows, 2.0, generator.uniform(4.4, 5.4))
    shell = body([rectangle(width, depth), court], 0.0, height, facade)
    return joined([shell, _hut(6.0, 3.0, 4.0, height).moved(z=depth / 2.0 - 5.5)])


def _slab(generator: Generator, index: int) -> Part:
    length = generator.uniform(34.0, 48.0)
    height, rows = storeys(6 + index, height=3.0)
    wide = Facade(rows, 0.0) if index % 2 else Facade(rows, 2.6, 5.6)
    shell = body([rectangle(length, 12.0)], 0.0, height, wide)
    huts = [_hut(4.0, 2.8, 5.0, height).moved(x=x) for x in (-length / 4.0, length / 4.0)]
    return joined([shell, *huts])


def _hall(generator: Generator, index: int) -> Part:
    width, depth = generator.uniform(24.0, 30.0), generator.uniform(34.0, 44.0)
    height = 6.5 + index
    shell = body(
        [rectangle(width, depth)], 0.0, height, Facade(((height - 2.5, height - 1.0),), 0.0)
    )
    if index % 2:
        return joined([shell, _gable(width, depth, height, 0.3)])
    return joined([shell, *(_hut(3.0, 1.5, 2.0, height).moved(z=z) for z in (-10.0, 0.0, 10.0))])


def _office(generator: Generator, index: int) -> Part:
    """Two or three tiers, each set back from the one below; ribbons of glass."""
    width, depth = generator.uniform(24.0, 36.0), generator.uniform(22.0, 32.0)
    bands = Facade(tuple((y + 1.1, y + 3.0) for y in np.arange(0.0, 80.0, 3.6)), 0.0)
    tiers = 2 + index % 2
    heights = np.cumsum([3.6 * generator.integers(3, 8) for _ in range(tiers)]) + 0.5
    return _tiered(_setbacks(width, depth, tiers, 3.5), heights, bands, hut=6.0)


def _tower(generator: Generator, index: int) -> Part:
    """A shaft of 60 to 150 m on a podium; glass in bands, in strips or in a grid."""
    side = generator.uniform(20.0, 28.0)
    height = 60.0 + 90.0 * index / 13.0
    podium = 12.0 + 4.0 * (index % 3)
    bands = Facade(tuple((y + 1.2, y + 6.4) for y in np.arange(0.0, 160.0, 7.2)), 0.0, recess=0.5)
    grid = Facade(tuple((y + 1.2, y + 9.6) for y in np.arange(0.0, 160.0, 10.8)), 2.2, 3.6)
    strips = Facade(((1.5, podium - 1.5), (2.5, 0.62 * height - podium - 2.0)), 1.2, 2.4, 0.6)
    plans = [(side + 14.0, side + 10.0), (side, side), (side - 5.0, side - 5.0)]
    shaft = 0.62 * height if index % 2 else height - 12.0
    heights = np.array([podium, shaft, height])
    mast = revolved([(0.0, 0.0), (0.5, 0.0), (0.1, 14.0), (0.0, 14.0)], 6).moved(y=height + 2.0)
    whole = _tiered(plans, heights, (bands, grid, strips)[index % 3], hut=7.0)
    return joined([whole, mast]) if index % 4 == 3 else whole


def _setbacks(width: float, depth: float, tiers: int, step: float) -> list[tuple[float, float]]:
    return [(width - 2.0 * step * tier, depth - 2.0 * step * tier) for tier in range(tiers)]


def _tiered(
    plans: Iterable[tuple[float, float]], heights: FloatArray, facade: Facade, hut: float
) -> Part:
    """Boxes on each other; ``heights`` of their tops."""
    feet = [0.0, *heights[:-1]]
    tiers = [
        body([rectangle(*plan)], low, high, facade)
        for plan, low, high in zip(plans, feet, heights, strict=True)
    ]
    return joined([*tiers, _hut(hut, 3.2, hut, float(heights[-1]))])


def _gable(width: float, depth: float, eaves: float, slope: float, sides: float = OVERHANG) -> Part:
    """A roof with its ridge along x that hangs over to the front and back, and to the ``sides``."""
    half = depth / 2.0
    low = eaves - slope * OVERHANG
    edge = [(-half - OVERHANG, low), (half + OVERHANG, low), (0.0, eaves + slope * half)]
    return prism([edge], width + 2.0 * sides).turned(1)


def _hip(width: float, depth: float, eaves: float, slope: float) -> Part:
    """A roof that slopes to all four sides; a ridge along x or, over a square plan, a point."""
    x, z = width / 2.0 + OVERHANG, depth / 2.0 + OVERHANG
    ridge, low = max(x - z, 0.5), eaves - slope * OVERHANG
    foot = [[-x, low, z], [x, low, z], [x, low, -z], [-x, low, -z]]
    top = [[-ridge, low + slope * z, 0.0], [ridge, low + slope * z, 0.0]]
    faces = [[0, 1, 5], [0, 5, 4], [1, 2, 5], [2, 3, 4], [2, 4, 5], [3, 0, 4], [0, 2, 1], [0, 3, 2]]
    return Part(np.array(foot + top), np.array(faces, dtype=np.int32))


def _chimney(width: float, height: float, rise: float) -> Part:
    return box(0.9, rise, 0.7).moved(x=width / 4.0, y=height, z=-1.6)


def _hut(width: float, height: float, depth: float, foot: float) -> Part:
    """What lifts and machines need on a roof."""
    return box(width, height, depth).moved(y=foot)
