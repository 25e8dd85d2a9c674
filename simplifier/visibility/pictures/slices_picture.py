"""The slices of an object that a cell draws -> a picture from above: the rest is an outline.

The picture looks past the cell at the object: what hides the outlined part stands before it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from numpy.typing import NDArray

from simplifier.camera_paths.columns import UprightScene
from simplifier.culling.item_buffer import ItemBuffer, Part
from simplifier.geometry.mesh import FloatArray, TriangleMesh, as_mesh
from simplifier.geometry.pvs import Pvs
from simplifier.geometry.scene import axis_order
from simplifier.geometry.solid import BoolArray
from simplifier.visibility.pictures.cut_mesh import areas, creases, outside, within
from simplifier.visibility.pictures.framed_figure import (
    DPI,
    FOOT,
    HEAD,
    INK,
    PIXELS,
    FramedFigure,
    rgb,
)
from simplifier.visibility.pictures.pictures import CELL, HIDDEN, SEEN
from simplifier.visibility.pictures.plan import RgbArray
from simplifier.visibility.pictures.plan_figure import STREET
from simplifier.visibility.pictures.slanted_view import SlantedView
from simplifier.visibility.pictures.telling_slices import PartlyDrawn, telling_slices
from simplifier.wording import percent, picture_line

_FINE = 2  # pixels that are drawn for one that is shown, along each side
_BEFORE = 0.3  # how much of others that stand before the object is seen
_SEAM = 0.8  # how dark lines between slices are
_LIGHT = np.array([-0.45, 0.65, -0.61])  # from over the left shoulder: right, up, forward
_DARKEST = 0.65
_PIECES = 64  # of a line, each of which is before a surface or behind it
_NEAR = 1e-4  # of the distance: as much is not behind
_ROUND = 2.5  # lengths of the object around it that others are drawn in


def slices_picture(upright: UprightScene, pvs: Pvs, name: str) -> bytes | None:
    """PNG of the most telling object; None where no cell draws a part of any.

    ``pvs`` has slices, and is of this scene in its upright space.
    """
    found = telling_slices(upright, pvs)
    if found is None:
        return None
    assert pvs.slices is not None
    own = _triangles(upright, [found.object])
    drawn = outside(own, found.hidden)
    cell = np.array([pvs.cells.low[found.cell], pvs.cells.high[found.cell]])
    view = SlantedView.past(cell, found.box)
    buffer = ItemBuffer(round(view.tall * _FINE * PIXELS), _FINE * PIXELS)
    others = _drawn(buffer, view, _triangles(upright, _around(upright, found)), rgb(HIDDEN))
    shown = _drawn(buffer, view, drawn, rgb(SEEN))
    shown.colours[_seams(view, shown.depth, found.box, pvs.slices.count)] *= _SEAM
    whose = picture_line(upright.scene.names[found.object])
    figure = FramedFigure(
        PIXELS / DPI + 0.4, HEAD + view.tall * PIXELS / DPI + FOOT - 0.5,
        title=f"{picture_line(name)}: the slices of '{whose}'",
        lines=_words(pvs, found, areas(drawn).sum() / areas(own).sum()),
    )  # fmt: skip
    axes = figure.add_axes(0.2, FOOT - 0.5, PIXELS / DPI, view.tall * PIXELS / DPI)
    axes.imshow(
        _image(others, shown),
        extent=(0.0, 1.0, 0.0, view.tall),
        interpolation="antialiased",
        zorder=1,
    )
    axes.set(xlim=(0.0, 1.0), ylim=(0.0, view.tall), xticks=[], yticks=[])
    _draw_lines(axes, view, within(creases(own), found.hidden), shown.depth)
    _draw_cell(axes, view, pvs.cells.outline(found.cell), cell[:, 2])
    figure.legend(
        [(CELL, "the cell"), (SEEN, "slices that are drawn"), ("white", "outline: not drawn"),
         (HIDDEN, "other objects")]
    )  # fmt: skip
    return figure.png()


def _words(pvs: Pvs, found: PartlyDrawn, share: float) -> str:
    assert pvs.slices is not None
    ranges = pvs.drawn(found.cell)[found.object].tolist()
    letters = ["xyz"[axis] for axis in axis_order(pvs.up)]
    told = [
        f"{low} to {high} along {letter}"
        for (low, high), letter in zip(ranges, letters, strict=True)
        if low <= high
    ]
    return (
        f"From cell {found.cell}, of its {pvs.slices.count} slices along each axis,"
        f" {' and '.join(told)} are drawn: {percent(share)} of its surface.\n"
        "All else of it is hidden from the whole cell."
    )


@dataclass(frozen=True, eq=False)
class _Drawn:
    """Surfaces in a picture: ``depth`` (rows, columns), infinite where there is none, and their
    ``colours`` (rows, columns, 3) from 0 to 255."""

    depth: FloatArray
    colours: NDArray[np.float32]


def _drawn(
    buffer: ItemBuffer, view: SlantedView, triangles: FloatArray, colour: FloatArray
) -> _Drawn:
    """Triangles (n, 3, 3) by the side that they turn to the light."""
    buffer.clear()
    mesh = TriangleMesh(*as_mesh(np.ascontiguousarray(triangles)))
    items = np.arange(len(triangles), dtype=np.int32)
    buffer.draw_parts([Part(mesh, np.eye(4), items)], view.camera)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    # Windings may be wrong: what is seen of a triangle is the side that is towards the viewer.
    towards = -np.sign(normals @ view.camera.axes[2])[:, None] * normals
    bright = _DARKEST + (1.0 - _DARKEST) * np.maximum(towards @ (_LIGHT @ view.camera.axes), 0.0)
    shades = np.append(bright[:, None] * colour, [rgb(STREET)], axis=0).astype(np.float32)
    return _Drawn(buffer.depth, shades[buffer.items])  # nothing is -1, the last


def _image(others: _Drawn, own: _Drawn) -> RgbArray:
    """(rows, columns, 3): the object, and the others; what of these stands before it is seen
    through."""
    picture = np.where(np.isfinite(own.depth)[..., None], own.colours, others.colours)
    before = np.isfinite(own.depth) & (others.depth < own.depth)
    picture[before] += _BEFORE * (others.colours[before] - own.colours[before])
    rows, columns = own.depth.shape
    size = columns // _FINE, rows // _FINE
    return np.asarray(cv2.resize(picture.astype(np.uint8), size, interpolation=cv2.INTER_AREA))


def _seams(view: SlantedView, depth: FloatArray, box: FloatArray, count: int) -> BoolArray:
    """(rows, columns) where points of neighbours on a surface are in two slices."""
    there = np.isfinite(depth)
    size = box[1] - box[0]
    shares = (view.points(np.where(there, depth, 0.0)) - box[0]) / np.maximum(
        size, 1e-9 * size.max()
    )
    slices = np.clip(count * shares, 0, count - 1).astype(np.int8)
    seams: BoolArray = np.zeros(depth.shape, dtype=np.bool_)
    seams[1:] |= there[:-1] & (slices[1:] != slices[:-1]).any(axis=2)
    seams[:, 1:] |= there[:, :-1] & (slices[:, 1:] != slices[:, :-1]).any(axis=2)
    return np.asarray(seams & there)


def _around(upright: UprightScene, found: PartlyDrawn) -> NDArray[np.int64]:
    """The other objects that may be in the picture."""
    room = _ROUND * float(np.linalg.norm(found.box[1] - found.box[0]))
    plans = upright.boxes[:, :, :2]
    low, high = found.box[:, :2] + np.array([[-room], [room]])
    near = np.flatnonzero(((plans[:, 0] <= high) & (plans[:, 1] >= low)).all(axis=1))
    return np.setdiff1d(near, found.object)


def _triangles(upright: UprightScene, objects: Sequence[int] | NDArray[np.int64]) -> FloatArray:
    """(n, 3, 3) of objects, upright."""
    if len(objects) == 0:
        return np.empty((0, 3, 3))
    mesh = upright.scene.joined(np.asarray(objects, dtype=np.int32))
    return np.asarray((mesh.vertices[:, upright.order] - upright.origin)[mesh.faces])


def _draw_lines(axes: Any, view: SlantedView, lines: FloatArray, depth: FloatArray) -> None:
    """Lines (k, 2, 3), less what is behind a surface of these depths."""
    ends = np.linspace(lines[:, 0], lines[:, 1], _PIECES + 1, axis=1)
    pieces = np.stack([ends[:, :-1], ends[:, 1:]], axis=2).reshape(-1, 2, 3)
    middles = pieces.mean(axis=1)
    rows, columns = depth.shape
    x, y = columns * view.on_picture(middles).T
    inside = (x >= 0) & (x < columns) & (y > 0) & (y <= rows)
    places = np.where(inside, rows - y, 0).astype(int), np.where(inside, x, 0).astype(int)
    away = (middles - view.camera.position) @ view.camera.axes[2]
    pieces = pieces[inside & (away <= depth[places] * (1.0 + _NEAR))]
    axes.add_collection(
        LineCollection(
            list(view.on_picture(pieces)), colors=INK, linewidths=0.8, capstyle="round", zorder=3
        )
    )


def _draw_cell(axes: Any, view: SlantedView, outline: FloatArray, heights: FloatArray) -> None:
    """The floor of a cell, its sides, and its top."""
    low, high = (np.column_stack([outline, np.full(len(outline), z)]) for z in heights)
    turned = np.roll(np.arange(len(outline)), -1)
    sides = np.stack([low, low[turned], high[turned], high], axis=1)
    for faces in (low[None], sides, high[None]):
        axes.add_collection(
            PolyCollection(
                list(view.on_picture(faces)), facecolors=CELL, edgecolors="white",
                linewidths=0.5, alpha=0.75, zorder=4,
            )
        )  # fmt: skip
