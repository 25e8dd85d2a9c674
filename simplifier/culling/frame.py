"""Frame: the figures of culling a scene from one camera, and their sums."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from simplifier.culling.fate import Counts


@dataclass(frozen=True)
class Figures:
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
    figures: Figures


def total(frames: Sequence[Frame]) -> Figures:
    """Sums over one or more frames; the scene's triangles count anew in each."""
    every = [frame.figures for frame in frames]
    return Figures(
        objects=Counts.total(one.objects for one in every),
        parts=Counts.total(one.parts for one in every),
        covered_pixels=sum(one.covered_pixels for one in every),
        wrong_pixels=sum(one.wrong_pixels for one in every),
        occluders=sum(one.occluders for one in every),
        occluder_triangles=sum(one.occluder_triangles for one in every),
        scene_triangles=sum(one.scene_triangles for one in every),
        triangles_in_view=sum(one.triangles_in_view for one in every),
        milliseconds=sum(one.milliseconds for one in every),
    )
