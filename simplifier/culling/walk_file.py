"""Flythrough -> the bytes that a page plays it from: ``docs/formats.md``, "Walks".

Everything that moves is bits.  A frame has three for the fate of each part and one for each
occluder, as differences from the frame before, which is mostly zeros: gzip makes a few hundred
bytes of a frame of thousands of parts.  Positions are 16 bits within the box of their part.
"""

from __future__ import annotations

import gzip
import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.culling.flythrough import Flythrough
from simplifier.culling.upward import up_axis
from simplifier.geometry.boxed_scene import with_boxes
from simplifier.geometry.camera import Camera
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.scene import Scene
from simplifier.version import VERSION

WALK_VERSION = 1
"""Raised when a reader of before would show something else."""

MAGIC = b"OWLK"

_MOST_TRIANGLES = 300_000
"""Of the scene as it is shown; larger objects become boxes."""

_STEPS = 65_535
_PLANES = 3  # bits of a fate

Mesh = tuple[FloatArray, IntArray]


def encode_walk(flown: Flythrough, scene_name: str) -> bytes:
    """The file; the same walk gives the same bytes, for no time that was measured is in it."""
    keys = sorted({one for frame in flown.played for one in frame.drawn})
    shown, _ = with_boxes(flown.parts.scene, _MOST_TRIANGLES)
    meshes = [*_parts(shown), *(_occluder(flown, *key) for key in keys)]
    low, high = _bounds(meshes)
    origin = 0.5 * (low.min(axis=0) + high.max(axis=0))
    counts = np.array([(len(points), len(faces)) for points, faces in meshes], dtype="<u4")
    arrays: dict[str, NDArray[Any]] = {
        "cameras": _cameras([*flown.path.cameras[: len(flown.played)]], origin),
        "boxes": np.concatenate([low - origin, high - low], axis=1).astype("<f4"),
        "counts": counts,
        "indices": np.concatenate([faces.ravel() for _, faces in meshes]).astype("<u4"),
        "positions": np.concatenate(
            [_steps(points, low[at], high[at]) for at, (points, _) in enumerate(meshes)]
        ),
        "fates": changes(_planes(np.stack([frame.fates for frame in flown.played]))),
        "drawn": changes(_drawn(flown, keys)),
    }
    header = {
        "version": WALK_VERSION,
        "made_by": f"planar-occluder {VERSION}",
        "scene": scene_name,
        "path": flown.path.name,
        "frames": len(flown.played),
        "frames_of_path": len(flown.path.cameras),
        "parts": len(flown.parts.object_of),
        "objects": len(flown.scene),
        "triangles": int(flown.scene.triangle_counts.sum()),
        "occluders": len(keys),
        "up": up_axis(flown.path),
        "upward": _upward(flown),
        "aspect": flown.options.columns / flown.options.rows,
        "figures": _figures(flown),
    }
    return gzip.compress(_packed(header, arrays), 6, mtime=0)


def _parts(scene: Scene) -> Iterator[Mesh]:
    for index in range(len(scene)):
        mesh = scene.joined([index])
        yield mesh.vertices, mesh.faces


def _occluder(flown: Flythrough, node: int, level: int) -> Mesh:
    """In the world, as it was drawn."""
    if isinstance(flown.occluders, Scene):
        mesh = flown.occluders.joined([node])
        return mesh.vertices, mesh.faces
    points, faces, _ = flown.occluders.placed(node, level)
    return points, faces


def _bounds(meshes: Sequence[Mesh]) -> tuple[FloatArray, FloatArray]:
    return (
        np.array([points.min(axis=0) for points, _ in meshes]),
        np.array([points.max(axis=0) for points, _ in meshes]),
    )


def _steps(points: FloatArray, low: FloatArray, high: FloatArray) -> NDArray[np.uint16]:
    """(n, 3) of :data:`_STEPS` through a box."""
    size = np.where(high > low, high - low, 1.0)
    return np.asarray(np.round((points - low) / size * _STEPS), dtype="<u2")


def _cameras(cameras: Sequence[Camera], origin: FloatArray) -> NDArray[np.float32]:
    """(frames, 14): position, right, up, forward, field of view in degrees, near."""
    rows = [[*(one.position - origin), *one.axes.ravel(), one.fov, one.near] for one in cameras]
    return np.array(rows, dtype="<f4")


def _upward(flown: Flythrough) -> float:
    """1 or -1: which way along the up axis."""
    axis = up_axis(flown.path)
    total = sum(float(camera.axes[1, axis]) for camera in flown.path.cameras)
    return -1.0 if total < 0.0 else 1.0


def _planes(fates: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """(frames, bytes) of fates (frames, p): the lowest bit of all parts, then the next."""
    planes = [np.packbits((fates >> bit) & 1, axis=1, bitorder="little") for bit in range(_PLANES)]
    return np.concatenate(planes, axis=1)


def _drawn(flown: Flythrough, keys: Sequence[tuple[int, int]]) -> NDArray[np.uint8]:
    """(frames, bytes): a bit for each occluder."""
    places = {key: at for at, key in enumerate(keys)}
    bits = np.zeros((len(flown.played), len(keys)), dtype=np.uint8)
    for row, frame in zip(bits, flown.played, strict=True):
        row[[places[one] for one in frame.drawn]] = 1
    return np.packbits(bits, axis=1, bitorder="little")


def changes(rows: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Each row's bits that differ from those of the row before; from none, of the first."""
    changed = rows.copy()
    changed[1:] ^= rows[:-1]
    return changed


def _figures(flown: Flythrough) -> dict[str, list[int]]:
    """A number a frame, as :class:`~simplifier.culling.fate.Counts` has them, of the objects."""
    told = [frame.figures for frame in flown.frames[: len(flown.played)]]
    return {
        "in_view": [one.objects.in_view for one in told],
        "hidden": [one.objects.hidden for one in told],
        "culled": [one.objects.culled for one in told],
        "wrong": [one.objects.wrong for one in told],
        "wrong_pixels": [one.wrong_pixels for one in told],
        "occluders": [one.occluders for one in told],
        "occluder_triangles": [one.occluder_triangles for one in told],
    }


def _packed(header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """The arrays follow the header, each at a multiple of 4 bytes from the end of the header."""
    places, blob = {}, bytearray()
    for name, values in arrays.items():
        places[name] = {"at": len(blob), "type": values.dtype.str, "shape": list(values.shape)}
        blob += values.tobytes()
        blob += bytes(-len(blob) % 4)
    text = json.dumps({**header, "arrays": places}, allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    return MAGIC + len(text).to_bytes(4, "little") + text + bytes(blob)
