"""The device that draws and measures by compute programs of OpenGL 4.3, without a window."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from functools import cached_property
from threading import RLock
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from simplifier.device.card import Card, LostError, Shape
from simplifier.device.coverage_program import CoverageProgram
from simplifier.device.depth_program import DepthProgram
from simplifier.device.device import (
    PROCESSOR,
    Faces,
    PolygonArrays,
    QuadSample,
    Surface,
    Vertices,
)
from simplifier.device.exact_program import computes_exactly
from simplifier.device.measure_program import MeasureProgram
from simplifier.device.opengl_context import open_context, unavailable
from simplifier.device.overhang_program import OverhangProgram
from simplifier.device.quads_program import QuadsProgram, bytes_of_table
from simplifier.kernels.coverage import MaskArray, drawable
from simplifier.progress import TellShare, silent

_Result = TypeVar("_Result")

_log = logging.getLogger(__name__)

_WHERE, _INSTEAD = "device gpu", "--device cpu"
_SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swiftshader", "software", "basic render")


@contextmanager
def forgiven() -> Iterator[None]:
    """What a card fails at is told to the log, since it only costs time."""
    import moderngl

    try:
        yield
    except (LostError, moderngl.Error) as error:
        _log.warning("the graphics card failed, and the processor does the work: %s", error)


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
            self._name = str(self._context.info["GL_RENDERER"])
            self._card = Card(self._context)
            exact = computes_exactly(self._card)
        if not exact:
            self.close()
            what = f"{self._name} does not compute in double precision as the processor does"
            raise unavailable(what, _WHERE, _INSTEAD)

    @property
    def name(self) -> str:
        return self._name

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
            lambda: self._coverage.masks((points, indices), views, (rows, columns), tell),
            lambda: PROCESSOR.coverage_masks(vertices, faces, projections, rows, columns, tell),
            points, indices,
        )  # fmt: skip

    def quad_pixels(
        self,
        mesh: Surface,
        occluders: Sequence[Surface],
        projections: NDArray[np.float64],
        image: int,
        sample: QuadSample,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        shapes, views = self._drawable(mesh, occluders, projections, image)

        def count() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
            areas, pixels = self._counted(
                shapes, views, image,
                lambda original, hidden, first, last: self._quads.pixels(
                    original, hidden, last - first, image, sample.after(first)
                ),
            )  # fmt: skip
            return np.concatenate(areas), np.concatenate(pixels, axis=1)

        return self._done(
            count,
            lambda: PROCESSOR.quad_pixels(mesh, occluders, projections, image, sample),
            *shapes[0], views, also=[one for shape in shapes[1:] for one in shape],
            scratch=bytes_of_table(image),
        )  # fmt: skip

    def overhang_pixels(
        self,
        mesh: Surface,
        occluders: Sequence[Surface],
        projections: NDArray[np.float64],
        image: int,
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        shapes, views = self._drawable(mesh, occluders, projections, image)

        def count() -> tuple[NDArray[np.int64], NDArray[np.int64]]:
            pixels, farthest = self._counted(
                shapes, views, image,
                lambda original, hidden, first, last: self._overhang.pixels(
                    original, hidden, last - first, image
                ),
            )  # fmt: skip
            return np.concatenate(pixels, axis=1), np.concatenate(farthest, axis=1)

        return self._done(
            count,
            lambda: PROCESSOR.overhang_pixels(mesh, occluders, projections, image),
            *shapes[0], views, also=[one for shape in shapes[1:] for one in shape],
        )  # fmt: skip

    def front_pixels(
        self,
        mesh: Surface,
        occluder: Surface,
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
            nearest = self._depth.nearest((points, indices), views, image, -threshold)
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

    def _drawable(
        self,
        mesh: Surface,
        occluders: Sequence[Surface],
        projections: NDArray[np.float64],
        image: int,
    ) -> tuple[list[Shape], NDArray[np.float64]]:
        """Points and faces of each surface, and the views, as the programs take them."""
        shapes = []
        for surface in (mesh, *occluders):
            points, faces, views = drawable(*surface, projections, (2, image, image))
            shapes.append((points, faces))
        return shapes, views

    def _counted(
        self,
        shapes: Sequence[Shape],
        views: NDArray[np.float64],
        image: int,
        count: Callable[[Any, Sequence[Any], int, int], tuple[NDArray[Any], NDArray[Any]]],
    ) -> Iterator[tuple[NDArray[Any], ...]]:
        """The first results of ``count``, and the second ones: each a block of views.

        It is given the silhouettes of the first shape and of the others, and which views these are.
        """
        with closing(self._coverage.in_blocks(shapes, views, (image, image))) as blocks:
            counted = [
                count(original, hidden, first, last) for first, last, original, *hidden in blocks
            ]
        return zip(*counted, strict=True)

    def _done(
        self,
        draw: Callable[[], _Result],
        instead: Callable[[], _Result],
        *needed: NDArray[Any],
        also: Sequence[NDArray[Any]] = (),
        scratch: int = 0,
    ) -> _Result:
        """What ``draw`` gives, or what is done ``instead``.

        ``needed``  what has to be there and to fit into a buffer; ``also``: to fit, if it is there.
        ``scratch``  bytes of the largest buffer beside these.
        """
        fits = all(0 < one.nbytes <= self._card.largest for one in needed)
        if (
            not fits
            or scratch > self._card.largest
            or any(one.nbytes > self._card.largest for one in also)
        ):
            return instead()
        with self._lock:
            if not self._closed:
                with forgiven(), self._context:
                    return draw()
        return instead()

    @cached_property
    def _coverage(self) -> CoverageProgram:
        return CoverageProgram(self._card)

    @cached_property
    def _quads(self) -> QuadsProgram:
        return QuadsProgram(self._card)

    @cached_property
    def _overhang(self) -> OverhangProgram:
        return OverhangProgram(self._card)

    @cached_property
    def _depth(self) -> DepthProgram:
        return DepthProgram(self._card)

    @cached_property
    def _measure(self) -> MeasureProgram:
        return MeasureProgram(self._card)
