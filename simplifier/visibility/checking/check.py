"""Scene and its sets of visible objects -> what they lack, and how much too large they are.

Random viewpoints hardly find a set that is too small.  So most of them lie on the upper edges of
the cells, which see most, and look past the corners of what is there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from simplifier.checks import check_length, check_whole
from simplifier.errors import CancelledError, OptionError, SceneError
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.pvs import Pvs
from simplifier.geometry.scene import Scene, axis_order
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.view_cells import PRISM, ViewCells
from simplifier.progress import Cancel, TellShare, silent
from simplifier.visibility.checking.exact_view import AZIMUTHS, prisms_of, seen_from
from simplifier.visibility.checking.hidden_parts import HiddenParts
from simplifier.visibility.checking.panorama import Panorama
from simplifier.visibility.checking.terrain_view import terrain_seen_from
from simplifier.visibility.solid.closed_pieces import (
    closed_pieces,
    floor_of,
    is_within,
    without_halls,
)
from simplifier.visibility.solid.terrain import Terrain

_ON_TOP = 0.75  # share of the viewpoints that lie on upper edges
_WITHIN = 1e-3  # of the way to the middle, for pictures: a wall may touch the cell
_MOST = 1_000_000

Proof = Literal["line", "slice", "picture"]


@dataclass(frozen=True)
class CheckOptions:
    """How closely sets are looked at.

    ``cells``     that are drawn by lot, all where there are fewer; more find rarer faults.
    ``views``     viewpoints in each cell; more find more of what is visible.
    ``azimuths``  even directions from each viewpoint, before it looks past corners.
    ``margin``    a length, world units: as much of an edge must be seen; 0 finds every glimpse.
    ``pictures``  viewpoints in each cell from which pictures are drawn as well, for scenes whose
                  objects are no upright prisms; each takes as long as drawing the scene six times.
    ``pixels``    along an edge of a picture; finer ones see smaller things.
    ``ground``    whether there is ground below the objects in pictures.
    ``seed``      of the lots.

    Raises :class:`~simplifier.errors.OptionError`.
    """

    cells: int = 50
    views: int = 60
    azimuths: int = AZIMUTHS
    margin: float = 0.0
    pictures: int = 0
    pixels: int = 512
    ground: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        check_whole("cells", self.cells, 1, _MOST)
        check_whole("views", self.views, 1, _MOST)
        check_whole("azimuths", self.azimuths, 0, _MOST)
        check_whole("pictures", self.pictures, 0, _MOST)
        check_whole("pixels", self.pixels, 2, 16_384)
        check_length("margin", self.margin)


@dataclass(frozen=True)
class Leak:
    """An object that a viewpoint of the cell certainly sees, and that is not in the cell's set, or
    has an altitude above the viewpoint, or one of whose hidden slices it sees.

    ``viewpoint``  x, y, z in the world; ``direction`` a unit vector from there: along a line of the
                   plan over whatever height shows the object, or through a pixel that shows it.
    ``proof``      what found it: a line to the object, one to a point in its hidden slices, or a
                   picture.
    """

    cell: int
    name: str
    viewpoint: tuple[float, float, float]
    direction: tuple[float, float, float]
    proof: Proof


@dataclass(frozen=True)
class CellCheck:
    """A cell, counted in objects.

    ``visible``  in its set.
    ``seen``     certainly, by its viewpoints; ``proven`` of these are in the set.
    ``bytes``    of its row.
    """

    cell: int
    visible: int
    seen: int
    proven: int
    bytes: int
    leaks: tuple[Leak, ...]


@dataclass(frozen=True)
class Check:
    """What was found in some cells.

    ``objects``     of the scene.
    ``row_bytes``   of all rows of the sets, each once, divided by the cells that are computed.
    ``rows``        by cell, ascending.
    """

    objects: int
    row_bytes: float
    rows: tuple[CellCheck, ...]

    @property
    def leaks(self) -> tuple[Leak, ...]:
        """Of all cells; none says that none was found."""
        return tuple(leak for row in self.rows for leak in row.leaks)

    @property
    def excess(self) -> float:
        """Size of the sets for one object that is seen; infinite where none is.

        The sets are at most so many times too large, since more is visible than was seen.
        """
        seen = sum(row.seen for row in self.rows)
        return sum(row.visible for row in self.rows) / seen if seen else float("inf")

    @property
    def proven_share(self) -> float:
        """Of the sets' objects, those that are certainly seen; 1 where the sets are empty."""
        visible = sum(row.visible for row in self.rows)
        return sum(row.proven for row in self.rows) / visible if visible else 1.0

    @property
    def culled_share(self) -> float:
        """Of all objects, those that are not in the sets, a mean over the cells."""
        return 1.0 - sum(row.visible for row in self.rows) / (self.objects * len(self.rows))


