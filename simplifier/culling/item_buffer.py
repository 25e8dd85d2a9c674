"""ItemBuffer: which object is nearest in each pixel, the truth that culling is judged by."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from simplifier.culling.depth_buffer import check_screen, in_frustum, screen_view
from simplifier.geometry.camera import Camera
from simplifier.geometry.mesh import FloatArray, IntArray, TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.kernels.item_buffer import NOTHING, draw_items, merge_pictures
from simplifier.kernels.threads import run_chunks, thread_count

_WORTH_A_THREAD = 50_000  # triangles; a thread has a picture of its own, to be merged


@dataclass(frozen=True, eq=False)
class Part:
    """Faces to be drawn as an item.

    ``mesh``       in its own space.
    ``transform``  (4, 4) float64 from there to the world, column vectors, affine.
    ``item``       number of all faces, or (m,) int32 of each of the mesh's faces; 0 or more.
    ``begin``, ``end``  the faces that are drawn; ``end`` None is the last.
    """

    mesh: TriangleMesh
    transform: FloatArray
    item: int | IntArray
    begin: int = 0
    end: int | None = None

    @property
    def stop(self) -> int:
        """``end`` as a number."""
        return len(self.mesh.faces) if self.end is None else self.end


class ItemBuffer:
    """A screen that holds the nearest item of every pixel's centre, in float64.

    Drawing adds to what is there; draw with the same camera until :meth:`clear`.

    ``items``      (rows, columns) int32: the nearest item, of equally near ones the lowest; -1 is
                   none.
    ``fragments``  (n,) int64: pixel centres that each item would cover alone, counted once for each
                   triangle that covers them; 0 says that it covers none.
    """

    def __init__(self, rows: int, columns: int) -> None:
        check_screen(rows, columns)
        self.rows, self.columns = rows, columns
        self.items: IntArray = np.empty((rows, columns), dtype=np.int32)
        self.fragments: NDArray[np.int64] = np.zeros(0, dtype=np.int64)
        self._depth: FloatArray = np.empty((rows, columns))
        self._boxes: tuple[Scene, FloatArray] | None = None
        self.clear()

    def clear(self) -> None:
        """Forget what was drawn."""
        self.items.fill(NOTHING)
        self._depth.fill(0.0)
        self.fragments = np.zeros(0, dtype=np.int64)

    @property
    def visible(self) -> NDArray[np.int64]:
        """(n,) pixels in which each item is the nearest."""
        seen = self.items[self.items != NOTHING]
        return np.bincount(seen, minlength=len(self.fragments)).astype(np.int64)

    @property
    def depth(self) -> FloatArray:
        """(rows, columns) view depth, world units; infinite where there is nothing."""
        with np.errstate(divide="ignore"):
            return 1.0 / self._depth

    def draw(
        self, scene: Scene, camera: Camera, objects: Sequence[int] | IntArray | None = None
    ) -> None:
        """Draw objects of a scene, all by default; an object's index is its item."""
        chosen = np.arange(len(scene)) if objects is None else np.asarray(objects, dtype=np.int64)
        inside = in_frustum(self._boxes_of(scene)[chosen], camera, self.rows, self.columns)
        self._make_room(len(scene))
        self.draw_parts(
            [
                Part(scene.meshes[scene.mesh_of[index]], scene.transforms[index], int(index))
                for index in chosen[inside]
            ],
            camera,
        )

    def draw_parts(self, parts: Sequence[Part], camera: Camera) -> None:
        """Draw faces of several meshes; the result does not depend on order and threads."""
        self._make_room(max((int(np.max(part.item)) + 1 for part in parts), default=0))
        total = sum(part.stop - part.begin for part in parts)
        if total == 0:
            return
        workers = max(1, min(thread_count(), total // _WORTH_A_THREAD))
        views = [screen_view(camera, self.rows, self.columns) for _ in range(workers)]
        pictures = [self._depth, *(np.zeros_like(self._depth) for _ in views[1:])]
        items = [self.items, *(np.full_like(self.items, NOTHING) for _ in views[1:])]
        counts = [np.zeros_like(self.fragments) for _ in views]

        def work(first: int, last: int) -> None:
            for worker in range(first, last):
                share = _share(parts, total * worker // workers, total * (worker + 1) // workers)
                _draw(list(share), views[worker], pictures[worker], items[worker], counts[worker])

        run_chunks(work, workers, chunks_per_thread=1)
        for other in range(1, workers):
            merge_pictures(self._depth, self.items, pictures[other], items[other])
        self.fragments += np.sum(counts, axis=0)

    def _make_room(self, count: int) -> None:
        missing = max(count - len(self.fragments), 0)
        self.fragments = np.pad(self.fragments, (0, missing))

    def _boxes_of(self, scene: Scene) -> FloatArray:
        """(n, 2, 3) boxes that hold the objects, world units; kept for the next picture."""
        if self._boxes is None or self._boxes[0] is not scene:
            self._boxes = scene, scene.bounds()
        return self._boxes[1]


def _share(parts: Sequence[Part], first: int, last: int) -> Iterator[Part]:
    """The parts that hold the faces ``first`` to ``last`` of all, cut where they reach further."""
    passed = 0
    for part in parts:
        begin, end = max(first - passed, 0), min(last - passed, part.stop - part.begin)
        if begin < end:
            yield replace(part, begin=part.begin + begin, end=part.begin + end)
        passed += part.stop - part.begin


def _draw(
    parts: Sequence[Part], view: FloatArray, depth: FloatArray, items: IntArray,
    fragments: NDArray[np.int64],
) -> None:  # fmt: skip
    """Draw parts into one picture, on this thread."""
    room = max((len(part.mesh.vertices) for part in parts), default=0)
    points, cells = np.empty((room, 3)), np.empty(room, dtype=np.uint32)
    for part in parts:
        draw_items(
            part.mesh.vertices, part.mesh.faces, part.begin, part.stop,
            _to_pixels(part.transform, view), np.array(part.item, dtype=np.int32).reshape(-1),
            view, points, cells, depth, items, fragments,
        )  # fmt: skip


def _to_pixels(transform: FloatArray, view: FloatArray) -> FloatArray:
    """(3, 4) from the space of a mesh to homogeneous pixels."""
    screen = view[3:12].reshape(3, 3)
    offset = transform[:3, 3] - view[:3]
    return np.column_stack([screen @ transform[:3, :3], screen @ offset])
