"""Pictures of one view: what they show, which way up, and of what they may be."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import simplifier
from simplifier.errors import MeshError, OptionError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.report.silhouettes import BLACK, BLUE, WHITE, YELLOW
from tests.solids import box, joined, sphere

NOTHING = np.empty((0, 3, 3))
FORWARDS = (0.0, 0.0, -1.0)  # of whoever stands at +z: +x to the right, +y up


def decoded(png):
    return cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]


def shares(picture):
    """Of the pixels, by colour; those of edges are between two."""
    return [
        float((picture == colour).all(axis=-1).mean()) for colour in (WHITE, BLACK, YELLOW, BLUE)
    ]


def triangles_of(mesh):
    return mesh.vertices[mesh.faces]


def test_the_original_fills_the_picture_up_to_a_margin():
    picture = decoded(simplifier.picture_of(box((1.0, 1.0, 1.0)), NOTHING, FORWARDS, 100))
    assert picture.shape == (100, 100, 3)
    white, black, yellow, blue = shares(picture)
    assert black == pytest.approx(0.92**2, abs=0.03)
    assert white == pytest.approx(1.0 - 0.92**2, abs=0.03)
    assert yellow == blue == 0.0


def test_it_has_the_colours_of_the_silhouettes():
    mesh, cover = box((2.0, 2.0, 2.0)), box((1.0, 2.0, 2.0), low=(-0.5, 0.0, 0.0))
    picture = decoded(simplifier.picture_of(mesh, triangles_of(cover), FORWARDS, 128))
    row = picture[64]
    # From left to right: the margin has room for a part of what the occluder has too much.
    assert tuple(row[1]) == BLUE
    assert tuple(row[20]) == YELLOW
    assert tuple(row[100]) == BLACK
    assert tuple(row[126]) == WHITE


@pytest.mark.parametrize(
    ("up", "direction", "place"),
    [("x", (0.0, -1.0, 0.0), (1.5, 0.0, 0.0)), ("y", FORWARDS, (0.0, 1.5, 0.0)),
     ("z", (-1.0, 0.0, 0.0), (0.0, 0.0, 1.5)), ("y", None, (0.0, 1.5, 0.0)),
     ("x", None, (1.5, 0.0, 0.0)), ("z", None, (0.0, 0.0, 1.5))],
)  # fmt: skip
def test_up_is_up(up, direction, place):
    """A ball that floats above another is in the upper half."""
    ball = sphere()
    mesh = joined(ball, TriangleMesh(0.4 * ball.vertices + place, ball.faces))
    small = triangles_of(mesh)[len(ball.faces) :]
    picture = decoded(simplifier.picture_of(mesh, small, direction, 90, up=up))
    yellow = (picture == YELLOW).all(axis=-1)
    black = (picture == BLACK).all(axis=-1)
    assert np.argwhere(yellow)[:, 0].mean() < np.argwhere(black)[:, 0].mean() - 20


def test_a_far_away_mesh_looks_the_same():
    mesh, place = box(), np.array([4.5e6, 5e3, -3e6])
    far = TriangleMesh(mesh.vertices + place, mesh.faces)
    near = simplifier.picture_of(mesh, triangles_of(mesh)[:6])
    assert simplifier.picture_of(far, triangles_of(far)[:6]) == near


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1), st.integers(0, 12))
def test_triangles_and_the_occluder_of_them_give_the_same_picture(seed, count):
    triangles = np.random.default_rng(seed).normal(size=(count, 3, 3))
    view = simplifier.Viewpoint(sphere(), size=40)
    picture = view.picture(triangles)
    assert picture == view.picture(Occluder.of(triangles, 0.0, {}))
    assert picture == simplifier.picture_of(sphere(), triangles, size=40)
    assert decoded(picture).shape == (40, 40, 3)


@pytest.mark.parametrize("direction", [(0.0, 0.0, 0.0), (np.nan, 1.0, 0.0), (np.inf, 0.0, 0.0)])
def test_no_direction_is_refused(direction):
    with pytest.raises(OptionError, match="direction"):
        simplifier.Viewpoint(box(), direction)


@pytest.mark.parametrize("size", [7, 1025, 1.5])
def test_sizes_out_of_range_are_refused(size):
    with pytest.raises(OptionError, match="size"):
        simplifier.Viewpoint(box(), size=size)


@pytest.mark.parametrize("triangles", [np.zeros((2, 3)), np.full((1, 3, 3), np.nan)])
def test_what_cannot_be_drawn_is_refused(triangles):
    with pytest.raises(MeshError, match="occluder"):
        simplifier.Viewpoint(box()).picture(triangles)
