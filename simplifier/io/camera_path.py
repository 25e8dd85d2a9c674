"""Camera paths as JSON, by ``docs/camera_path.schema.json``."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from simplifier.checks import as_path
from simplifier.errors import UnreadablePathError
from simplifier.geometry.camera import Camera, CameraPath
from simplifier.geometry.mesh import FloatArray
from simplifier.io.files import read_bytes, write_whole
from simplifier.io.objects import encodable
from simplifier.options.scene import LEAST_FOV

SCHEMA_VERSION = 1

DEFAULT_NEAR = 0.05
"""World units; of a frame that names none."""

_ROOT = ("schema_version", "name", "frames")
_FRAME = ("position", "forward", "target", "up", "fov", "near")
_PARALLEL = 1e-6  # sine of the angle of two directions that no picture can tell apart
_SHORTEST = 1e-300  # of a direction; below, float64 loses digits
_TOO_NEAR = "target is the position"
_MOST = 1e150  # beyond, squared lengths overflow


def load_camera_path(path: str | Path) -> CameraPath:
    """The frames of a file as :func:`save_camera_path` writes it, or made by hand.

    A frame has ``position``, ``up``, ``fov`` (degrees) and either ``forward`` or ``target``, a
    point to look at; ``near`` may be left out.  Raises :class:`UnreadablePathError`, which names
    the frame, counted from 0, and the field.
    """
    path = as_path("path", path)
    where = str(path)
    root = _parse(read_bytes(path, error=UnreadablePathError, remedy=_NAME_ONE), where)
    if not isinstance(root, dict):
        raise _wrong(where, "this is not a JSON object")
    _check_keys(root, _ROOT, _ROOT, where)
    version, name, frames = root["schema_version"], root["name"], root["frames"]
    if isinstance(version, bool) or version != SCHEMA_VERSION:
        raise _wrong(where, f"schema_version is {_short_json(version)}, not {SCHEMA_VERSION}")
    if not isinstance(name, str):
        raise _wrong(where, f"name is {_short_json(name)}, not a text")
    if not isinstance(frames, list) or not frames:
        raise _wrong(where, "frames is not a list of at least one frame")
    return CameraPath(
        encodable(name),
        tuple(_camera(frame, f"{where}: frame {i}") for i, frame in enumerate(frames)),
    )


def save_camera_path(camera_path: CameraPath, path: str | Path) -> None:
    """Write the frames as JSON; positions come back bit by bit, directions to the last digit.

    Raises :class:`OutputError` when the file cannot be written.
    """
    frames = [
        {
            "position": camera.position.tolist(),
            "forward": camera.axes[2].tolist(),
            "up": camera.axes[1].tolist(),
            "fov": float(camera.fov),
            "near": float(camera.near),
        }
        for camera in camera_path.cameras
    ]
    name = json.dumps(camera_path.name)
    lines = ",\n".join(json.dumps(frame, allow_nan=False) for frame in frames)
    text = f'{{"schema_version": {SCHEMA_VERSION}, "name": {name}, "frames": [\n{lines}\n]}}\n'
    write_whole(as_path("path", path), text.encode("ascii"))


_NAME_ONE = "name a camera path"


def _parse(data: bytes, where: str) -> Any:
    def refuse(name: str) -> NoReturn:
        raise ValueError(f"{name} is not a number in JSON")

    try:
        return json.loads(data.decode("utf-8-sig"), parse_constant=refuse)
    except (ValueError, RecursionError) as error:  # bad UTF-8 and bad JSON are ValueErrors
        raise _wrong(where, f"this is not JSON ({error})") from None


def _camera(frame: Any, where: str) -> Camera:
    if not isinstance(frame, dict):
        raise _wrong(where, "this is not a JSON object")
    ways = [key for key in ("forward", "target") if key in frame]
    if len(ways) != 1:
        fault = "both forward and target are" if ways else "neither forward nor target is"
        raise _wrong(where, f"{fault} given")
    _check_keys(frame, ("position", *ways, "up", "fov"), _FRAME, where)
    position, up = _vector(frame, "position", where), _vector(frame, "up", where)
    ahead = _vector(frame, ways[0], where)
    if ways == ["target"]:
        ahead = ahead - position
    ahead = _unit_scale(ahead, "forward is zero" if ways == ["forward"] else _TOO_NEAR, where)
    up = _unit_scale(up, "up is zero", where)
    if np.linalg.norm(np.cross(ahead, up)) < _PARALLEL:
        raise _wrong(where, f"up is parallel to {ways[0]}")
    fov = _number(frame["fov"], "fov", where)
    if not LEAST_FOV <= fov < 180.0:
        raise _wrong(where, f"fov is {fov:g}, not from {LEAST_FOV:g} to below 180 degrees")
    near = _number(frame.get("near", DEFAULT_NEAR), "near", where)
    if near <= 0.0:
        raise _wrong(where, f"near is {near:g}, not above 0")
    return Camera.looking(position, ahead, up, fov, near)


def _unit_scale(direction: FloatArray, fault: str, where: str) -> FloatArray:
    """To about unit length by its longest component, so that nothing under- or overflows."""
    length = float(np.abs(direction).max())
    if length < _SHORTEST:
        raise _wrong(where, fault)
    return direction / length


def _check_keys(
    members: dict[str, Any], needed: Iterable[str], known: Iterable[str], where: str
) -> None:
    for key in needed:
        if key not in members:
            raise _wrong(where, f"{key} is missing")
    for key in members:
        if key not in known:
            raise _wrong(where, f"{_short_json(key)} is no known field")


def _vector(frame: dict[str, Any], key: str, where: str) -> FloatArray:
    value = frame[key]
    if not isinstance(value, list) or len(value) != 3:
        raise _wrong(where, f"{key} is {_short_json(value)}, not a list of three numbers")
    return np.array([_number(one, key, where) for one in value])


def _number(value: Any, key: str, where: str) -> float:
    # A whole number of any length is legal JSON; one too large for a float must not meet one.
    real = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not real or not -_MOST < value < _MOST or not math.isfinite(value):
        raise _wrong(where, f"{key} holds {_short_json(value)}, not a finite number")
    return float(value)


def _short_json(value: Any) -> str:
    """As JSON, cut to a length that fits a line."""
    text = json.dumps(value)
    return text if len(text) <= 40 else f"{text[:37]}..."


def _wrong(where: str, what: str) -> UnreadablePathError:
    return UnreadablePathError(
        what, where=where, remedy="see docs/camera_path.schema.json for the format"
    )
