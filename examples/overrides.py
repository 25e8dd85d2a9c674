"""The picture of docs/overrides.md: the castle's gate, its occluder, and the same with overrides.

``python -m examples.overrides castle_plain.obj castle_overridden.obj overrides.png``, of occluders
that ``occluder simplify`` made without and with ``examples/castle.overrides.toml``.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import simplifier
from examples.castle import castle
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.views import image_axes
from simplifier.report.png import png_bytes

_EYE = np.array([0.25, -0.3, -1.0])  # the direction in which one looks
_CENTRE, _SPAN = np.array([-6.0, 11.0, 24.0]), (60.0, 34.0)  # metres that a panel shows
_PIXELS = 12.0  # a metre
_STONE, _FOUND, _DRAWN = (168, 162, 150), (92, 130, 190), (232, 150, 40)
_GAP = 8


def picture(plain: FloatArray, overridden: FloatArray, drawn: FloatArray) -> np.ndarray:
    """(rows, columns, 3) uint8: three panels of soups (m, 3, 3), what is drawn in orange."""
    mesh = castle()
    by_hand = {tuple(triangle.ravel().tolist()) for triangle in np.sort(drawn.round(3), axis=1)}
    known = np.sort(overridden.round(3), axis=1)
    colours = [_DRAWN if tuple(one.ravel().tolist()) in by_hand else _FOUND for one in known]
    panels = [
        _shaded(mesh.vertices[mesh.faces], [_STONE] * len(mesh.faces)),
        _shaded(plain, [_FOUND] * len(plain)),
        _shaded(overridden, colours),
    ]
    gap = np.full((panels[0].shape[0], _GAP, 3), 255, dtype=np.uint8)
    return np.concatenate([panels[0], gap, panels[1], gap, panels[2]], axis=1)


def _shaded(triangles: FloatArray, colours: list[tuple[int, int, int]]) -> np.ndarray:
    """The nearest triangle of each pixel in its colour, lit from the eye."""
    axes = image_axes(_EYE[None] / np.linalg.norm(_EYE))[0] * np.array([[-1.0], [1.0], [1.0]])
    columns, rows = (int(length * _PIXELS) for length in _SPAN)
    seen = (triangles - _CENTRE) @ axes.T * _PIXELS
    seen = seen * [1.0, -1.0, 1.0] + [columns / 2, rows / 2, 0.0]
    picture = np.full((rows, columns, 3), 255, dtype=np.uint8)
    depths = np.full((rows, columns), np.inf)
    for corners, colour in zip(seen, colours, strict=True):
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        low = np.clip(np.floor(corners.min(axis=0))[:2], 0, [columns, rows]).astype(int)
        high = np.clip(np.ceil(corners.max(axis=0))[:2], 0, [columns, rows]).astype(int)
        y, x = np.mgrid[low[1] : high[1], low[0] : high[0]] + 0.5
        if x.size == 0 or abs(normal[2]) < 1e-9:
            continue
        sides = [
            ((q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])) * np.sign(normal[2]) >= 0.0
            for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True)
        ]
        z = (
            corners[0, 2]
            - ((x - corners[0, 0]) * normal[0] + (y - corners[0, 1]) * normal[1]) / (normal[2])
        )
        place = np.s_[low[1] : high[1], low[0] : high[0]]
        nearer = np.logical_and.reduce(sides) & (z < depths[place])
        light = 0.35 + 0.65 * abs(normal[2]) / np.linalg.norm(normal)
        depths[place][nearer] = z[nearer]
        picture[place][nearer] = (light * np.array(colour)).astype(np.uint8)
    return picture


def main() -> None:
    """Write the picture."""
    plain, overridden = (simplifier.load_occluder(path) for path in sys.argv[1:3])
    overrides = simplifier.load_overrides(Path(__file__).with_name("castle.overrides.toml"))
    shown = picture(
        plain.vertices[plain.faces], overridden.vertices[overridden.faces], overrides.triangles
    )
    Path(sys.argv[3]).write_bytes(png_bytes(shown))


if __name__ == "__main__":
    main()
