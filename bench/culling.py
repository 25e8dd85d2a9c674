"""The kernels of culling on one core, on a city seen from three heights, beside their floors.

The set: 10,000 triangles of a thousand houses and 10,000 boxes of things, all within the view, on a
depth buffer of 320 x 180 (:mod:`bench.city`); ``pixels`` is what a triangle or a box covers on
average.  Target: both together within 10 ms.  The item buffer's set is ten million triangles.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from unittest.mock import patch

import numpy as np

from bench.city import City, city
from bench.meshes import bumpy_sphere
from bench.rates import bytes_a_second, seconds
from bench.record import Row
from simplifier.culling.depth_buffer import DepthBuffer, Verdict
from simplifier.culling.item_buffer import ItemBuffer, Part
from simplifier.geometry.camera import Camera
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.geometry.weld import edge_pairs

_HEIGHTS = (1.7, 30.0, 150.0)  # metres: on foot, on a roof, in the air
_ERROR = 0.05  # metres that the occluders may be off


def culling_times(repeats: int) -> Iterator[Row]:
    """One row a kernel and height; each timing is a median of its own, ``repeats`` is not used."""
    del repeats
    with patch.dict(os.environ, OCCLUDER_THREADS="1"):
        for height in _HEIGHTS:
            yield from _city_rows(height, city(height))
        yield from _single_calls()
        yield _items()


def _city_rows(height: float, scene: City) -> Iterator[Row]:
    triangles, boxes, camera = scene.triangles, scene.boxes, scene.camera
    pixels = _fragments(triangles, camera) / len(triangles)
    buffer = DepthBuffer()
    draws = seconds(lambda: buffer.draw(triangles, camera, _ERROR), buffer.clear)
    size = triangles.nbytes + round(8 * pixels * len(triangles))
    text = "read triangles, read and write a depth for each pixel"
    yield _row(f"draw at {height} m", len(triangles), pixels, draws, size, text)

    inner, soup = DepthBuffer(coverage="inner"), _soup(triangles)
    pairs = edge_pairs(soup.faces)
    took = seconds(
        lambda: inner.draw_mesh(soup.vertices, soup.faces, camera, _ERROR, pairs), inner.clear
    )
    yield _row(f"draw inside at {height} m", len(triangles), pixels, took, size, text)

    def draw_again() -> None:
        buffer.clear()
        buffer.draw(triangles, camera, _ERROR)

    tests = seconds(lambda: buffer.test(boxes, camera), draw_again)
    verdicts = buffer.test(boxes, camera)
    size = boxes.nbytes + buffer.depth.nbytes + len(verdicts)
    text = "read boxes, read every depth once, write a byte"
    row = _row(f"test at {height} m", len(boxes), 0.0, tests, size, text)
    hidden = float(np.mean(verdicts == Verdict.HIDDEN))
    yield {**row, "pixels": None, "hidden": hidden, "draw_and_test_ms": 1e3 * (draws + tests)}


def _single_calls() -> Iterator[Row]:
    """What a traversal pays that draws a few triangles and tests one box at a time, from Python."""
    scene, buffer = city(1.7), DepthBuffer()
    few, one = scene.triangles[2000:2020], scene.boxes[:1]
    pixels = _fragments(few, scene.camera) / len(few)
    took = seconds(lambda: buffer.draw(few, scene.camera, _ERROR))
    yield _row("one draw of 20 triangles", 1, pixels, took, few.nbytes, "read triangles")
    took = seconds(lambda: buffer.test(one, scene.camera))
    yield _row("one test of 1 box", 1, 0.0, took, one.nbytes, "read boxes")


def _items() -> Row:
    mesh, count = bumpy_sphere(200_000), 50
    transforms = np.tile(np.eye(4), (count, 1, 1))
    spread = np.random.default_rng(0).uniform(-5.0, 5.0, (count, 3))
    transforms[:, :3, 3] = spread * mesh.extent.max()
    names = tuple(str(index) for index in range(count))
    scene = Scene((mesh,), names, np.zeros(count, dtype=np.int32), transforms)
    back = np.array([0.0, 0.0, -12.0]) * mesh.extent.max()
    camera = Camera.looking(back, -back, np.array([0.0, 1.0, 0.0]), 60.0, 0.1)
    buffer = ItemBuffer(720, 1280)
    took = seconds(lambda: buffer.draw(scene, camera), buffer.clear)
    total = int(scene.triangle_counts.sum())
    size = count * (mesh.vertices.nbytes + mesh.faces.nbytes) + 12 * total
    text = "read vertices, faces and three 4-byte cells a triangle"
    pixels = float(buffer.fragments.sum()) / total
    return _row("items at 1280 x 720", total, pixels, took, size, text)


def _fragments(triangles: np.ndarray, camera: Camera) -> float:
    buffer = ItemBuffer(180, 320)
    buffer.draw_parts([Part(_soup(triangles), np.eye(4), 0)], camera)
    return float(buffer.fragments.sum())


def _soup(triangles: np.ndarray) -> TriangleMesh:
    """Equal corners become one vertex."""
    vertices, faces = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    return TriangleMesh(vertices, np.ascontiguousarray(faces.reshape(-1, 3), dtype=np.int32))


def _row(kernel: str, count: int, pixels: float, took: float, size: int, text: str) -> Row:
    floor = size / bytes_a_second(size)
    return {
        "kernel": kernel, "units": count, "pixels": pixels, "ns": 1e9 * took / count,
        "ms": 1e3 * took, "times_floor": took / floor, "floor": text,
    }  # fmt: skip
