"""Camera -> Frame: what the occluders of a scene hide, timed, the truth beside it, and the sums."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.culling.culler import Culled, Culler
from simplifier.culling.depth_buffer import DepthBuffer, Verdict
from simplifier.culling.drawn import Drawn, Way
from simplifier.culling.fate import Counts, Fate, fates, object_sums, object_verdicts
from simplifier.culling.given_occluders import GivenCuller
from simplifier.culling.item_buffer import ItemBuffer
from simplifier.culling.shot import Shot, view_picture
from simplifier.culling.visible_sets import VisibleSets
from simplifier.geometry.camera import Camera
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.scene import Scene
from simplifier.geometry.solid import BoolArray
from simplifier.hierarchy.occluder_tree import OccluderTree
from simplifier.hierarchy.parts import Parts
from simplifier.options.scene import CullOptions


@dataclass(frozen=True)
class FrameFigures:
    """What culling did, in one frame or in all.

    ``objects``, ``parts``  of the scene; a part is an object or a piece of a large one, and what is
                            tested.
    ``covered_pixels``      of the item buffer that show anything.
    ``wrong_pixels``        of these show a part that was culled.
    ``occluders``, ``occluder_triangles``  that were drawn into the depth buffer.
    ``scene_triangles``     of all objects.
    ``triangles_in_view``   of the objects that cover a pixel.
    ``milliseconds``        for drawing the occluders and testing all parts: the least of several
                            times.
    ``drawn``               by each way of culling; those with visible sets where there are any.
    ``outside_cells``       frames outside of all view cells, from which the sets have everything.
    """

    objects: Counts
    parts: Counts
    covered_pixels: int
    wrong_pixels: int
    occluders: int
    occluder_triangles: int
    scene_triangles: int
    triangles_in_view: int
    milliseconds: float
    drawn: Mapping[Way, Drawn]
    outside_cells: int

    @property
    def wrong_share(self) -> float:
        """Of the covered pixels; 0 where there are none."""
        return self.wrong_pixels / max(self.covered_pixels, 1)

    @property
    def triangle_share(self) -> float:
        """Occluder triangles for one of the scene's."""
        return self.occluder_triangles / max(self.scene_triangles, 1)


@dataclass(frozen=True)
class Frame:
    """The figures of the camera ``index`` of a path."""

    index: int
    figures: FrameFigures


@dataclass(frozen=True, eq=False)
class Played:
    """What is kept of a frame to show it again.

    ``fates``  (p,) :class:`Fate` of the parts.
    ``drawn``  the occluders, as :class:`Culled` has them.
    """

    fates: NDArray[np.uint8]
    drawn: tuple[tuple[int, int], ...]


def total(frames: Sequence[Frame]) -> FrameFigures:
    """Sums over one or more frames; the scene's triangles count anew in each."""
    every = [frame.figures for frame in frames]
    return FrameFigures(
        objects=Counts.total(one.objects for one in every),
        parts=Counts.total(one.parts for one in every),
        covered_pixels=sum(one.covered_pixels for one in every),
        wrong_pixels=sum(one.wrong_pixels for one in every),
        occluders=sum(one.occluders for one in every),
        occluder_triangles=sum(one.occluder_triangles for one in every),
        scene_triangles=sum(one.scene_triangles for one in every),
        triangles_in_view=sum(one.triangles_in_view for one in every),
        milliseconds=sum(one.milliseconds for one in every),
        drawn={way: Drawn.total(one.drawn[way] for one in every) for way in every[0].drawn},
        outside_cells=sum(one.outside_cells for one in every),
    )


