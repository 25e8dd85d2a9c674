"""The device that draws and measures by compute programs of OpenGL 4.3, without a window."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cached_property
from threading import RLock
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from simplifier.device.coverage_program import CoverageProgram
from simplifier.device.depth_program import DepthProgram
from simplifier.device.device import PROCESSOR, Faces, PolygonArrays, Vertices
from simplifier.device.exact_program import computes_exactly
from simplifier.device.measure_program import MeasureProgram
from simplifier.device.opengl_context import open_context, unavailable
from simplifier.device.programs import LostError
from simplifier.kernels.coverage import MaskArray, drawable
from simplifier.options.simplify import Slicing
from simplifier.progress import TellShare, silent

_Result = TypeVar("_Result")

_WHERE, _INSTEAD = "device gpu", "--device cpu"
_SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swiftshader", "software", "basic render")


class OpenGLDevice:
    """A graphics card, or Mesa's software for one; the same bits as of the processor.

    A context belongs to one thread at a time: it is current on the calling one for the length of a
    call, and other threads wait.  What is too large for a buffer, and what the card could not draw,
    is drawn by the processor.  Raises :class:`~simplifier.errors.BackendUnavailableError` where
    there is no OpenGL 4.3 with EGL, or none that computes as the processor does.
    """

    def __init__(self) -> None:
        self._lock, self._closed = RLock(), False
        self._context, _ = open_context(_WHERE, _INSTEAD, 430)
        with self._context:
            info = self._context.info
            self._name = str(info["GL_RENDERER"])
            self._largest = int(info["GL_MAX_SHADER_STORAGE_BLOCK_SIZE"])
            exact = computes_exactly(self._context)
        if not exact:
            self.close()
            what = f"{self._name} does not compute in double precision as the processor does"
            raise unavailable(what, _WHERE, _INSTEAD)

    @property
    def name(self) -> str:
        return self._name

    @property
    def slicer(self) -> Slicing:
        return "gl"

    @property
    def is_software(self) -> bool:
        """Whether the processor does the work of a card."""
        return any(word in self._name.lower() for word in _SOFTWARE)

    @property
    def remarks(self) -> Sequence[str]:
        if not self.is_software:
            return ()
        return (
            f"device gpu: there is no graphics card, so OpenGL runs on the processor ({self.name});"
            f" {_INSTEAD} gives the same pictures faster",
        )

    def close(self) -> None:
        """Free the context and all that is in it; closing twice does no harm."""
        with self._lock:
            self._closed = True
            self._context.release()

    def coverage_masks(
        self,
        vertices: Vertices,
        faces: Faces,
        projections: NDArray[np.float64],
        rows: int,
        columns: int,
        tell: TellShare = silent,
    ) -> MaskArray:
        points, indices, views = drawable(vertices, faces, projections, (2, rows, columns))
        return self._done(
            lambda: self._coverage.masks(points, indices, views, (rows, columns), tell),
            lambda: PROCESSOR.coverage_masks(vertices, faces, projections, rows, columns, tell),
            points, indices,
        )  # fmt: skip

    def front_pixels(
        self,
        mesh: tuple[Vertices, Faces],
        occluder: tuple[Vertices, Faces],
        projections: NDArray[np.float64],
        image: int,
        threshold: float,
    ) -> NDArray[np.int64]:
        points, faces, views = drawable(*mesh, projections, (3, image, image))
        own, own_faces, _ = drawable(*occluder, projections, (3, image, image))
        return self._done(
            lambda: self._depth.front_pixels(
                (points, faces), (own, own_faces), views, image, threshold
            ),
            lambda: PROCESSOR.front_pixels(mesh, occluder, projections, image, threshold),
            points, faces, also=(own, own_faces),
        )  # fmt: skip

    def depth_limits(
        self,
        vertices: Vertices,
        faces: Faces,
        projections: NDArray[np.float64],
        image: int,
        threshold: float,
    ) -> NDArray[np.float32]:
        points, indices, views = drawable(vertices, faces, projections, (3, image, image))

        def limits() -> NDArray[np.float32]:
            nearest = self._depth.nearest(points, indices, views, image, -threshold)
            return np.where(nearest < np.inf, nearest, -np.inf).astype(np.float32)

        return self._done(
            limits,
            lambda: PROCESSOR.depth_limits(vertices, faces, projections, image, threshold),
            points, indices,
        )  # fmt: skip

    def polygon_scores(
        self,
        shapes: PolygonArrays,
        polygons: NDArray[np.int32],
        levels: NDArray[np.int32],
        base: NDArray[np.uint64],
        tell: TellShare = silent,
    ) -> NDArray[np.int64]:
        return self._done(
            lambda: self._measure.scores(shapes, polygons, levels, base, tell),
            lambda: PROCESSOR.polygon_scores(shapes, polygons, levels, base, tell),
            polygons, shapes[3],
        )  # fmt: skip

    def _done(
        self,
        draw: Callable[[], _Result],
        instead: Callable[[], _Result],
        *needed: NDArray[Any],
        also: tuple[NDArray[Any], ...] = (),
    ) -> _Result:
        """What ``draw`` gives, or what is done ``instead``.

        ``needed``  what has to be there and to fit into a buffer; ``also``: to fit, if it is there.
        """
        fits = all(0 < one.nbytes <= self._largest for one in needed)
        if not fits or any(one.nbytes > self._largest for one in also):
            return instead()
        import moderngl

        with self._lock:
            if not self._closed:
                with suppress(LostError, moderngl.Error), self._context:
                    return draw()
        return instead()

    @cached_property
    def _coverage(self) -> CoverageProgram:
        return CoverageProgram(self._context)

    @cached_property
    def _depth(self) -> DepthProgram:
        return DepthProgram(self._context)

    @cached_property
    def _measure(self) -> MeasureProgram:
        return MeasureProgram(self._context)
