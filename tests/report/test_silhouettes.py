"""Silhouettes have the paper's colours, stand the right way up, and show the views that matter."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from examples.building import box
from examples.part import joined
from simplifier.accuracy.accuracy import AccuracyOptions, AccuracyReport, evaluate_accuracy
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.views import random_directions
from simplifier.report.png import png_bytes
from simplifier.report.silhouettes import (
    BLACK,
    BLUE,
    WHITE,
    YELLOW,
    choose_views,
    silhouette,
    silhouette_sheet,
    view_pictures,
)
from simplifier.wording import length, percent


def report(directions, precision=None, recall=None) -> AccuracyReport:
    count = len(directions)
    ones = np.ones(count)
    return AccuracyReport(
        1.0,
        1.0,
        directions,
        ones if precision is None else np.asarray(precision),
        ones if recall is None else np.asarray(recall),
        ones,
        ones,
        ones,
        1.0,
        AccuracyOptions(views=count),
    )


@pytest.fixture(scope="module")
def scene():
    """A block with a smaller one at +x on top; the occluder is half of the lower one and more."""
    parts = joined([box(4.0, 2.0, 2.0), box(1.0, 1.0, 1.0).moved(x=1.5, y=2.0)])
    mesh = TriangleMesh.from_soup(parts.vertices, parts.faces)
    cover = box(2.3, 1.5, 1.0).moved(x=-1.0)
    occluder = Occluder(cover.vertices, cover.faces)
    return mesh, occluder, evaluate_accuracy(mesh, occluder, AccuracyOptions(views=40, image=128))


def test_four_colours_and_the_flip_of_rows_and_columns():
    original = np.array([[True, True], [False, False]])  # row 0 is the bottom
    occluder = np.array([[True, False], [True, False]])
    picture = silhouette(original, occluder)
    assert picture.dtype == np.uint8
    assert picture.tolist() == [[list(WHITE), list(BLUE)], [list(BLACK), list(YELLOW)]]


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 9), st.integers(1, 9), st.integers(0, 2**32 - 1))
def test_colours_pixel_by_pixel(rows, columns, seed):
    generator = np.random.default_rng(seed)
    original, occluder = generator.random((2, rows, columns)) < 0.5
    picture = silhouette(original, occluder)
    for row in range(rows):
        for column in range(columns):
            expected = {
                (False, False): WHITE,
                (True, False): BLACK,
                (True, True): YELLOW,
                (False, True): BLUE,
            }[bool(original[row, column]), bool(occluder[row, column])]
            assert tuple(picture[rows - 1 - row, columns - 1 - column]) == expected


def test_a_picture_shows_what_a_viewer_sees(scene):
    """Who looks along -z at a y-up scene has +x at the right and +y at the top."""
    mesh, occluder, _ = scene
    front = report(np.array([[0.0, 0.0, -1.0]]))
    image = view_pictures(mesh, occluder, front)[0].image
    rows, columns = np.nonzero((image != np.array(WHITE)).any(axis=2))
    top = columns[rows < rows.min() + 20]
    assert top.min() > columns.mean()  # the small block
    yellow = np.nonzero((image == np.array(YELLOW)).all(axis=2))
    assert yellow[1].mean() < columns.mean()
    blue = np.nonzero((image == np.array(BLUE)).all(axis=2))
    assert blue[1].max() < columns.mean()  # the occluder juts out at -x
    assert len(blue[0]) > 100


def test_all_views_have_one_scale_and_none_is_cut_off(scene):
    pictures = view_pictures(*scene)
    for picture in pictures:
        assert picture.image.shape == (640, 640, 3)
        frame = np.ones((640, 640), dtype=bool)
        frame[4:-4, 4:-4] = False
        assert (picture.image[frame] == 255).all()
    used = [np.nonzero((p.image != 255).any(axis=2).any(axis=0))[0] for p in pictures]
    assert max(int(columns[-1] - columns[0]) for columns in used) > 400


def test_worst_views_come_first_and_say_so(scene):
    mesh, occluder, _ = scene
    recall, precision = np.full(9, 0.9), np.full(9, 0.95)
    recall[7], precision[4] = 0.3, 0.4
    accuracy = report(random_directions(9, 0), precision, recall)
    pictures = view_pictures(mesh, occluder, accuracy)
    assert [(p.name, p.index) for p in pictures[:2]] == [
        ("worst recall", 7),
        ("worst precision", 4),
    ]
    assert (pictures[0].recall, pictures[0].precision) == (0.3, 0.95)
    assert all(p.name == f"view {p.index}" for p in pictures[2:])
    assert len({p.index for p in pictures}) == len(pictures) == 6


def test_one_view_can_be_worst_in_both(scene):
    mesh, occluder, _ = scene
    both = report(random_directions(3, 0), [1.0, 0.5, 1.0], [1.0, 0.5, 1.0])
    pictures = view_pictures(mesh, occluder, both)
    assert [p.name for p in pictures] == ["worst recall and precision", *pictures_left(both)]


def pictures_left(accuracy):
    return [f"view {index}" for index in choose_views(accuracy)[1:]]


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 30), st.integers(1, 8), st.integers(0, 1000))
def test_each_further_view_is_the_farthest_from_those_chosen(views, count, seed):
    generator = np.random.default_rng(seed)
    accuracy = report(random_directions(views, seed), *generator.random((2, views)))
    chosen = choose_views(accuracy, count)
    assert chosen == choose_views(accuracy, count)
    assert len(set(chosen)) == len(chosen) == min(count, views)
    assert chosen[0] == accuracy.worst_view
    first = len({accuracy.worst_view, accuracy.worst_precision_view})
    for place in range(first, len(chosen)):
        angles = {
            view: min(
                float(np.arccos(min(1.0, abs(accuracy.directions[view] @ accuracy.directions[c]))))
                for c in chosen[:place]
            )
            for view in range(views)
            if view not in chosen[:place]
        }
        assert angles[chosen[place]] >= max(angles.values()) - 1e-6


def test_the_opposite_view_is_not_another_view():
    lines = np.array([[1.0, 0, 0], [-1.0, 0, 0], [0.8, 0.6, 0], [0, 1.0, 0]])
    accuracy = report(lines, recall=[0.1, 1.0, 1.0, 1.0], precision=[0.1, 1.0, 1.0, 1.0])
    assert choose_views(accuracy, 2) == [0, 3]


def decoded(data: bytes) -> np.ndarray:
    return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]


def test_contact_sheet_shows_every_picture_over_its_caption(scene):
    pictures = view_pictures(*scene)
    sheet = decoded(silhouette_sheet(pictures, "title"))
    height, width = sheet.shape[:2]
    assert (width, height) == (1199, 60 + 2 * (393 + 92) + 50)
    for place, picture in enumerate(pictures):
        left, top = 20 + place % 3 * 393, 60 + place // 3 * 485
        panel = sheet[top + 1 : top + 372, left + 1 : left + 372]
        small = cv2.resize(picture.image, (371, 371), interpolation=cv2.INTER_AREA)
        assert (panel == small).all()
        caption = sheet[top + 373 : top + 373 + 92, left : left + 373]
        assert (caption.min(axis=2) < 100).sum() > 300
    legend = sheet[-50:]
    for colour in (BLACK, YELLOW, BLUE):
        assert (legend == np.array(colour)).all(axis=2).sum() > 100


@pytest.mark.parametrize("count", [1, 3, 4])
def test_contact_sheet_grows_with_its_views(scene, count):
    pictures = view_pictures(*scene, count=count)
    sheet = decoded(silhouette_sheet(pictures, ""))
    assert sheet.shape[0] == 110 + -(-count // 3) * 485


def test_same_pictures_same_bytes(scene):
    pictures, again = view_pictures(*scene), view_pictures(*scene)
    assert [png_bytes(p.image) for p in pictures] == [png_bytes(p.image) for p in again]
    assert silhouette_sheet(pictures, "a") == silhouette_sheet(pictures, "a")
    assert silhouette_sheet(pictures, "a") != silhouette_sheet(pictures, "b")


def test_png_keeps_every_pixel():
    image = np.random.default_rng(0).integers(0, 256, (7, 5, 3), dtype=np.uint8)
    assert (decoded(png_bytes(image)) == image).all()


def test_an_occluder_without_triangles_leaves_black(scene):
    mesh, _, _ = scene
    nothing = Occluder(np.empty((0, 3)), np.empty((0, 3), np.int32))
    accuracy = evaluate_accuracy(mesh, nothing, AccuracyOptions(views=7, image=64, quads=100))
    for picture in view_pictures(mesh, nothing, accuracy):
        assert (picture.image == np.array(BLACK)).all(axis=2).any()
        assert (picture.image == picture.image[..., :1]).all()  # greys only, from smoothing


@pytest.mark.parametrize(
    ("share", "digits", "text"),
    [
        (1.0, 2, "100.00 %"),
        (0.999999, 2, "99.99 %"),  # never "100 %" for less than all
        (0.29, 0, "29 %"),  # 0.29 * 100 is below 29
        (0.0, 1, "0.0 %"),
        (1.042, 1, "104.2 %"),
    ],
)
def test_percent_rounds_down(share, digits, text):
    assert percent(share, digits) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "no promise"),
        (0.0, "0.000"),
        (-0.0, "0.000"),
        (0.0123456, "0.01235"),
        (0.000123, "0.0001230"),
        (1.23456, "1.235"),
        (123456.7, "123,457"),
        (1.5e-7, "1.500e-07"),
        (-2.5e12, "-2.500e+12"),
    ],
)
def test_number_has_four_digits(value, text):
    assert length(value) == text
