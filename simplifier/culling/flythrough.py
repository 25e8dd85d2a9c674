"""Scene, its occluders, camera path -> Flythrough: what the occluders hide, held against the truth.

The truth is an item buffer of several times the depth buffer's resolution: what is visible in none
of its pixels is hidden.

Do these occluders belong to this scene?
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import zip_longest

import numpy as np

from simplifier.culling.frame import (
    Frame,
    FrameFigures,
    FrameMeasure,
    Played,
    part_boxes,
    total,
)
from simplifier.culling.shot import Shot
from simplifier.culling.visible_sets import VisibleSets
from simplifier.errors import CancelledError, SceneError, UnreadablePathError
from simplifier.geometry.camera import CameraPath
from simplifier.geometry.scene import Scene
from simplifier.hierarchy.occluder_tree import OccluderTree
from simplifier.hierarchy.parts import Parts, split_large
from simplifier.options.scene import CullOptions
from simplifier.progress import Cancel, TellStep

MOST_PLAYED = 2000
"""Frames that can be played afterwards; a byte a part and frame is kept."""


@dataclass(frozen=True, eq=False)
class Flythrough:
    """What was measured.

    ``path``         the whole of it; ``frames`` are fewer where the run was cancelled.
    ``pixel_error``  that the occluders were drawn with.
    ``shots``        of some of the frames.
    ``sets``         visible sets that were looked up along the path, if any were.
    ``occluders``    that were drawn.
    ``played``       what became of the parts in the first :data:`MOST_PLAYED` frames.
    """

    scene: Scene
    parts: Parts
    path: CameraPath
    options: CullOptions
    pixel_error: float
    frames: tuple[Frame, ...]
    shots: tuple[Shot, ...]
    sets: VisibleSets | None
    occluders: OccluderTree | Scene
    played: tuple[Played, ...]

    @property
    def complete(self) -> bool:
        """Whether every camera of the path was measured."""
        return len(self.frames) == len(self.path.cameras)

    @property
    def total(self) -> FrameFigures:
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
    occluders: OccluderTree | Scene,
    path: CameraPath,
    options: CullOptions,
    tell: TellStep = lambda done, name: None,
    cancel: Cancel | None = None,
    sets: VisibleSets | None = None,
) -> Flythrough:
    """Cull the scene from every camera of the path and count what is hidden rightly and wrongly.

    ``occluders``  that were built for the scene, or a scene of some that were made elsewhere.

    With ``sets`` it is also counted what they leave to be drawn, alone and with the occluders.

    Once ``cancel`` is set the frames measured by then are returned, or, if there is none,
    :class:`CancelledError` raised.  Raises :class:`SceneError` where the occluders are not those of
    the scene, or lie beside it, and :class:`UnreadablePathError` for a path without frames.
    """
    if not path.cameras:
        raise UnreadablePathError(
            "it has no frames", where=f"path '{path.name}'", remedy="give it one or more"
        )
    parts = split_large(scene) if isinstance(occluders, Scene) else matching_parts(scene, occluders)
    measure = FrameMeasure(scene, parts, occluders, options, sets)
    chosen = _even_places(len(path.cameras), options.shots)
    frames, shots, played = [], [], []
    for index, camera in enumerate(path.cameras):
        if cancel is not None and cancel.is_set():
            break
        tell(index, f"frame {index}")
        frames.append(measure.frame(index, camera))
        if index < MOST_PLAYED:
            played.append(measure.played())
        if index in chosen:
            shots.append(measure.shot(index, camera))
    if not frames:
        raise CancelledError("cancelled before the first frame was measured")
    return Flythrough(
        scene, parts, path, options, measure.pixel_error, tuple(frames), tuple(shots), sets,
        occluders, tuple(played),
    )  # fmt: skip


def _even_places(count: int, most: int) -> set[int]:
    """At most that many of ``count`` places, from the first to the last."""
    return set(np.linspace(0, count - 1, min(count, most)).round().astype(int).tolist())


_TOLERANCE = 1e-6  # of the scene's extent: a box may pass through a file


def matching_parts(scene: Scene, tree: OccluderTree) -> Parts:
    """The parts that the occluders were made for.

    Raises :class:`SceneError` where objects, their parts or the parts' boxes are not those of the
    tree: occluders of another scene, or of an earlier state of this one, would hide at random.
    """
    for index, (here, there) in enumerate(zip_longest(scene.names, tree.objects)):
        if here != there:
            raise _foreign(
                f"object {index} is {_name_or_none(here)} here and {_name_or_none(there)} there"
            )
    parts = split_large(scene)
    if not np.array_equal(parts.object_of, tree.object_of):
        raise _foreign(f"{len(parts.object_of)} parts here and {len(tree.object_of)} there")
    boxes, built = parts.bounds, part_boxes(tree)
    extent = float((boxes[:, 1].max(axis=0) - boxes[:, 0].min(axis=0)).max())
    off = np.abs(boxes - built).max(axis=(1, 2))
    worst = int(np.argmax(off))
    if not off[worst] <= _TOLERANCE * extent:
        name = scene.names[parts.object_of[worst]]
        raise _foreign(f"the box of '{name}' is off by {off[worst]:.3g}")
    return parts


def _name_or_none(name: str | None) -> str:
    return "missing" if name is None else f"'{name}'"


def _foreign(how: str) -> SceneError:
    return SceneError(
        f"these are the occluders of another scene ({how})",
        remedy="build them again with 'occluder scene'",
    )
