"""Parts of buildings: walls with real openings, round towers, floors and roofs.

Metres, +y up.  Every builder makes one closed :class:`~examples.part.Part`, centred on
the y axis and standing on y = 0 unless it says otherwise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from examples.part import Part, joined, thickened, triangulated, triples
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.section import Loop

_WIDE_ARCH = 1.5  # metres; wider arches get eight edges, others four


@dataclass(frozen=True)
class Opening:
    """A hole through a wall: a door when ``sill`` is 0, else a window; metres.

    ``x``       its centre along the wall, from the wall's centre (degrees in a :func:`tube`).
    ``sill``    its low edge above the wall's foot.
    ``height``  from the sill to the top; of an arched one with the half circle that ends it.
    """

    x: float
    sill: float
    width: float
    height: float
    arched: bool = False

    def outline(self) -> list[tuple[float, float]]:
        """Clockwise from the lower left corner to the lower right one."""
        left, right = self.x - self.width / 2.0, self.x + self.width / 2.0
        top = self.sill + self.height
        if not self.arched:
            return [(left, self.sill), (left, top), (right, top), (right, self.sill)]
        radius = self.width / 2.0
        edges = 8 if self.width > _WIDE_ARCH else 4
        arch = [
            (self.x - radius * float(np.cos(turn)), top - radius + radius * float(np.sin(turn)))
            for turn in np.linspace(0.0, np.pi, edges + 1)
        ]
        return [(left, self.sill), *arch, (right, self.sill)]


def prism(rings: Sequence[ArrayLike], depth: float) -> Part:
    """A flat shape in (x, y), an outer ring with holes, drawn out along z and centred in z."""
    points, triangles = triangulated([np.asarray(ring, np.float64) for ring in rings])
    half = np.full((len(points), 1), depth / 2.0)
    return thickened(np.hstack([points, half]), np.hstack([points, -half]), triangles)


def box(width: float, height: float, depth: float) -> Part:
    """A block: x, y and z edge."""
    return wall(width, height, depth)


def slab(width: float, depth: float, thickness: float, holes: Sequence[ArrayLike] = ()) -> Part:
    """A floor with its top at y = 0; ``holes`` (n, 2) rings in (x, z), as for stairs."""
    part = prism([_rectangle(width, depth), *holes], thickness)
    x, z, y = part.vertices.T
    # (x, z, y) to (x, y, z) mirrors, so the winding is turned round.
    return Part(np.stack([x, y - thickness / 2.0, z], axis=1), part.faces[:, ::-1])


def wall(
    length: float,
    height: float,
    thickness: float,
    openings: Sequence[Opening] = (),
    top: Sequence[tuple[float, float]] = (),
) -> Part:
    """A straight wall along x with real openings; its face is +z.

    ``top``  (x, y) points at or above ``height``, right to left: :func:`battlements` or a gable.
    """
    return prism(_wall_rings(length, height, openings, top), thickness)


def tube(
    radius: float,
    height: float,
    thickness: float,
    sides: int,
    openings: Sequence[Opening] = (),
    merlons: int = 0,
) -> Part:
    """A round wall about the y axis: a straight one, bent until its ends meet.

    ``radius`` is the outer one.  An opening's ``x`` is its angle in degrees, 0 faces +z and 90 +x;
    it must keep clear of 180, where the ends meet, else :class:`ValueError`.
    """
    length = 2.0 * np.pi * radius
    straight = [replace(hole, x=hole.x / 360.0 * length) for hole in openings]
    if any(abs(hole.x) + hole.width / 2.0 >= length / 2.0 for hole in straight):
        raise ValueError("an opening crosses 180 degrees, where the wall's ends meet")
    rings = _wall_rings(length, height, straight, battlements(length, height, merlons))
    breaks = (np.arange(1, sides) / sides - 0.5) * length
    points, triangles = triangulated([np.asarray(ring) for ring in rings], breaks)
    outer, index = np.unique(_bent(points, radius), axis=0, return_inverse=True)
    share = 1.0 - thickness / radius
    return thickened(
        outer, outer * np.array([share, 1.0, share]), index.reshape(-1).astype(np.int32)[triangles]
    )


def revolved(profile: Sequence[tuple[float, float]], sides: int) -> Part:
    """A turned body: (radius, y) from its foot up; the first and the last point lie on the axis."""
    turn = np.arange(sides) * (2.0 * np.pi / sides)
    circle = np.stack([np.sin(turn), np.zeros(sides), np.cos(turn)], axis=1)
    rings = [r * circle + np.array([0.0, y, 0.0]) for r, y in profile[1:-1]]
    ends = np.array([[0.0, profile[0][1], 0.0], [0.0, profile[-1][1], 0.0]])
    here, there = np.arange(sides), np.roll(np.arange(sides), -1)
    last, foot = sides * (len(rings) - 1), sides * len(rings)
    faces = [triples(foot, there, here), triples(last + here, last + there, foot + 1)]
    for low in range(0, last, sides):
        high = low + sides
        faces.append(triples(low + here, low + there, high + there))
        faces.append(triples(low + here, high + there, high + here))
    return Part(np.concatenate([*rings, ends]), np.concatenate(faces).astype(np.int32))


def room(
    width: float,
    depth: float,
    height: float,
    thickness: float,
    openings: Sequence[Sequence[Opening]] = ((), (), (), ()),
    merlon_pitch: float = 0.0,
) -> Part:
    """Four walls around a rectangle, ``width`` along x and ``depth`` along z, outside measures.

    ``openings`` of the walls that face +z, +x, -z and -x; battlements where ``merlon_pitch`` is
    given, the wanted length of a merlon and a gap.
    """
    sides = []
    for quarter, holes in enumerate(openings):
        across, along = (depth, width) if quarter % 2 == 0 else (width, depth - 2.0 * thickness)
        merlons = max(1, round(along / merlon_pitch)) if merlon_pitch else 0
        side = wall(along, height, thickness, holes, battlements(along, height, merlons))
        sides.append(side.moved(z=(across - thickness) / 2.0).turned(quarter))
    return joined(sides)


def battlements(length: float, height: float, merlons: int) -> list[tuple[float, float]]:
    """Top of a wall, right to left: merlons 1 m high, gaps as wide, half a gap at either end."""
    points = []
    for index in range(merlons):
        right = length / 2.0 - (index + 0.25) * length / merlons
        left = right - length / merlons / 2.0
        points += [(right, height), (right, height + 1.0), (left, height + 1.0), (left, height)]
    return points


def _wall_rings(
    length: float,
    height: float,
    openings: Sequence[Opening],
    top: Sequence[tuple[float, float]],
) -> list[list[tuple[float, float]]]:
    """The outline, doors as notches in its foot, and a ring for each window."""
    half = length / 2.0
    doors = sorted((hole for hole in openings if hole.sill == 0.0), key=lambda hole: hole.x)
    foot = [point for door in doors for point in door.outline()]
    outline = [(-half, 0.0), *foot, (half, 0.0), (half, height), *top, (-half, height)]
    return [outline, *(hole.outline() for hole in openings if hole.sill > 0.0)]


def _rectangle(width: float, depth: float) -> Loop:
    return np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * [width / 2, depth / 2]


def _bent(points: FloatArray, radius: float) -> FloatArray:
    """(x, y) of a straight wall to the (x, y, z) of a round one; both ends get the same bits."""
    end = points[:, 0].max()
    turn = np.where(points[:, 0] == end, -np.pi, points[:, 0] * (np.pi / end))
    turn[points[:, 0] == -end] = -np.pi
    return np.stack([radius * np.sin(turn), points[:, 1], radius * np.cos(turn)], axis=1)
