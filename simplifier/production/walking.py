"""Scene + its occluders -> a walk through it, culled frame by frame, for a page to play."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from simplifier.camera_paths.generate import generate_path
from simplifier.checks import check_cancel, check_kind, check_whole
from simplifier.culling.flythrough import MOST_PLAYED, fly, matching_parts
from simplifier.culling.walk_file import encode_walk
from simplifier.errors import MeshError
from simplifier.geometry.camera import CameraPath
from simplifier.geometry.scene import Scene
from simplifier.hierarchy.occluder_tree import OccluderTree
from simplifier.options.scene import CullOptions, PathKind, PathOptions
from simplifier.progress import Cancel

_KINDS: tuple[PathKind, ...] = ("street", "inside", "roof")
_LOW = 0.01  # of the scene's longest edge: an eye height for scenes that are not in metres


def record_walk(
    scene: Scene,
    occluders: OccluderTree,
    *,
    name: str = "scene",
    frames: int = 60,
    cancel: Cancel | None = None,
) -> bytes:
    """The bytes of a walk that the dashboard plays, as ``walk.html`` of ``occluder cull`` does.

    It leads along a street, or where there is no room for one through rooms, or over the roofs;
    eyes are 1.7 units above the ground, or where that finds no way, a hundredth of the scene's
    longest edge.  The same input gives the same bytes.

    ``occluders``  that were built for the scene.
    ``frames``     1 to 2,000.
    ``cancel``     once set, ends the walk with the frames that there are.

    Raises :class:`~simplifier.errors.SceneError` for occluders of another scene,
    :class:`~simplifier.errors.MeshError` where there is no room for any walk, and
    :class:`~simplifier.errors.CancelledError` when cancelled before the first frame.
    """
    check_kind("scene", scene, Scene, "what simplifier.load_scene returns")
    check_kind("occluders", occluders, OccluderTree, "what simplifier.load_occluder_tree returns")
    check_kind("name", name, str, "a text")
    check_whole("frames", frames, 1, MOST_PLAYED)
    check_cancel(cancel)
    matching_parts(scene, occluders)  # refused before a path is looked for, which takes longer
    path = _path(scene, PathOptions(frames=frames, up=occluders.options.up))
    options = CullOptions(repeats=1, shots=0)
    return encode_walk(fly(scene, occluders, path, options, cancel=cancel), name)


def _path(scene: Scene, options: PathOptions) -> CameraPath:
    fault: MeshError | None = None
    for tried in _ways(scene, options):
        try:
            return generate_path(scene, tried)
        except MeshError as error:
            fault = fault or error
    assert fault is not None
    raise fault


def _ways(scene: Scene, options: PathOptions) -> Iterator[PathOptions]:
    bounds = scene.bounds()
    longest = float((bounds[:, 1].max(axis=0) - bounds[:, 0].min(axis=0)).max())
    for height in (options.eye_height, _LOW * longest):
        for kind in _KINDS if height > 0.0 else ():
            yield replace(options, kind=kind, eye_height=height)
