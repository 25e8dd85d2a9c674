"""Scene -> the convex bodies of its objects, and what they may hide.

Convex objects are occluders as they are.  Of others it is boxes inside of what is solid, from the
base up or, of closed objects that do not stand, of voxels; and of what is not solid anywhere,
its triangles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simplifier.camera_paths.columns import UprightScene
from simplifier.errors import OptionError
from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.scene import NOTHING, WHOLE, Scene, opaque_places
from simplifier.options.stages import make_options
from simplifier.progress import Stopwatch, TellCount
from simplifier.steps.solid import solidify
from simplifier.visibility.solid.height_field import shapes_of
from simplifier.visibility.solid.object_heights import Shape, border_of, standing_heights
from simplifier.visibility.strong.convex_bodies import ConvexBodies
from simplifier.visibility.strong.convexity import CLOSED, Convexity, convexity_of, planes_through
from simplifier.visibility.strong.inner_boxes import placed_boxes
from simplifier.visibility.strong.strong_occluders import StrongOccluders, margin_of

_FLAT = 1e-6  # of the extent: how far over the ground what stands on it may be, or below
_LEVEL = 1e-6  # of a normal: bases are no more slanted
_UPRIGHT = 1e-10
_PIXELS, _LEVELS = 48, 12  # of what stands, that boxes are sought in
_VOXELS = 32  # along the longest side of what floats
_MOST_BOXES = 8  # of an object
_SMALLEST = 0.02  # of an object's volume: smaller boxes hide next to nothing
_MOST_TRIANGLES = 64  # of an object that hide, where nothing of it is solid
_MOST_PIECES = 256  # triangles of an object that are looked at one by one


@dataclass(frozen=True, eq=False)
class SceneOccluders:
    """``occluders``  the objects' boxes are their targets.
    ``kept``  share of what is solid that is in convex bodies, 0 to 1; 1 where nothing is.
    """

    occluders: StrongOccluders
    kept: float


def occluders_of(
    upright: UprightScene,
    ground: bool = False,
    tell: TellCount = lambda done, total: None,
    opaque: Scene | None = None,
) -> SceneOccluders:
    """What may hide something, and what may be hidden; all is upright.

    ``ground``  what stands on a border of its own stands on the ground there, and one cannot look
                under it.  Without it only what stands as low as the lowest object does.
    ``opaque``  what of the objects hides anything, by their names; all of it by default.

    Raises :class:`OptionError` where nothing hides anything.
    """
    places = opaque_places(upright.scene, upright.scene if opaque is None else opaque)
    maker = _Maker(upright, ground, opaque)
    bodies, body_counts, pieces, piece_counts = [], [], [], []
    for index, (whole, hiding) in enumerate(shapes_of(upright, opaque, tell)):
        some = [] if hiding is None else maker.bodies(index, int(places[index]), hiding)
        bodies += some
        body_counts.append(sum(map(len, some)))
        vertices, faces = whole
        if len(faces) <= _MOST_PIECES:
            corners = vertices[faces]
            # The highest first: they are seen furthest, and one that is seen is enough.
            pieces.append(corners[np.argsort(-corners[:, :, 2].mean(axis=1), kind="stable")])
        piece_counts.append(len(faces) if len(faces) <= _MOST_PIECES else 0)
    made = ConvexBodies.joined(bodies)
    if len(made) == 0:
        raise OptionError(
            "no object is convex, nor has one room for a box or a triangle that one cannot see"
            " through", where="method",
            remedy="choose --method cull-map, or --transparent keep",
        )  # fmt: skip
    occluders = StrongOccluders(
        made, upright.boxes, _starts(body_counts), _starts(piece_counts),
        np.concatenate([np.empty((0, 3, 3)), *pieces]),
    )  # fmt: skip
    return SceneOccluders(occluders, maker.kept / maker.filled if maker.filled > 0.0 else 1.0)


def _starts(counts: list[int]) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)


class _Maker:
    """Bodies of one object after the other; ``filled`` and ``kept`` sum up their volumes."""

    def __init__(self, upright: UprightScene, ground: bool, opaque: Scene | None) -> None:
        self.filled = self.kept = 0.0
        self._scene, self._layer = upright.scene, upright.scene if opaque is None else opaque
        self._ground = ground
        self._floor = float(upright.boxes[:, 0, 2].min())
        self._margin = margin_of(upright.boxes)
        extent = upright.extent
        self._flat = _FLAT * float(extent.max())
        self._depth = float(extent.max())
        self._known: dict[tuple[bool, int], Convexity | None] = {}

    def bodies(self, index: int, place: int, shape: Shape) -> list[ConvexBodies]:
        """Of the opaque part of an object; ``place`` of :func:`opaque_places`."""
        whole = place == WHOLE
        scene, at = (self._scene, index) if whole else (self._layer, place)
        assert place != NOTHING
        key = (whole, int(scene.mesh_of[at]))
        if key not in self._known:
            mesh = scene.meshes[key[1]]
            self._known[key] = convexity_of(mesh.vertices, mesh.faces)
        convexity = self._known[key]
        # No ground closes the border of a window.
        ground = self._ground and whole
        stands = ground or float(shape[0][:, 2].min()) <= self._floor + self._flat
        if convexity is not None:
            body = self._convex(convexity, shape, scene.transforms[at], stands)
            if body is not None:
                return [body]
        boxes = self._standing_boxes(shape, ground) if stands else self._floating_boxes(shape)
        if len(boxes):
            return [ConvexBodies.of_boxes(boxes, self._margin)]
        return self._triangles(shape)

    def _below(self, low: float) -> float:
        """Down to where the ground is solid under a base: nobody looks from below it."""
        return low - self._depth if self._ground else low - self._flat

    def _convex(
        self, convexity: Convexity, shape: Shape, transform: FloatArray, stands: bool
    ) -> ConvexBodies | None:
        vertices, _ = shape
        within = vertices[convexity.planes].mean(axis=(0, 1))
        planes, _ = planes_through(vertices[convexity.planes], within)
        down = np.flatnonzero(planes[:, 2] < -_LEVEL)
        level = len(down) == 1 and planes[down[0], 2] < -1.0 + _LEVEL
        if convexity.base != CLOSED and not (stands and level and down[0] == convexity.base):
            return None
        stretch = float(np.linalg.norm(transform[:3, :3], ord=2))
        margin = self._margin + stretch * convexity.dent
        box = np.array([vertices[convexity.planes].min(axis=(0, 1)),
                        vertices[convexity.planes].max(axis=(0, 1))])  # fmt: skip
        if stands and level:
            low = float(vertices[:, 2].min())
            planes = np.concatenate([planes, _walls(vertices, planes, low, self._flat)])
            # Further than it is shrunk, or one might look under it.
            box[0, 2] = self._below(low) - 2.0 * margin
            planes[down[0]] = [0.0, 0.0, -1.0, -box[0, 2]]
        volume = convexity.volume * abs(float(np.linalg.det(transform[:3, :3])))
        self.filled, self.kept = self.filled + volume, self.kept + volume
        return ConvexBodies.of_volume(planes, box, margin)

    def _standing_boxes(self, shape: Shape, ground: bool) -> FloatArray:
        """(k, 2, 3) boxes from the base of an object up."""
        vertices, _ = shape
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        cell = float((high - low)[:2].max()) / _PIXELS
        if cell <= 0.0 or high[2] <= low[2]:
            return np.empty((0, 2, 3))
        floor = None if ground else self._floor
        corner, heights, filled = standing_heights(shape, low[:2], cell, floor)
        levels = np.linspace(low[2], high[2], _LEVELS + 1)[1:]
        room = heights[:, :, None] >= levels
        boxes = []
        for first, last in placed_boxes(room, _MOST_BOXES):
            there = heights[first[0] : last[0], first[1] : last[1]]
            box = [[*(corner + cell * first[:2]), low[2]],
                   [*(corner + cell * last[:2]), there.min()]]  # fmt: skip
            boxes.append(box)
        kept = self._large(np.array(boxes).reshape(-1, 2, 3), filled)
        kept[:, 0, 2] = self._below(float(low[2]))
        return kept

    def _floating_boxes(self, shape: Shape) -> FloatArray:
        """(k, 2, 3) boxes of voxels that lie within a closed object."""
        vertices, faces = shape
        sides = np.ptp(vertices, axis=0)
        if sides.min() <= 0.0 or len(border_of(vertices, faces)):
            return np.empty((0, 2, 3))
        mesh = TriangleMesh.from_soup(vertices, faces)
        options = make_options(
            float(sides.max()), resolution=_VOXELS, up="z", conservative=True, fill="flood"
        )
        core = solidify(mesh, options.solid, Stopwatch()).core
        boxes = core.to_world(placed_boxes(core.inside, _MOST_BOXES).astype(np.float64))
        a, b, c = (vertices[faces[:, corner]] - vertices[0] for corner in range(3))
        filled = abs(float(np.einsum("ij,ij->", a, np.cross(b, c)))) / 6.0
        return self._large(boxes.reshape(-1, 2, 3), filled)

    def _large(self, boxes: FloatArray, filled: float) -> FloatArray:
        """The boxes that are worth it, of an object that fills so much."""
        volumes = np.prod(boxes[:, 1] - boxes[:, 0], axis=1)
        kept = volumes > _SMALLEST * filled
        self.filled += filled
        self.kept += min(_union(boxes[kept]), filled)
        return np.asarray(boxes[kept])

    def _triangles(self, shape: Shape) -> list[ConvexBodies]:
        """The widest triangles: narrow ones hide nothing far behind."""
        corners = shape[0][shape[1]]
        edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
        sides = corners[:, 1:] - corners[:, :1]
        doubled = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
        widest = np.argsort(-doubled / np.maximum(edges, 1e-300), kind="stable")[:_MOST_TRIANGLES]
        return [ConvexBodies.of_triangles(corners[widest], self._margin)]


def _walls(vertices: FloatArray, planes: FloatArray, low: float, flat: float) -> FloatArray:
    """Upright planes (k, 4) around the base of what is convex, where its sides are slanted."""
    from scipy.spatial import ConvexHull

    base = vertices[vertices[:, 2] <= low + flat, :2]
    if np.count_nonzero(np.abs(planes[:, 2]) <= _UPRIGHT) >= len(np.unique(base, axis=0)):
        return np.empty((0, 4))
    middle = base.mean(axis=0)
    equations = ConvexHull(base - middle).equations
    normals = equations[:, :2]
    reach = -equations[:, 2] + normals @ middle
    return np.column_stack([normals, np.zeros(len(normals)), reach])


def _union(boxes: FloatArray) -> float:
    """The volume that some boxes have in all, by the grid of their sides."""
    if len(boxes) == 0:
        return 0.0
    edges = [np.unique(boxes[:, :, axis]) for axis in range(3)]
    inside = np.zeros(tuple(len(each) - 1 for each in edges), dtype=np.bool_)
    for box in boxes:
        ends = [np.searchsorted(each, box[:, axis]) for axis, each in enumerate(edges)]
        inside[tuple(slice(*pair) for pair in ends)] = True
    sizes = [np.diff(each) for each in edges]
    return float((inside * np.einsum("i,j,k->ijk", *sizes)).sum())