def check_pvs(
    scene: Scene,
    pvs: Pvs,
    options: CheckOptions | None = None,
    tell: TellShare = silent,
    cancel: Cancel | None = None,
    opaque: Scene | None = None,
    terrain: Terrain | None = None,
) -> Check:
    """Look from points of some cells for what is certainly visible, and compare it with their sets.

    ``opaque``  what of the scene one cannot see through, by the objects' names; all by default.
    ``terrain``  what the scene was made of, if it is one: lines then pass over its triangles.

    Once ``cancel`` is set the cells checked by then are returned, or, if there is none,
    :class:`CancelledError` raised.  Raises :class:`SceneError` where the sets are not of the scene,
    and :class:`OptionError` where no cell is computed.
    """
    options = options or CheckOptions()
    if pvs.names != scene.names:
        raise SceneError(
            "its objects are not those of the scene", where="set of visible objects",
            remedy="compute it for this scene",
        )  # fmt: skip
    known = pvs.computed
    if len(known) == 0:
        raise OptionError(
            "no cell is computed", where="set of visible objects", remedy="compute some"
        )
    generator = np.random.default_rng(options.seed)
    count = min(options.cells, len(known))
    chosen = np.sort(generator.choice(known, count, replace=False))
    judge = _Judge(scene, pvs, options, opaque, terrain)
    rows = []
    for done, cell in enumerate(chosen.tolist()):
        if cancel is not None and cancel.is_set():
            break
        tell(done / count)
        places = viewpoints(pvs.cells, cell, options.views, generator)
        if pvs.altitudes is not None:  # upper edges alone would not tell whether these are right
            heights = pvs.cells.low[cell, 2], pvs.cells.high[cell, 2]
            places[1::2, 2] = generator.uniform(*heights, len(places[1::2]))
        rows.append(judge.row(cell, places))
    if not rows:
        raise CancelledError("cancelled before the first cell was checked")
    tell(len(rows) / count)
    return Check(len(scene), len(pvs.rows.data) / len(known), tuple(rows))


