"""Pictures and page of a sweep: marks stand where they should, words cover nothing, all is safe."""

from __future__ import annotations

import base64
import re
from functools import cache

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from simplifier.tradeoff import page as page_module
from simplifier.tradeoff import plot
from simplifier.tradeoff.plot import (
    DARK,
    LIGHT,
    PointLabel,
    case_picture,
    overview_picture,
    place_labels,
)
from simplifier.tradeoff.study import study_files
from simplifier.tradeoff.sweep import Setting, Trial
from tests.report.test_page import Reader
from tests.tradeoff.sweeps import HOSTILE, plain_trials, study, trial

FAILED = Trial("a.obj", Setting(16, time=4.0), failure="out of memory")
GONE = Trial("gone.obj", None, failure="no such file")


def decoded(data):
    return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]


def rgb(colour):
    return [int(colour[i : i + 2], 16) for i in (1, 3, 5)]


def pixels_of(picture, colour):
    return np.argwhere((picture == rgb(colour)).all(axis=2))


def page(made):
    return dict(study_files(made))["tradeoff.html"].decode()


def pictures_of(text):
    return [base64.b64decode(one) for one in re.findall(r'"data:image/png;base64,([^"]+)"', text)]


@cache
def plain_picture(dark=False):
    (case,) = study().cases
    return case_picture(case, DARK if dark else LIGHT)


def named(case, theme):
    """In place of a picture: of which case it is, and whether it is dark."""
    return f"{case.mesh} {case.budget} {theme is DARK}".encode()


@pytest.fixture
def undrawn(monkeypatch):
    """Pages of which only the words and the order of the pictures are asked for."""
    monkeypatch.setattr(page_module, "case_picture", named)
    monkeypatch.setattr(plot, "overview_picture", lambda cases, precision, footer: b"overview")


# Labels.


def labelled(points, texts, *, optional=False):
    """Boxes of the labels of such points, in pixels, and those of their axes."""
    figure = Figure(figsize=(6.4, 4.4), dpi=100)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.1, 0.1, 0.85, 0.85))
    axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    labels = [
        PointLabel(x, y, t, "k", optional=optional) for (x, y), t in zip(points, texts, strict=True)
    ]
    place_labels(axes, labels, np.array(points), [], 9.0)
    figure.draw_without_rendering()
    return [text.get_window_extent() for text in axes.texts], axes


@settings(max_examples=25)
@given(
    st.lists(st.tuples(st.integers(0, 3), st.integers(0, 3)), min_size=1, max_size=5, unique=True)
)
def test_few_labels_never_meet_and_stay_inside(places):
    points = [(x / 3.0, y / 3.0) for x, y in places]
    boxes, axes = labelled(points, [f"time {i} s" for i in range(len(points))])
    frame = axes.get_window_extent()
    for index, box in enumerate(boxes):
        assert not any(box.overlaps(other) for other in boxes[:index])
        assert frame.x0 - 1 <= box.x0 <= box.x1 <= frame.x1 + 1
        assert frame.y0 - 1 <= box.y0 <= box.y1 <= frame.y1 + 1
        for at in axes.transData.transform(points):
            assert not box.contains(*at)


def test_a_label_without_room_is_left_out():
    crowd = [(0.5 + 0.01 * i, 0.5 + 0.01 * j) for i in range(9) for j in range(9)]
    texts = ["resolution 32, 16 directions"] * len(crowd)
    assert len(labelled(crowd, texts, optional=True)[0]) < 40
    assert len(labelled(crowd[:40], texts[:40])[0]) == 40


# Panels.


def test_marks_are_where_the_figures_are():
    """Filled marks of time: 1 s at 55 %, 2 s at 60 %, further right and higher."""
    picture = decoded(plain_picture())
    assert picture.shape == (880, 1280, 3)
    found = pixels_of(picture, LIGHT.knobs["time"])
    top = found[found[:, 0] < found[:, 0].min() + 20]
    low = found[found[:, 0] > found[:, 0].max() - 20]
    assert top[:, 1].mean() > low[:, 1].mean() + 100


def test_what_is_far_below_stands_at_the_edge():
    deep = trial(Setting(16, time=0.1), 1.2, 0.01)
    (case,) = study([*plain_trials(), deep]).cases
    edge = slice(740, 790)  # rows about the lower end of the axes
    marks = [
        len(pixels_of(decoded(picture)[edge], LIGHT.knobs["time"]))
        for picture in (plain_picture(), case_picture(case, LIGHT))
    ]
    assert marks[0] == 0
    assert marks[1] > 40


def test_dark_pictures_are_dark():
    light, dark = (decoded(plain_picture(dark)) for dark in (False, True))
    assert light.mean() > 200.0
    assert dark.mean() < 60.0