class FrameMeasure:
    """Measures frames one by one.

    ``buffer``       what the occluders were drawn into last.
    ``pixel_error``  that they were drawn with.
    """

    def __init__(
        self,
        scene: Scene,
        parts: Parts,
        occluders: OccluderTree | Scene,
        options: CullOptions,
        sets: VisibleSets | None = None,
    ) -> None:
        self._parts, self._repeats, self._sets = parts, options.repeats, sets
        self._triangles = scene.triangle_counts
        inner = isinstance(occluders, OccluderTree) and occluders.options.conservative
        self.buffer = DepthBuffer(options.rows, options.columns, "inner" if inner else "centre")
        self._culler: Culler | GivenCuller
        if isinstance(occluders, OccluderTree):
            self._culler = Culler(occluders, self.buffer, options.pixel_error)
        else:
            self._culler = GivenCuller(occluders, parts.bounds, self.buffer)
        self.pixel_error = self._culler.pixel_error
        self._truth = ItemBuffer(options.rows * options.detail, options.columns * options.detail)
        self._fates = np.zeros(len(parts.object_of), dtype=np.uint8)
        self._drawn_occluders: tuple[tuple[int, int], ...] = ()

    def frame(self, index: int, camera: Camera) -> Frame:
        """Cull and draw the truth."""
        culled, seconds = self._timed(camera)
        truth, object_of, count = self._truth, self._parts.object_of, len(self._triangles)
        truth.clear()
        truth.draw(self._parts.scene, camera)
        visible = truth.visible
        self._fates = fates(culled.verdicts, truth.fragments, visible)
        self._drawn_occluders = culled.drawn
        of_objects = fates(
            object_verdicts(culled.verdicts, object_of, count),
            object_sums(truth.fragments, object_of, count),
            object_sums(visible, object_of, count),
        )
        figures = FrameFigures(
            objects=Counts.of(of_objects),
            parts=Counts.of(self._fates),
            covered_pixels=int(visible.sum()),
            wrong_pixels=int(visible[self._fates == Fate.WRONG].sum()),
            occluders=len(culled.drawn),
            occluder_triangles=culled.triangles,
            scene_triangles=int(self._triangles.sum()),
            triangles_in_view=int(self._triangles[of_objects != Fate.ABSENT].sum()),
            milliseconds=1000.0 * seconds,
            drawn={
                way: Drawn.of(self._parts, drawn, visible)
                for way, drawn in self._drawn(camera, culled).items()
            },
            outside_cells=int(self._sets is not None and not self._sets.holds(camera.position)),
        )
        return Frame(index, figures)

    def _drawn(self, camera: Camera, culled: Culled) -> dict[Way, BoolArray]:
        """(p,) which parts each way of culling leaves."""
        in_view = self._culler.in_frustum(camera)
        ways = {Way.FRUSTUM: in_view, Way.OCCLUDERS: culled.verdicts == Verdict.VISIBLE}
        if self._sets is not None:
            seen = self._sets.seen_from(camera.position)[self._parts.object_of]
            ways |= {Way.PVS: in_view & seen, Way.BOTH: ways[Way.OCCLUDERS] & seen}
        return {way: ways[way] for way in Way if way in ways}

    def played(self) -> Played:
        """What became of the parts in the frame that was measured last."""
        return Played(self._fates, self._drawn_occluders)

    def shot(self, index: int, camera: Camera) -> Shot:
        """Pictures of the frame that was measured last."""
        view = view_picture(self._truth, camera, self._parts.object_of, self._fates)
        return Shot(index, camera, view, self.buffer.depth_image(), self._fates)

    def _timed(self, camera: Camera) -> tuple[Culled, float]:
        """The frame and the least seconds: whatever else runs can only make it slower."""
        times = []
        for _ in range(self._repeats):
            begin = time.perf_counter()
            culled = self._culler.cull(camera)
            times.append(time.perf_counter() - begin)
        return culled, min(times)


def part_boxes(tree: OccluderTree) -> FloatArray:
    """(p, 2, 3) of the leaves, by part."""
    leaves = np.nonzero(tree.tree.is_leaf)[0]
    boxes = np.empty((len(leaves), 2, 3))
    boxes[tree.tree.order[tree.tree.spans[leaves, 0]]] = tree.tree.bounds[leaves]
    return boxes
