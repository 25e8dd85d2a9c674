"""Scene -> CameraPath: walks and flights to judge occluders along.

All lengths are multiples of the eye height, so a scene in other units than metres needs that one
option.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import get_args

import numpy as np

from simplifier.camera_paths.columns import UprightScene
from simplifier.camera_paths.flight import roof_flight
from simplifier.camera_paths.interior import interior_walk
from simplifier.camera_paths.street import street_walk
from simplifier.camera_paths.walk import views
from simplifier.errors import MeshError
from simplifier.geometry.camera import Camera, CameraPath
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.scene import Scene
from simplifier.options.scene import PathKind, PathOptions

Finder = Callable[[UprightScene, int, float, np.random.Generator], FloatArray | None]

_FINDERS: dict[PathKind, Finder] = {
    "street": street_walk, "roof": roof_flight, "inside": interior_walk,
}  # fmt: skip
_TURNS: dict[PathKind, tuple[float, float]] = {
    "street": (30.0, 0.0), "roof": (20.0, -12.0), "inside": (50.0, 0.0),
}  # fmt: skip
"""How far a camera turns to both sides of its way, and its tilt, degrees."""

_NEAR = 0.03  # eye heights; walls are more than a voxel of 0.06 away


def generate_path(scene: Scene, options: PathOptions) -> CameraPath:
    """Cameras in equal steps along a way through a scene, the same for the same seed.

    ``kind``    ``street``: a walk at eye height over the ground, between the objects, and where
                there is no ground at the height of the bases nearby; ``roof``: a flight just above
                the roofs, looking slightly down; ``inside``: a walk through rooms that something
                leads out of, and through the objects whose names say that they are doors.
    ``frames``  a walk is as long as they allow: 8 eye heights a step on a street, 3 inside.

    Neither a camera nor the straight way from one to the next crosses a triangle (doors aside).
    Raises :class:`MeshError` where the scene has no room for the kind; it says which kinds have.
    """
    upright = UprightScene.of(scene, options.up)
    places = _places(upright, options)
    if places is None:
        raise _no_room(upright, options)
    turn, tilt = _TURNS[options.kind]
    rng = np.random.default_rng([options.seed, 1])
    forwards = upright.directions_to_world(views(places, rng, turn=turn, tilt=tilt))
    upwards = upright.directions_to_world(np.array([[0.0, 0.0, 1.0]]))[0]
    near = _NEAR * options.eye_height
    return CameraPath(
        options.kind,
        tuple(
            Camera.looking(place, forward, upwards, options.fov, near)
            for place, forward in zip(upright.to_world(places), forwards, strict=True)
        ),
    )


def _places(upright: UprightScene, options: PathOptions) -> FloatArray | None:
    """(frames, 3) upright space; None where there is no room."""
    rng = np.random.default_rng(options.seed)
    return _FINDERS[options.kind](upright, options.frames, options.eye_height, rng)


def _no_room(upright: UprightScene, options: PathOptions) -> MeshError:
    """Says which kinds there is room for, which takes as long as trying them."""
    others = [replace(options, kind=kind, frames=1) for kind in get_args(PathKind)]
    fine = [o.kind for o in others if o.kind != options.kind and _places(upright, o) is not None]
    return MeshError(
        f"the scene has no room for a path of kind {options.kind} at an eye height of"
        f" {options.eye_height:g}",
        remedy=f"choose {' or '.join(fine)}, or an eye height that fits the scene's units",
    )