def test_equal_studies_give_equal_pictures():
    assert plain_picture() == case_picture(study().cases[0], LIGHT)


@pytest.mark.parametrize(
    "trials",
    [
        [trial(Setting(16), 1.0, 0.5)],
        [trial(Setting(16), 1.0, 0.0)],
        [trial(Setting(16), 1.0, 1.0), trial(Setting(16, time=1.0), 1.0, 1.0)],
        [trial(Setting(16), 1e-4, 0.5, 0.2), trial(Setting(16, "best"), 1e4, 0.5, 0.3)],
        [FAILED],
        [FAILED, trial(Setting(16), 1.0, 0.5, 0.1)],
    ],
    ids=["one", "nothing hidden", "equal", "all imprecise", "all failed", "no front"],
)
@pytest.mark.filterwarnings("error")
def test_poor_cases_can_be_drawn(trials):
    text = page(study(trials))
    for picture in pictures_of(text):
        assert decoded(picture).shape == (880, 1280, 3)
    Reader(text)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", ["$x^2$ \ud800 \u57ce.glb", "a\x00b\n", "x" * 300, HOSTILE])
def test_any_name_can_be_drawn(name):
    made = study([*plain_trials(name), GONE])
    assert len(decoded(overview_picture(made.cases, 0.99, "a machine")).shape) == 3


def test_the_overview_has_a_panel_for_every_mesh_and_budget():
    one = decoded(overview_picture(study().cases, 0.99, ""))
    many = study([*plain_trials(), *plain_trials(budget=64), *plain_trials("b.obj", 256)])
    grid = decoded(overview_picture(many.cases, 0.99, ""))
    assert grid.shape[1] == pytest.approx(1.5 * one.shape[1], abs=2)  # three columns, at least two
    assert grid.shape[0] > 1.7 * one.shape[0]


# Page.


def test_the_page_fetches_and_executes_nothing(undrawn):
    text = page(study())
    reader = Reader(text)
    assert not {"script", "link", "iframe", "object"} & set(reader.tags)
    for tag, name, value in reader.attributes:
        assert not name.startswith("on")
        if name in ("src", "href", "srcset"):
            assert tag in ("img", "source")
            assert value.startswith("data:image/png;base64,")
    assert "url(" not in text
    assert "@import" not in text
    assert "http:" not in text
    assert "https:" not in text
    policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
    assert ("meta", "content", policy) in reader.attributes


def test_hostile_words_stay_words(undrawn):
    failed = Trial(HOSTILE, Setting(16, time=9.0), failure=HOSTILE)
    trials = [*plain_trials(HOSTILE), failed, Trial("gone" + HOSTILE, None, failure=HOSTILE)]
    tame = [
        *plain_trials("x"), Trial("x", Setting(16, time=9.0), failure="x"),
        Trial("gone", None, failure="x"),
    ]  # fmt: skip
    reader = Reader(page(study(trials)))
    assert reader.tags == Reader(page(study(tame))).tags
    assert "script" not in reader.tags
    assert HOSTILE in "".join(reader.words)


def test_each_case_has_a_picture_for_light_and_one_for_dark(undrawn):
    made = study([*plain_trials(), *plain_trials(budget=64)])
    text = page(made)
    expected = [named(case, theme) for case in made.cases for theme in (DARK, LIGHT)]
    assert pictures_of(text) == expected
    assert text.count("(prefers-color-scheme: dark)") == 1 + len(made.cases)
    words = [v for t, n, v in Reader(text).attributes if (t, n) == ("img", "alt")]
    assert words[0] == (
        "Time against recall. The front: draft 0.50 s 48.0 %; balanced 1.00 s 50.0 %; "
        "16 directions 1.00 s 50.0 %; time 1 s 2.00 s 55.0 %; time 2 s 4.00 s 60.0 %"
    )


def test_all_figures_are_on_the_page(undrawn):
    made = study([*plain_trials(), FAILED, GONE])
    text = Reader(page(made)).text.replace("\u00a0", " ")
    for words in (
        "at least 99 % precision", str(made.machine), "Budget 16",
        "5 of 8 settings are on the front",
        "dominated by time 2 s: 50 % less time, +7.0 points", "below 99 % precision: not compared",
        "gone.obj: no such file", "a.obj, budget 16, time 4 s: out of memory",
        "For more recall, turn first time +5.0 points of recall a doubling of time",
        "Never pays too early to say", *made.lines,
    ):  # fmt: skip
        assert words in text, words


def test_nothing_was_measured():
    made = study([GONE])
    files = dict(study_files(made))
    assert list(files) == ["tradeoff.csv", "tradeoff.json", "tradeoff.png", "tradeoff.html"]
    assert "no such file" in Reader(files["tradeoff.html"].decode()).text
    assert made.lines == []
