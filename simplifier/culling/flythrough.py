"""Scene, its occluders, camera path -> Flythrough: what the occluders hide, held against the truth.

The truth is an item buffer of several times the depth buffer's resolution: what is visible in none
of its pixels is hidden.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from simplifier.culling.belonging import parts_of
from simplifier.culling.cull_options import CullOptions
from simplifier.culling.frame import Figures, Frame, total
from simplifier.culling.frame_measure import FrameMeasure
from simplifier.culling.shot import Shot
from simplifier.errors import CancelledError, UnreadablePathError
from simplifier.geometry.camera import CameraPath
from simplifier.geometry.scene import Scene
from simplifier.hierarchy.occluder_tree import OccluderTree
from simplifier.hierarchy.parts import Parts
from simplifier.progress import Cancel

Tell = Callable[[int, str], None]
"""Told how many frames are done, and which one is next."""


@dataclass(frozen=True, eq=False)
class Flythrough:
    """What was measured.

    ``path``         the whole of it; ``frames`` are fewer where the run was cancelled.
    ``pixel_error``  that the occluders were drawn with.
    ``shots``        of some of the frames.
    """

    scene: Scene
    parts: Parts
    path: CameraPath
    options: CullOptions
    pixel_error: float
    frames: tuple[Frame, ...]
    shots: tuple[Shot, ...]

    @property
    def complete(self) -> bool:
        """Whether every camera of the path was measured."""
        return len(self.frames) == len(self.path.cameras)

    @property
    def total(self) -> Figures:
        """Sums over the frames."""
        return total(self.frames)

    @property
    def worst_recall(self) -> Frame | None:
        """Least recall of parts, the first of equals; None where nothing is hidden in any."""
        some = [frame for frame in self.frames if frame.figures.parts.hidden]
        return min(some, key=lambda frame: frame.figures.parts.recall or 0.0, default=None)

    @property
    def worst_picture(self) -> Frame:
        """The largest share of wrong pixels, the first of equals."""
        return max(self.frames, key=lambda frame: frame.figures.wrong_share)


def fly(
    scene: Scene,
    tree: OccluderTree,
    path: CameraPath,
    options: CullOptions,
    tell: Tell = lambda done, name: None,
    cancel: Cancel | None = None,
) -> Flythrough:
    """Cull the scene from every camera of the path and count what is hidden rightly and wrongly.

    Once ``cancel`` is set the frames measured by then are returned, or, if there is none,
    :class:`CancelledError` raised.  Raises :class:`SceneError` where the occluders are not those of
    the scene, and :class:`UnreadablePathError` for a path without frames.
    """
    if not path.cameras:
        raise UnreadablePathError(
            "it has no frames", where=f"path '{path.name}'", remedy="give it one or more"
        )
    parts = parts_of(scene, tree)
    measure = FrameMeasure(scene, parts, tree, options)
    chosen = _spread(len(path.cameras), options.shots)
    frames, shots = [], []
    for index, camera in enumerate(path.cameras):
        if cancel is not None and cancel.is_set():
            break
        tell(index, f"frame {index}")
        frames.append(measure.frame(index, camera))
        if index in chosen:
            shots.append(measure.shot(index, camera))
    if not frames:
        raise CancelledError("cancelled before the first frame was measured")
    return Flythrough(scene, parts, path, options, measure.pixel_error, tuple(frames), tuple(shots))


def _spread(count: int, most: int) -> set[int]:
    """At most that many of ``count`` places, from the first to the last."""
    return set(np.linspace(0, count - 1, min(count, most)).round().astype(int).tolist())
