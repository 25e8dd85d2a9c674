"""Visible sets of every kind: cells that touch, overlap and lie apart, in plan and in height."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from simplifier.geometry.pvs import (
    METHODS,
    NEVER,
    SLICES,
    UNKNOWN,
    Altitudes,
    Pvs,
    Rows,
    Slices,
    pack_rows,
)
from simplifier.geometry.view_cells import ViewCells, signed_areas

_ORIGINS = st.sampled_from([0.0, 0.1, -3.5, 4.2e6])
_COORDINATES = st.sampled_from([-7.0, -1.0, 0.0, 0.1, 1 / 3, 1.0, 2.5, 3.0]) | st.floats(
    -2000.0, 2000.0, width=32
)
_LENGTHS = st.sampled_from([0.001, 0.1, 1.0, 1.0, 3.0, 5000.0])


@st.composite
def grids(draw: st.DrawFn) -> ViewCells:
    """Boxes that touch each other, as wide as float32 lets them be."""
    columns, rows = draw(st.integers(1, 6)), draw(st.integers(1, 6))
    corner, edge = draw(st.tuples(_COORDINATES, _COORDINATES)), draw(st.floats(0.1, 9.0))
    places = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 2)
    low, high = corner + edge * places, corner + edge * (places + 1)
    return ViewCells.boxes(
        np.column_stack([low, np.zeros(len(low))]), np.column_stack([high, np.ones(len(low))])
    )


@st.composite
def boxes(draw: st.DrawFn) -> ViewCells:
    """Boxes anywhere, some of them huge beside others."""
    low = np.array(
        draw(st.lists(st.tuples(*3 * [_COORDINATES]), min_size=1, max_size=8)), dtype=np.float64
    )
    size = [draw(st.tuples(*3 * [_LENGTHS])) for _ in low]
    return ViewCells.boxes(low, low + size)


@st.composite
def prisms(draw: st.DrawFn) -> ViewCells:
    """A fan of triangles around a corner, as a navigation mesh has them."""
    corner = draw(st.tuples(_COORDINATES, _COORDINATES))
    turns = np.sort(draw(st.lists(st.floats(0.0, 6.25, width=16), min_size=2, max_size=7)))
    around = corner + draw(_LENGTHS) * np.column_stack([np.cos(turns), np.sin(turns)])
    middle = np.broadcast_to(corner, around[1:].shape)
    corners = np.stack([middle, around[:-1], around[1:]], axis=1).astype(np.float32)
    corners = corners[np.abs(signed_areas(corners.astype(np.float64))) > 1e-9].astype(np.float64)
    bottom = np.full(len(corners), draw(st.sampled_from([-1.0, 0.0, 0.5])))
    return ViewCells.prisms(corners, bottom, bottom + 2.0)


def view_cells() -> st.SearchStrategy[ViewCells]:
    """None to some dozens, of several kinds."""
    some = st.lists(grids() | boxes() | prisms(), max_size=3)
    return some.map(lambda parts: ViewCells.joined(_no_cells(), *parts))


def _no_cells() -> ViewCells:
    return ViewCells.boxes(np.empty((0, 3)), np.empty((0, 3)))


@st.composite
def visible_sets(draw: st.DrawFn) -> Pvs:
    """Any number of objects, with and without names; some cells may not be computed."""
    cells = draw(view_cells())
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    objects = draw(st.sampled_from([0, 1, 3, 63, 64, 65, 200, 700]))
    sets = [_set(random, objects) for _ in range(draw(st.integers(0, 6)))]
    rows, places = pack_rows(sets)
    row_of = random.choice([UNKNOWN, *places.tolist()], len(cells))
    if draw(st.booleans()) and len(places):
        row_of = np.where(row_of == UNKNOWN, places[0], row_of)
    start = draw(st.sampled_from(["", "wall ", "Häuser/", "日本\0", "\U0001f3f0"]))
    names = [f"{start}{index}" if start else "" for index in range(objects)]
    return Pvs(
        draw(st.sampled_from("xyz")),
        np.array(draw(st.tuples(_ORIGINS, _ORIGINS, _ORIGINS))),
        tuple(names),
        random.permutation(objects).astype(np.int32),
        cells,
        rows,
        row_of.astype(np.int64),
        draw(st.sampled_from(METHODS)),
        draw(st.booleans()),
        random.bytes(8),
        random.bytes(8),
        _slices(random, rows, row_of, objects) if draw(st.booleans()) else None,
        _altitudes(random, (len(cells), objects)) if draw(st.booleans()) else None,
    )


def _slices(
    random: np.random.Generator, rows: Rows, row_of: NDArray[np.int64], objects: int
) -> Slices:
    counts = [0 if row == UNKNOWN else int(rows.row(row, objects).sum()) for row in row_of.tolist()]
    starts = np.cumsum([0, *counts], dtype=np.int64)
    count = int(random.choice([1, SLICES, 127]))
    plan = random.integers(1 - count, count + 1, (starts[-1], 2))
    height = random.integers(0, count + 1, (starts[-1], 1))
    values = np.concatenate([plan, height], axis=1) * random.integers(0, 2, (starts[-1], 3))
    return Slices(starts, values.astype(np.int8), count)


def _altitudes(random: np.random.Generator, shape: tuple[int, int]) -> Altitudes:
    values = np.where(
        random.random(shape) < 0.3, random.choice([0, NEVER], shape), random.integers(0, 99, shape)
    )
    low, step = np.float32(random.choice([-7.0, 0.1, 0.0])), np.float32(random.choice([0.1, 1e-3]))
    return Altitudes(float(low), float(step), values.astype(np.uint16))


def _set(random: np.random.Generator, objects: int) -> NDArray[np.bool_]:
    """Few objects or many, one by one or in long runs."""
    few = random.random(objects) < random.choice([0.0, 0.05, 0.5, 1.0])
    return np.asarray(np.repeat(few, random.choice([1, 40]))[:objects])


def points_around(cells: ViewCells, random: np.random.Generator) -> NDArray[np.float64]:
    """(n, 3) float64 in the cells' space: on corners, edges and borders, one ulp off, and between.

    Those on no corner are drawn, so that some are far from all cells.
    """
    if not len(cells):
        return np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]])
    known = np.concatenate([cells.low, cells.high])
    outlines = np.concatenate([cells.outline(cell) for cell in range(len(cells))])
    edges = np.concatenate([
        0.5 * (outline + np.roll(outline, 1, axis=0))
        for outline in map(cells.outline, range(len(cells)))
    ])  # fmt: skip
    plan = np.concatenate([outlines, edges])
    heights = random.choice(known[:, 2], len(plan))
    drawn = random.uniform(known.min(axis=0) - 1.0, known.max(axis=0) + 1.0, (60, 3))
    mixed = np.column_stack([random.choice(axis, 60) for axis in known.T])
    points = np.concatenate([known, np.column_stack([plan, heights]), drawn, mixed])
    towards = random.choice([-np.inf, np.inf], points.shape)
    off = np.where(random.random(points.shape) < 0.5, np.nextafter(points, towards), points)
    return np.concatenate([points, off])
