"""The OpenGL slicer: draws the voxel mesh into a stencil buffer (section 4.2 of the paper).

Orthographic pictures along d, back faces +1, front faces -1, counting only what lies behind the
slicing plane: the stencil is 1 where the plane runs inside the solid and 0 elsewhere.

Two things differ from the paper.  The cut is made a pixel at a time and not by the near plane:
clipped triangles get new corners, and the rounding of those opens cracks along edges that may lie
far behind the plane.  And the planes of one direction are drawn from the deepest to the nearest
without clearing between them; each adds only the faces between it and the plane before, so that
all planes of a direction together cost about four drawings of the mesh, not one drawing each.
"""

from __future__ import annotations

from collections.abc import Iterator
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.solid import BoolArray
from simplifier.progress import TellShare, silent
from simplifier.slicing.planes import SamplingPlan
from simplifier.slicing.stencil_buffer import StencilBuffer

# Voxels by which the depths that the shaders compute may differ from the float64 ones here.
_SLACK = 0.01


class StencilSlicer:
    """Keeps the contract of :class:`simplifier.slicing.sections.Slicer` by OpenGL.

    ``vertices`` (n, 3), ``faces`` (m, 3): the closed voxel mesh in grid space, wound outwards;
    ``shape``: voxels of its grid along x, y, z.

    Holds an OpenGL context: use it on the thread that made it, do not fork while it lives, and
    close it or use it in a ``with`` statement.  Raises
    :class:`~simplifier.errors.BackendUnavailableError` where there is no OpenGL 3.3 with EGL.
    """

    def __init__(self, vertices: IntArray, faces: IntArray, shape: tuple[int, int, int]) -> None:
        # Seen from the grid's centre coordinates are half as large, so float32 is twice as fine.
        self._centre = np.array(shape, dtype=np.float64) / 2.0
        self._points = vertices - self._centre
        self._faces = faces.astype(np.int32)
        self._buffer = StencilBuffer(self._points, len(faces))

    def __enter__(self) -> StencilSlicer:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the OpenGL objects and the context; closing twice does no harm."""
        self._buffer.close()

    def areas(self, plan: SamplingPlan, tell: TellShare = silent) -> NDArray[np.int64]:
        """(n,) covered pixels of each plane of the plan; ``tell`` hears the share that is cut."""
        areas = np.zeros(len(plan), dtype=np.int64)
        with self._buffer:
            # Results are asked for at the end: asking makes the processor wait for the drawing.
            counts = {}
            try:
                for slot, index in enumerate(self._sweep(plan, np.arange(len(plan)))):
                    counts[index] = self._buffer.start_count(slot)
                    tell(slot / len(plan))
            finally:  # even of a cut that ends early, for the sake of the next
                for index, count in counts.items():
                    areas[index] = count()
        return areas

    def masks(self, plan: SamplingPlan, planes: NDArray[np.int64]) -> list[BoolArray]:
        """(rows, columns) bool masks of the named planes, in the order of ``planes``."""
        with self._buffer:
            masks = {index: self._buffer.read() for index in self._sweep(plan, np.unique(planes))}
        return [masks[int(index)] for index in planes]

    def _sweep(self, plan: SamplingPlan, planes: NDArray[np.int64]) -> Iterator[int]:
        """Name each plane at the moment when the buffer holds its slice."""
        if len(planes) == 0:
            return
        self._buffer.reserve(
            max(frame.rows for frame in plan.frames), max(frame.columns for frame in plan.frames)
        )
        owner = plan.frame_of[planes]
        for frame in np.unique(owner):
            chosen = planes[owner == frame]
            deepest_first = chosen[np.argsort(-plan.depths[chosen], kind="stable")]
            yield from self._sweep_direction(plan, int(frame), deepest_first)

    def _sweep_direction(
        self, plan: SamplingPlan, frame: int, deepest_first: NDArray[np.int64]
    ) -> Iterator[int]:
        view = plan.frames[frame]
        centre = view.axes @ self._centre
        d = view.axes[2]
        # No point of a face is deeper or nearer than this, seen from any of its corners.
        reach = float(np.abs(d).sum() - np.abs(d).min()) + _SLACK
        anchors, faces = self._faces_by_depth(d)
        self._buffer.begin(view, centre[:2], reach, faces)
        far = np.inf
        for index in deepest_first:
            near = plan.depths[index] - centre[2]
            first, last = np.searchsorted(anchors, (near - reach - _SLACK, far + reach + _SLACK))
            self._buffer.draw(int(first), int(last), float(near), float(far))
            far = near
            yield int(index)

    def _faces_by_depth(self, direction: FloatArray) -> tuple[FloatArray, IntArray]:
        """Faces ordered by the depth of their last corner (the one that GLSL calls provoking)."""
        anchors = (self._points @ direction)[self._faces[:, 2]]
        order = np.argsort(anchors)
        return anchors[order], self._faces[order]
