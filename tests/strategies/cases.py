"""Cases of the fuzzer (``tests/fuzz/cases.py``) from meshes and options."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import strategies as st

from tests.strategies.meshes import Soup, ordinary_soups, scales, soups
from tests.strategies.options import evaluate_options, scene_options, simplify_options

Case = dict[str, Any]

_MOST_OBJECTS = 6


def _written(soup: Soup) -> dict[str, Any]:
    vertices, faces = soup
    return {"vertices": vertices.tolist(), "faces": faces.tolist()}


def _longest(soup: Soup) -> float:
    """Of the usable part's bounding box, about; 1 where there is none."""
    points = soup[0][soup[1].ravel()]
    points = points[(np.abs(points) < 1e100).all(axis=1)]
    longest = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    return longest or 1.0


@st.composite
def simplify_cases(draw: st.DrawFn) -> Case:
    """A mesh, and options that fit its size."""
    soup = draw(soups())
    return {"mesh": _written(soup), "options": draw(simplify_options(_longest(soup)))}


@st.composite
def evaluate_cases(draw: st.DrawFn) -> Case:
    """A mesh, and another soup in place of its occluder; or itself, or a part of it."""
    soup = draw(soups())
    other = draw(st.sampled_from([soup, (soup[0], soup[1][::2]), None]))
    return {
        "mesh": _written(soup),
        "occluder": _written(draw(soups()) if other is None else other),
        "options": draw(evaluate_options(_longest(soup))),
    }


@st.composite
def scene_cases(draw: st.DrawFn) -> Case:
    """A few objects of a few meshes: turned, stretched, mirrored, far off; and some cameras."""
    meshes = draw(st.lists(ordinary_soups | soups(), min_size=1, max_size=3))
    place = st.integers(0, len(meshes) - 1)
    mesh_of = draw(st.lists(place, min_size=1, max_size=_MOST_OBJECTS))
    return {
        "meshes": [_written(soup) for soup in meshes],
        "mesh_of": mesh_of,
        "transforms": [draw(transforms()).tolist() for _ in mesh_of],
        "options": draw(scene_options(max(map(_longest, meshes)))),
        "cameras": draw(st.lists(cameras(), max_size=2)),
    }


@st.composite
def transforms(draw: st.DrawFn) -> np.ndarray[Any, np.dtype[np.float64]]:
    """(4, 4) affine; most can be inverted."""
    transform = np.eye(4)
    stretch = st.sampled_from([1.0, 1.0, 1.0, -1.0, 0.5, 1e-6, 1e6, 0.0])
    transform[:3, :3] = np.diag([draw(stretch) for _ in range(3)])
    if draw(st.booleans()):
        transform[:3, :3] = transform[[1, 2, 0], :3] * draw(scales)
        transform[0, 1] += draw(st.sampled_from([0.0, 0.3, -2.0]))
    transform[:3, 3] = draw(st.tuples(*3 * [st.sampled_from([0.0, 3.0, -7.5, 1e7, 1e140])]))
    return transform


@st.composite
def cameras(draw: st.DrawFn) -> Case:
    """Looking anywhere but straight up or down."""
    number = st.floats(-1.0, 1.0)
    far = draw(st.sampled_from([1.0, 10.0, 1e7]))
    return {
        "position": [far * draw(number) for _ in range(3)],
        "forward": [draw(number), draw(st.floats(-0.9, 0.9)), draw(st.sampled_from([-1.0, 1.0]))],
        "fov": draw(st.floats(1.0, 179.0)),
        "near": draw(st.sampled_from([1e-6, 0.05, 10.0])),
    }
