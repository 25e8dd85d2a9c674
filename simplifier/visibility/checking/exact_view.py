"""Scene -> prisms that hold it -> which objects a point certainly sees.

What is found here is a proof of visibility: a line to a point of the object that passes above all
that the others reach up to.  Sets of visible objects are judged by it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray, IndexArray, IntArray, TriangleMesh
from simplifier.geometry.scene import NOTHING, WHOLE, Scene, axis_order, opaque_places
from simplifier.geometry.solid import BoolArray
from simplifier.kernels.exact_view import grid_edges, see_from
from simplifier.kernels.threads import run_chunks
from simplifier.options.simplify import Axis
from simplifier.progress import TellShare, silent

AZIMUTHS = 720
"""Even directions from each point, before it looks past corners."""

_REACH = 1e-9  # of the extent: beside a corner and along a wall rounding is far below it
_HAIR = 1e-7  # of the extent: so far beside corners lines are aimed
_GROW = 1e-6  # of the extent: edges are in all cells of the grid that are this near
_NEAR = 4.0  # mean distances of objects, within which all corners are aimed at
_CELLS = 4.0  # of the grid an object; fewer hold more edges, more take longer to walk through
_TOWARDS = np.array(
    [[0.0, 0.0, 1.0], *([x, y, 0.5] for x in (-1.0, 1.0) for y in (-1.0, 1.0))]
)  # directions in which the furthest vertices of an object are looked for


@dataclass(frozen=True, eq=False)
class Prisms:
    """A solid column for each object that holds it, and parts of the object to be seen; z up.

    The columns are right as occluders: each reaches from far below up to the highest point of its
    object, over its plan or, where the object is no upright prism with a flat top, over the convex
    hull of its plan.  Only of upright prisms the rim of the column's top is a part of the object.
    Of the others some vertices stand for it: the highest one, and those furthest out.  What one can
    see through has no column, or one that holds the opaque part alone.

    ``offsets``   (n + 1,) int64: the edges of each column.
    ``edges``     (e, 2, 2) float64: from corner to corner, the plan on their left.
    ``tops``      (n,) float64.
    ``upright``   (n,) bool: of upright prisms.
    ``points``    (p, 3) float64 of the objects ``point_of`` (p,) int32, which are not upright.
    ``origin``    (3,) float64: what was taken from the scene's coordinates, with z up.
    """

    offsets: IndexArray
    edges: FloatArray
    tops: FloatArray
    upright: BoolArray
    points: FloatArray
    point_of: IntArray
    origin: FloatArray

    @classmethod
    def of_outlines(
        cls, outlines: list[FloatArray], tops: FloatArray, upright: BoolArray | None = None
    ) -> Prisms:
        """From outlines (k, 2) that do not cross themselves, of upright prisms if not said else."""
        edges = [_counter_clockwise(_around(each)) for each in outlines]
        return cls(
            _starts(np.array([len(each) for each in edges], dtype=np.int64)),
            np.concatenate([np.empty((0, 2, 2)), *edges]),
            np.array(tops, dtype=np.float64),
            np.ones(len(outlines), dtype=np.bool_) if upright is None else upright,
            np.empty((0, 3)),
            np.empty(0, dtype=np.int32),
            np.zeros(3),
        )

    def __len__(self) -> int:
        return len(self.tops)

    @cached_property
    def boxes(self) -> FloatArray:
        """(n, 4) float64: low x, low y, high x, high y of each plan."""
        low, high = np.full((len(self), 2), np.inf), np.full((len(self), 2), -np.inf)
        for least, most in ((low, np.minimum), (high, np.maximum)):
            most.at(least, self.point_of, self.points[:, :2])
            for end in (0, 1):
                most.at(least, _owners(self), self.edges[:, end])
        return np.ascontiguousarray(np.concatenate([low, high], axis=1))

    @cached_property
    def extent(self) -> float:
        """The longest edge of the box around all, on which rounding depends."""
        sides = self.boxes[:, 2:].max(axis=0) - self.boxes[:, :2].min(axis=0)
        return float(max(*sides, np.ptp(self.tops)))

    @cached_property
    def spacing(self) -> float:
        """The mean distance of neighbouring objects in the plan."""
        sides = self.boxes[:, 2:].max(axis=0) - self.boxes[:, :2].min(axis=0)
        return float(max(np.sqrt(sides.prod() / len(self)), self.extent / 1000.0))

    @cached_property
    def grid(self) -> EdgeGrid:
        """The edges by cells of the plan."""
        return EdgeGrid.of(self)


@dataclass(frozen=True, eq=False)
class EdgeGrid:
    """Which edges of prisms are in which cell of a grid over the plan.

    ``low``      (2,) float64 corner, ``cell`` pitch.
    ``starts``   (nx ny + 1,) int64, ``items`` int64: edges of the cell x ny + y.
    ``highest``  (nx, ny) float64: the highest top of the prisms that have an edge there.
    """

    low: FloatArray
    cell: float
    starts: IndexArray
    items: IndexArray
    highest: FloatArray

    @classmethod
    def of(cls, prisms: Prisms) -> EdgeGrid:
        grow = _GROW * prisms.extent
        cell = prisms.spacing / np.sqrt(_CELLS)
        low = prisms.boxes[:, :2].min(axis=0) - 2.0 * grow
        sides = prisms.boxes[:, 2:].max(axis=0) + 2.0 * grow - low
        shape = np.maximum(np.ceil(sides / cell).astype(np.int64), 1)
        counts = np.zeros(int(shape.prod()) + 1, dtype=np.int64)
        none = np.empty(0, dtype=np.int64)
        grid_edges(prisms.edges, grow, low, cell, shape, counts, none, False)
        starts = np.cumsum(counts)
        items = np.empty(int(starts[-1]), dtype=np.int64)
        grid_edges(prisms.edges, grow, low, cell, shape, starts.copy(), items, True)
        highest = np.full(int(shape.prod()), -np.inf)
        cells = np.repeat(np.arange(len(highest)), np.diff(starts))
        np.maximum.at(highest, cells, prisms.tops[_owners(prisms)[items]])
        return cls(low, float(cell), starts, items, highest.reshape(tuple(shape)))


def seen_from(
    prisms: Prisms,
    eyes: FloatArray,
    azimuths: int = AZIMUTHS,
    *,
    near: float | None = None,
    margin: float = 0.0,
    tell: TellShare = silent,
) -> FloatArray:
    """(k, n) along which azimuth each eye sees each object, radians from x to y; NaN if not proven.

    ``eyes``      (k, 3) in the space of the prisms.  One that is within a prism sees nothing.
    ``azimuths``  that are looked along first; then past the corners of all objects that are seen or
                  no further away than ``near``, by default four mean distances of objects, and
                  past the corners of what is seen there.
    ``margin``    a length: of an edge or a point as much must be seen.

    All that is said to be seen is seen; narrow gaps that no corner leads to may be missed.
    """
    eyes = np.array(eyes, dtype=np.float64, order="C")
    golden = 0.5 * (np.sqrt(5.0) - 1.0)  # no wall of a plan along the axes is looked along
    angles = (np.arange(azimuths) + golden) * (2.0 * np.pi / max(azimuths, 1))
    return _looked(prisms, eyes, angles, near, margin, tell)


def seen_along(
    prisms: Prisms, eyes: FloatArray, angles: FloatArray, margin: float = 0.0
) -> FloatArray:
    """As :func:`seen_from`, but along these azimuths (m,) and at the objects' points alone."""
    eyes = np.array(eyes, dtype=np.float64, order="C")
    return _looked(prisms, eyes, np.array(angles, dtype=np.float64), -1.0, margin, silent)


