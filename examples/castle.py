"""A generated castle: a mesh to try the library on, with much that makes occluders hard.

Walls of real thickness, but open at the ground as assets usually are; thin parapets with
battlements; slits, windows, doors and a gate that one can look through; rooms behind them; some
hundred pieces that overlap instead of being one surface.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence

import simplifier
from examples.building import (
    Opening,
    battlements,
    box,
    prism,
    revolved,
    room,
    slab,
    tube,
    wall,
)
from examples.part import Part, joined
from simplifier.geometry.mesh import TriangleMesh

_EAST, _SOUTH = 34.0, 28.0  # where the corner towers stand
_WALK = 8.0  # height of the curtain's wall walk
_STOREY = 5.5
_KEEP_DEPTH, _KEEP_WIDTH = 15.0, 19.0
_MERLON_PITCH = 2.4


def castle() -> TriangleMesh:
    """About 15,000 triangles, metres, +y up, the gate faces +z, nothing is below y = 0.

    Faces that would lie on the ground are left out, so each piece that stands on it is open there,
    at y = 0 exactly; all others are closed.  Wound outwards.  The same bytes on every call.
    """
    whole = joined([*_curtain(), *_corner_towers(), *_gatehouse(), _keep().moved(z=-6.0), *_yard()])
    grounded = (whole.vertices[whole.faces][:, :, 1] == 0.0).all(axis=1)
    return TriangleMesh.from_soup(whole.vertices, whole.faces[~grounded], where="castle")


def _curtain() -> Iterator[Part]:
    """Walls between the corner towers; the one to the south leaves room for the gatehouse."""
    yield _curtain_wall(2.0 * _EAST - 9.0).moved(z=_SOUTH).turned(2)
    for quarter in (1, 3):
        yield _curtain_wall(2.0 * _SOUTH - 9.0).moved(z=_EAST).turned(quarter)
    for side in (-1.0, 1.0):
        yield _curtain_wall(20.5).moved(x=19.25 * side, z=_SOUTH)


def _curtain_wall(length: float) -> Part:
    """A wall with slits, and a parapet that juts out over its outer face."""
    count = int(length // 6.0)
    slits = [Opening((index - (count - 1) / 2.0) * 6.0, 3.0, 0.4, 1.8) for index in range(count)]
    parapet = wall(length, 1.7, 0.7, (), battlements(length, 1.7, round(length / _MERLON_PITCH)))
    return joined([wall(length, _WALK, 2.4, slits), parapet.moved(y=_WALK - 0.6, z=1.2)])


def _corner_towers() -> Iterator[Part]:
    """Built for the corner at +x, +z, the door towards the yard, then turned."""
    slits = [Opening(angle, 5.0, 0.4, 1.8) for angle in (0.0, 90.0)]
    windows = [Opening(angle, 10.0, 0.9, 1.8, arched=True) for angle in (-60.0, 45.0, 150.0)]
    tower = _tower(
        5.5, 14.0, 8.5, 20, [Opening(-135.0, 0.0, 1.4, 2.6, arched=True), *slits, *windows]
    )
    corners = [(_EAST, _SOUTH), (_EAST, -_SOUTH), (-_EAST, -_SOUTH), (-_EAST, _SOUTH)]
    for quarter, (x, z) in enumerate(corners):
        yield tower.turned(quarter).moved(x=x, z=z)


def _tower(
    radius: float, height: float, roof: float, sides: int, openings: Sequence[Opening]
) -> Part:
    """A hollow round tower: floors within, a parapet around its deck, a pointed roof on it."""
    parts = [
        tube(radius, height, 0.2 * radius, sides, openings),
        tube(radius + 0.45, 1.8, 0.6, 1, merlons=sides // 2).moved(y=height - 0.7),
        _cone(radius - 0.15, roof, sides).moved(y=height),
    ]
    levels = [height, *(level for level in (4.4, 9.0) if level < height - 3.0)]
    return joined([*parts, *(_disc(0.9 * radius, 0.4, sides).moved(y=level) for level in levels)])


def _cone(radius: float, height: float, sides: int) -> Part:
    """A roof that flares at its eaves."""
    profile = [(0.0, 0.0), (radius, 0.0), (radius * 0.72, height * 0.2), (0.0, height)]
    return revolved(profile, sides)


def _disc(radius: float, thickness: float, sides: int) -> Part:
    """A round floor with its top at y = 0."""
    return revolved([(0.0, -thickness), (radius, -thickness), (radius, 0.0), (0.0, 0.0)], sides)


def _gatehouse() -> Iterator[Part]:
    """A vaulted passage between two towers, a chamber with windows above it."""
    windows = [Opening(x, 1.2, 0.9, 1.8, arched=True) for x in (-1.6, 1.6)]
    passage = wall(7.4, 6.6, 10.0, [Opening(0.0, 0.0, 4.2, 5.2, arched=True)])
    yield passage.moved(z=_SOUTH)
    yield room(7.4, 10.0, 4.4, 0.9, (windows, (), windows, ())).moved(y=6.6, z=_SOUTH)
    yield slab(7.0, 9.6, 0.4).moved(y=11.0, z=_SOUTH)
    yield room(8.2, 10.8, 1.7, 0.6, merlon_pitch=_MERLON_PITCH).moved(y=10.4, z=_SOUTH)
    slits = [Opening(angle, sill, 0.4, 1.8) for angle in (-45.0, 45.0) for sill in (3.0, 8.0)]
    for side in (-1.0, 1.0):
        door = Opening(-150.0 * side, 0.0, 1.1, 2.2)
        yield _tower(3.6, 12.5, 6.5, 14, [*slits, door]).moved(x=6.7 * side, z=_SOUTH + 2.5)


def _keep() -> Part:
    """Four storeys of rooms behind windows, turrets at the corners, a deck with battlements."""
    height = 4.0 * _STOREY
    shell = room(_KEEP_WIDTH, _KEEP_DEPTH, height, 1.6, _keep_openings())
    storeys = [_storey(level).moved(y=_STOREY * level) for level in range(4)]
    deck = slab(_KEEP_WIDTH - 1.0, _KEEP_DEPTH - 1.0, 0.5).moved(y=height)
    parapet = room(_KEEP_WIDTH + 0.8, _KEEP_DEPTH + 0.8, 1.8, 0.7, merlon_pitch=_MERLON_PITCH)
    turret = _tower(2.3, height + 3.5, 5.5, 10, [Opening(-135.0, height, 0.8, 2.0)])
    turrets = [
        turret.turned(quarter).moved(x=_KEEP_WIDTH / 2.0 * x, z=_KEEP_DEPTH / 2.0 * z)
        for quarter, (x, z) in enumerate([(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)])
    ]
    return joined([shell, *storeys, deck, parapet.moved(y=height - 0.7), *turrets])


def _keep_openings() -> list[list[Opening]]:
    """Windows on every storey; on the south side a door instead of the lowest middle one."""
    sides = [
        [
            Opening(x, _STOREY * level + 1.8, 1.2, 2.2, arched=True)
            for x in columns
            for level in range(4)
        ]
        for columns in ((-5.0, 0.0, 5.0), (-3.0, 3.0), (-5.0, 0.0, 5.0), (-3.0, 3.0))
    ]
    door = Opening(0.0, 0.0, 2.0, 3.2, arched=True)
    sides[0] = [door, *(hole for hole in sides[0] if (hole.x, hole.sill) != (0.0, 1.8))]
    return sides


def _storey(level: int) -> Part:
    """Two partitions with doorways make three rooms; the floor has a stairwell."""
    width, depth, height = _KEEP_WIDTH - 2.4, _KEEP_DEPTH - 2.4, _STOREY - 0.4
    doors = [Opening(x, 0.0, 1.1, 2.2) for x in (-5.0, 5.0)]
    along = wall(width, height, 0.5, doors)
    across = wall(depth / 2.0 - 0.5, height, 0.5, [Opening(0.0, 0.0, 1.1, 2.2)]).turned(1)
    across = across.moved(x=-2.5, z=-depth / 4.0)
    if level == 0:
        return joined([along, across])
    stairwell = [(5.2, -5.4), (7.6, -5.4), (7.6, -2.2), (5.2, -2.2)]
    return joined([along, across, slab(width, depth, 0.4, [stairwell])])


def _yard() -> Iterator[Part]:
    """A hall with a gabled roof, stairs to the wall walk, and a well."""
    yield _hall().turned(3).moved(x=23.0, z=-3.0)
    steps = [point for i in range(16) for point in ((0.6 * i, 0.5 * i), (0.6 * i, 0.5 * (i + 1)))]
    stairs = prism([[*steps, (11.0, _WALK), (11.0, 0.0)]], 2.0)
    yield stairs.turned(1).moved(x=-_EAST + 2.2, z=8.0)
    yield tube(1.4, 1.0, 0.4, 16).moved(x=-14.0, z=12.0)
    for side in (-1.2, 1.2):
        yield box(0.25, 3.0, 0.25).moved(x=-14.0 + side, z=12.0)
    yield revolved([(0.0, 3.0), (2.0, 3.0), (0.0, 4.6)], 16).moved(x=-14.0, z=12.0)


def _hall() -> Part:
    """18 m long, 9 m wide; its long front has a door and windows."""
    length, width, eaves, rise = 18.0, 9.0, 4.6, 4.2
    windows = [Opening(x, 1.4, 1.0, 2.0) for x in (-6.5, -3.5, 3.5, 6.5)]
    front = wall(length, eaves, 0.8, [Opening(0.0, 0.0, 1.8, 2.8, arched=True), *windows])
    gable = wall(width - 1.6, eaves, 0.8, (), [(0.0, eaves + rise * (1.0 - 1.6 / width))])
    overhang, thickness = 0.7, 0.5
    slope = rise / (width / 2.0)
    half = width / 2.0 + overhang
    low = eaves - overhang * slope
    rafters = [(-half, low), (0.0, eaves + rise), (half, low)]
    tiles = [(x, y + thickness) for x, y in reversed(rafters)]
    roof = prism([[*rafters, *tiles]], length + 1.2).turned(1)
    ends = [gable.moved(z=(length - 0.8) / 2.0).turned(quarter) for quarter in (1, 3)]
    sides = [front.moved(z=(width - 0.8) / 2.0).turned(quarter) for quarter in (0, 2)]
    return joined([roof, *ends, *sides])


def main() -> None:
    """``python -m examples.castle OUT``: write the castle in the format of the suffix."""
    if len(sys.argv) != 2:
        sys.exit("usage: python -m examples.castle OUT.obj")
    mesh = castle()
    simplifier.save(simplifier.Occluder(mesh.vertices, mesh.faces), sys.argv[1])


if __name__ == "__main__":
    main()