def viewpoints(cells: ViewCells, cell: int, count: int, generator: Generator) -> FloatArray:
    """(count, 3) points of a cell, borders included, in its space.

    The upper corners come first, then points of the upper edges, and the last, a quarter, are from
    anywhere on the sides and within.
    """
    outline = cells.outline(cell)
    low, high = cells.low[cell, 2], cells.high[cell, 2]
    side = generator.integers(0, len(outline), count)
    share = generator.random(count)[:, None]
    plan = (1.0 - share) * outline[side] + share * np.roll(outline, -1, axis=0)[side]
    corners = min(count, len(outline))
    plan[:corners] = outline[:corners]
    heights = np.full(count, high)
    others = max(round(_ON_TOP * count), corners)
    heights[others:] = generator.uniform(low, high, count - others)
    inner = slice((others + count) // 2, count)
    plan[inner] += generator.random((len(plan[inner]), 1)) * (outline.mean(axis=0) - plan[inner])
    places = np.column_stack([plan, heights])
    return np.asarray(np.clip(places, cells.low[cell], cells.high[cell]))


class _Judge:
    """Holds what all cells are judged by."""

    def __init__(
        self,
        scene: Scene,
        pvs: Pvs,
        options: CheckOptions,
        opaque: Scene | None,
        terrain: Terrain | None,
    ) -> None:
        self._scene, self._pvs, self._options = scene, pvs, options
        self._order = axis_order(pvs.up)
        self._terrain = terrain
        self._prisms = prisms_of(scene, pvs.up, opaque) if terrain is None else None
        self._parts: HiddenParts | None = None
        if pvs.slices is not None and self._prisms is not None:
            self._parts = HiddenParts(scene, pvs, self._prisms)
        self._solid = _closed_solid(scene if opaque is None else opaque, pvs)
        self._panorama: Panorama | None = None
        if options.pictures:
            ground = self._prisms if options.ground else None
            self._panorama = Panorama(scene, pvs.up, options.pixels, ground, opaque)

    def row(self, cell: int, places: FloatArray) -> CellCheck:
        """``places`` (k, 3) of the cell, in its space."""
        pvs = self._pvs
        if self._solid is not None:  # slices are right for viewers in free space alone
            places = places[~is_within(places, *self._solid)]
        visible = pvs.visible(cell)
        found = self._lines(places + pvs.origin)
        seen = ~np.isnan(found).all(axis=0)
        leaks = [
            self._leak(cell, index, place, self._towards(found[view, index]), "line")
            for index, view, place in _first(~np.isnan(found), seen & ~visible, places)
        ]
        leaks += self._part_leaks(cell, places)
        for place in self._picture_places(cell, places):
            towards = self._pictures(place)
            shown = ~np.isnan(towards[:, 0])
            leaks += [
                self._leak(cell, index, place, towards[index], "picture")
                for index in np.flatnonzero(shown & ~visible & ~seen).tolist()
            ]
            seen |= shown
        leaks += self._early_leaks(cell, places, ~np.isnan(found) & visible, found)
        begin = int(pvs.row_of[cell])
        size = int(pvs.rows.offsets[begin + 1] - pvs.rows.offsets[begin])
        proven = int(np.count_nonzero(seen & visible))
        return CellCheck(cell, int(visible.sum()), int(seen.sum()), proven, size, tuple(leaks))

    def _part_leaks(self, cell: int, places: FloatArray) -> list[Leak]:
        """The objects of which a place sees what their slices hide."""
        if self._parts is None:
            return []
        azimuths = self._parts.seen_from(cell, places + self._pvs.origin)
        found: BoolArray = ~np.isnan(azimuths)
        return [
            self._leak(cell, index, place, self._towards(azimuths[view, index]), "slice")
            for index, view, place in _first(found, np.asarray(found.any(axis=0)), places)
        ]

    def _lines(self, eyes: FloatArray) -> FloatArray:
        """(k, n) along which azimuth eyes (k, 3), world with z up, certainly see each object."""
        options = self._options
        if self._terrain is not None:
            return terrain_seen_from(self._terrain, eyes, options.azimuths, margin=options.margin)
        assert self._prisms is not None
        eyes = eyes - self._prisms.origin
        return seen_from(self._prisms, eyes, options.azimuths, margin=options.margin)

    def _early_leaks(
        self, cell: int, places: FloatArray, seen: BoolArray, towards: FloatArray
    ) -> list[Leak]:
        """The objects that a place sees (k, n) from below their altitude."""
        altitudes = self._pvs.altitudes
        if altitudes is None:
            return []
        early = seen.copy()
        for view, height in enumerate(places[:, 2].tolist()):
            early[view] &= ~altitudes.seen(cell, height)
        return [
            self._leak(cell, index, place, self._towards(towards[view, index]), "line")
            for index, view, place in _first(early, np.asarray(early.any(axis=0)), places)
        ]

    def _picture_places(self, cell: int, places: FloatArray) -> FloatArray:
        """Of the places those for pictures, upper corners first, a little within the cell."""
        some = places[: self._options.pictures]
        middle = 0.5 * (self._pvs.cells.low[cell] + self._pvs.cells.high[cell])
        if self._pvs.cells.kinds[cell] == PRISM:
            middle[:2] = self._pvs.cells.outline(cell).mean(axis=0)
        return np.asarray(some + _WITHIN * (middle - some))

    def _pictures(self, place: FloatArray) -> FloatArray:
        assert self._panorama is not None
        return self._panorama.seen_from(self._to_world(place))

    def _leak(
        self, cell: int, index: int, place: FloatArray, towards: FloatArray,
        proof: Proof,
    ) -> Leak:  # fmt: skip
        x, y, z = self._to_world(place).tolist()
        ahead, across, above = towards.tolist()
        name = self._scene.names[index]
        return Leak(cell, name, (x, y, z), (ahead, across, above), proof)

    def _to_world(self, place: FloatArray) -> FloatArray:
        """(3,) of the cells' space in the world."""
        world = np.empty(3)
        world[self._order] = place + self._pvs.origin
        return world

    def _towards(self, azimuth: float) -> FloatArray:
        """(3,) the level direction of an azimuth, world."""
        direction = np.zeros(3)
        direction[self._order[:2]] = np.cos(azimuth), np.sin(azimuth)
        return direction


def _closed_solid(scene: Scene, pvs: Pvs) -> tuple[FloatArray, IntArray, NDArray[np.int64]] | None:
    """Corners, triangles and their closed pieces in the space of the cells, where viewers in them
    do not count; halls, in which viewers are, are none.
    """
    if pvs.method != "slice-wise" or len(scene) == 0:
        return None
    mesh = scene.joined(range(len(scene)))
    points = np.ascontiguousarray(mesh.vertices[:, axis_order(pvs.up)] - pvs.origin)
    size = float(np.ptp(points, axis=0).max())
    closed = closed_pieces(points, mesh.faces, floor_of(pvs.cells, size))
    return points, mesh.faces, without_halls(points, mesh.faces, closed, pvs.cells)


def _first(
    found: BoolArray, wanted: BoolArray, places: FloatArray
) -> Iterator[tuple[int, int, FloatArray]]:
    """Each wanted object with the first viewpoint that sees it: its number and its place."""
    for index in np.flatnonzero(wanted).tolist():
        view = int(np.argmax(found[:, index]))
        yield index, view, places[view]