def _looked(
    prisms: Prisms,
    eyes: FloatArray,
    angles: FloatArray,
    near: float | None,
    margin: float,
    tell: TellShare,
) -> FloatArray:
    found = np.full((len(eyes), len(prisms)), np.nan)
    if len(prisms) == 0:
        return found
    grid, owners, extent = prisms.grid, _owners(prisms), prisms.extent
    reach, near = _REACH * extent, _NEAR * prisms.spacing if near is None else near

    def work(begin: int, end: int) -> None:
        see_from(
            eyes, begin, end, angles, near, _HAIR * extent, reach, max(margin, reach),
            prisms.edges, owners, prisms.offsets, prisms.boxes, prisms.tops, prisms.upright,
            prisms.points, prisms.point_of, grid.starts, grid.items, grid.highest, grid.low,
            grid.cell, found,
        )  # fmt: skip

    run_chunks(work, len(eyes), tell=tell)
    return found


def _owners(prisms: Prisms) -> IntArray:
    """(e,) the prism of each edge."""
    return np.repeat(np.arange(len(prisms), dtype=np.int32), np.diff(prisms.offsets))


def _starts(counts: IndexArray) -> IndexArray:
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)


def prisms_of(scene: Scene, up: Axis, opaque: Scene | None = None) -> Prisms:
    """The columns that hold the objects, and what may be seen of them.

    ``opaque``  what of the objects one cannot see through, by their names; all of it by default.

    An object is an upright prism where its triangles are all in its highest plane, upright below
    the outline of those, or in its lowest plane with the same outline; corners that belong together
    have equal coordinates.  Winding does not matter.
    """
    order = axis_order(up)
    origin = scene.bounds()[:, 0].min(axis=0)[order]
    edges: list[FloatArray] = [np.empty((0, 2, 2))] * len(scene)
    tops = np.empty(len(scene))
    upright = np.zeros(len(scene), dtype=np.bool_)
    points: list[FloatArray] = [np.empty((0, 3))]
    point_of: list[int] = []
    outlines: dict[tuple[int, int, bool], IndexArray | None] = {}
    layer = scene if opaque is None else opaque
    for index, place in enumerate(opaque_places(scene, layer).tolist()):
        mesh = scene.meshes[scene.mesh_of[index]]
        linear = scene.transforms[index, :3, :3][order]
        shift = scene.transforms[index, :3, 3][order] - origin
        vertices = mesh.vertices @ linear.T + shift
        axis, outline = _upright_axis(linear), None
        if place == WHOLE and axis is None:
            outline = flat_outline(vertices, mesh.faces)
        elif place == WHOLE and axis is not None:
            key = int(scene.mesh_of[index]), axis, bool(linear[2, axis] > 0.0)
            if key not in outlines:
                outlines[key] = _outline_in_mesh(mesh, axis, key[2])
            outline = outlines[key]
        tops[index] = vertices[:, 2].max()
        if outline is not None:
            edges[index] = _counter_clockwise(vertices[outline, :2])
            upright[index] = True
        else:
            hiding = vertices
            if place >= 0:
                hiding = layer.joined([place]).vertices[:, order] - origin
                tops[index] = hiding[:, 2].max()
            if place != NOTHING:
                edges[index] = _hull(hiding[:, :2])
            some = np.unique(np.argmax(vertices @ _TOWARDS.T, axis=0))
            points.append(vertices[some])
            point_of += [index] * len(some)
    return Prisms(
        _starts(np.array([len(each) for each in edges], dtype=np.int64)),
        np.ascontiguousarray(np.concatenate([np.empty((0, 2, 2)), *edges])),
        tops,
        upright,
        np.concatenate(points),
        np.array(point_of, dtype=np.int32),
        np.asarray(origin),
    )


