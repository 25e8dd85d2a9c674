"""Scene and a point -> which objects are seen in pictures around it.

Six square pictures, one to each side of a cube, hold the nearest object of every pixel.  All
triangles are drawn, so that it works for any scene; what is thinner than two pixels is missed.
"""

from __future__ import annotations

import numpy as np

from simplifier.culling.item_buffer import ItemBuffer, Part
from simplifier.geometry.camera import Camera
from simplifier.geometry.mesh import FloatArray, IntArray, TriangleMesh, as_mesh
from simplifier.geometry.scene import WHOLE, Scene, axis_order, opaque_places
from simplifier.options.simplify import Axis
from simplifier.visibility.checking.exact_view import Prisms

_NEAR = 1e-8  # of the extent: nothing nearer is drawn
_TOO_NEAR = 4.0  # of these: from there a picture may look through a wall


class Panorama:
    """Pictures of a scene from all sides of a point.

    ``pixels``  along an edge of each of the six pictures.
    ``prisms``  with them each object stands on a column of ground as wide as its own, from its
                lowest point down, so that nobody looks below houses that stand uphill.
    ``opaque``  what of the objects one cannot see through, by their names; all of it by default.
                The others are drawn over it, and of these one hides another.
    """

    def __init__(
        self,
        scene: Scene,
        up: Axis,
        pixels: int = 512,
        prisms: Prisms | None = None,
        opaque: Scene | None = None,
    ) -> None:
        self._scene = scene
        self._opaque = scene if opaque is None else opaque
        places = opaque_places(scene, self._opaque)
        numbers = {name: index for index, name in enumerate(scene.names)}
        own = [numbers.get(name, len(scene)) for name in self._opaque.names]
        # Items: what is opaque, the ground, and all objects anew.
        self._object_of = np.array([*own, len(scene), *range(len(scene))], dtype=np.int32)
        self._glass = np.flatnonzero(places != WHOLE)
        self._order = axis_order(up)
        self._buffer = ItemBuffer(pixels, pixels)
        bounds = scene.bounds()
        self._extent = float((bounds[:, 1].max(axis=0) - bounds[:, 0].min(axis=0)).max())
        self._ground = None if prisms is None else _ground(prisms, bounds[:, 0, self._order[2]])
        self._ground_place = np.zeros((4, 4))
        self._ground_place[[*self._order, 3], range(4)] = 1.0
        if prisms is not None:
            self._ground_place[self._order, 3] = prisms.origin

    def seen_from(self, eye: FloatArray) -> FloatArray:
        """(n, 3) float64 unit vectors to where each object is seen; NaN where it is not.

        ``eye``  (3,) world; one that nearly touches a triangle sees nothing.  An object counts as
                 seen that is the nearest in 2 x 2 pixels: a single one might be a crack between
                 triangles that do not share their corners.
        """
        found = np.full((len(self._scene), 3), np.nan)
        near = _NEAR * self._extent
        for axis in range(3):
            for sense in (1.0, -1.0):
                camera = self._camera(eye, axis, sense, near)
                self._draw_opaque(camera)
                if self._buffer.depth.min() < _TOO_NEAR * near:
                    return np.full((len(self._scene), 3), np.nan)
                self._note(camera, found)
                if len(self._glass):
                    self._draw_glass(camera)
                    self._note(camera, found)
        return found

    def _note(self, camera: Camera, found: FloatArray) -> None:
        items, directions = _owned(self._buffer.items, camera)
        objects = self._object_of[items]
        some = objects < len(found)
        found[objects[some]] = directions[some]

    def _camera(self, eye: FloatArray, axis: int, sense: float, near: float) -> Camera:
        forward, above = np.zeros(3), np.zeros(3)
        forward[self._order[axis]] = sense
        above[self._order[(axis + 1) % 3]] = 1.0
        return Camera.looking(eye, forward, above, 90.0, near)

    def _draw_opaque(self, camera: Camera) -> None:
        self._buffer.clear()
        self._buffer.draw(self._opaque, camera)
        if self._ground is not None:
            part = Part(self._ground, self._ground_place, len(self._opaque))
            self._buffer.draw_parts([part], camera)

    def _draw_glass(self, camera: Camera) -> None:
        scene, first = self._scene, len(self._opaque) + 1
        parts = [
            Part(scene.meshes[scene.mesh_of[index]], scene.transforms[index], first + index)
            for index in self._glass.tolist()
        ]
        self._buffer.draw_parts(parts, camera)


def _owned(items: IntArray, camera: Camera) -> tuple[IntArray, FloatArray]:
    """Objects that fill 2 x 2 pixels (k,), each once, and unit vectors (k, 3) to one of these."""
    same = (
        (items[:-1, :-1] == items[1:, :-1])
        & (items[:-1, :-1] == items[:-1, 1:])
        & (items[:-1, :-1] == items[1:, 1:])
        & (items[:-1, :-1] >= 0)
    )
    rows, columns = np.nonzero(same)
    owners, first = np.unique(items[rows, columns], return_index=True)
    size = len(items)
    across = 2.0 * (columns[first] + 0.5) / size - 1.0
    down = 2.0 * (rows[first] + 0.5) / size - 1.0
    right, above, forward = camera.axes
    towards = forward + across[:, None] * right - down[:, None] * above
    return owners, towards / np.linalg.norm(towards, axis=1, keepdims=True)


def _ground(prisms: Prisms, bases: FloatArray) -> TriangleMesh | None:
    """The sides of columns from the objects' bases (n,), world heights, down to the lowest one."""
    heights = np.repeat(bases - prisms.origin[2], np.diff(prisms.offsets))
    low = heights.min(initial=0.0)
    tall = heights > low
    (a, b), top = prisms.edges[tall].transpose(1, 0, 2), heights[tall]
    if not tall.any():
        return None
    bottom = np.full(len(top), low)
    corners = [np.column_stack(each) for each in ((a, bottom), (b, bottom), (b, top), (a, top))]
    quads = np.stack(corners, axis=1)
    vertices, faces = as_mesh(quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3))
    return TriangleMesh.from_soup(vertices, faces)