def _upright_axis(linear: FloatArray) -> int | None:
    """Which axis of a mesh alone gives height, and only that, if one does; ``linear`` (3, 3)."""
    axes = np.flatnonzero(linear[2])
    if len(axes) != 1 or linear[:2, axes[0]].any():
        return None
    return int(axes[0])


def _outline_in_mesh(mesh: TriangleMesh, axis: int, upwards: bool) -> IndexArray | None:
    """The outline of a mesh whose height is along an axis of its own, for all its instances."""
    order = [(axis + 1) % 3, (axis + 2) % 3, axis]
    points = mesh.vertices[:, order] * [1.0, 1.0, 1.0 if upwards else -1.0]
    return flat_outline(points, mesh.faces)


def flat_outline(points: FloatArray, faces: IntArray) -> IndexArray | None:
    """(e, 2) the edges of the flat top of an upright prism, as vertices; None of anything else.

    ``points``  (n, 3) with z up, ``faces`` (m, 3).  The top is on the left of each edge or, where
    coordinates are mirrored, on the right of all.
    """
    heights = points[:, 2]
    _, first, places = np.unique(points[:, :2], axis=0, return_index=True, return_inverse=True)
    plan = places.reshape(-1)[faces]
    walls = (plan == np.roll(plan, 1, axis=1)).any(axis=1)
    tops = (heights[faces] == heights.max()).all(axis=1) & ~walls
    floors = (heights[faces] == heights.min()).all(axis=1) & ~walls & ~tops
    if not tops.any() or not (walls | tops | floors).all():
        return None
    outline = _boundary(_turned(points[first, :2], plan[tops]))
    if outline is None:
        return None
    rim = _undirected(outline)
    below = _boundary(_turned(points[first, :2], plan[floors]))
    if below is None or (len(below) and _undirected(below) != rim):
        return None
    sides = plan[walls][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    if not _undirected(sides[sides[:, 0] != sides[:, 1]]) <= rim:
        return None
    return np.asarray(first[outline])


def _turned(plan: FloatArray, faces: NDArray[np.signedinteger]) -> IndexArray:
    """Faces (m, 3) so that all are counter-clockwise in the plan."""
    (ux, uy), (vx, vy) = ((plan[faces[:, side]] - plan[faces[:, 0]]).T for side in (1, 2))
    return np.asarray(np.where((ux * vy - uy * vx < 0.0)[:, None], faces[:, ::-1], faces))


def _boundary(faces: IndexArray) -> IndexArray | None:
    """(e, 2) the edges of counter-clockwise faces that no other face has the other way round.

    None where an edge is used twice the same way: faces lie above each other.
    """
    edges = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    here = {(int(a), int(b)) for a, b in edges}
    if len(here) < len(edges):
        return None
    outer = [edge for edge in sorted(here) if edge[::-1] not in here]
    return np.array(outer, dtype=np.int64).reshape(-1, 2)


def _undirected(edges: IndexArray) -> set[tuple[int, int]]:
    return {(int(a), int(b)) for a, b in np.sort(edges, axis=1)}


def _counter_clockwise(edges: FloatArray) -> FloatArray:
    """Edges (e, 2, 2) of an outline, turned round where its area is negative."""
    (ax, ay), (bx, by) = (edges[:, 0] - edges[0, 0]).T, (edges[:, 1] - edges[0, 0]).T
    return edges[:, ::-1] if np.sum(ax * by - ay * bx) < 0.0 else edges


def _hull(plan: FloatArray) -> FloatArray:
    """(e, 2, 2) edges around points (n, 2), counter-clockwise: their convex hull, or their box."""
    # Imported where it is used: it takes long, and most scenes need none.
    from scipy.spatial import ConvexHull, QhullError

    low, high = plan.min(axis=0), plan.max(axis=0)
    try:
        corners = plan[ConvexHull((plan - low) / max((high - low).max(), 1e-300)).vertices]
    except QhullError:
        corners = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
    return _around(corners)


def _around(corners: FloatArray) -> FloatArray:
    """(k, 2, 2) the edges from each of the corners (k, 2) to the next."""
    return np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
