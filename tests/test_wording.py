"""Figures in words: what falls short never reads as if it did not."""

from __future__ import annotations

from pathlib import Path

import pytest

from simplifier.wording import (
    command_line,
    count,
    distance_advice,
    distance_range,
    duration,
    exact_percent,
    grid_size,
    length,
    mean_and_worst,
    median_points,
    percent,
    percent_at_most,
    picture_line,
    points,
    seconds,
    signed_points,
    viewpoint,
)


@pytest.mark.parametrize(
    ("share", "digits", "text"),
    [
        (0.8359, 1, "83.5 %"),
        (0.29, 1, "29.0 %"),
        (0.9999999, 2, "99.99 %"),
        (1.0 - 1e-11, 1, "99.9 %"),
        (1.0, 2, "100.00 %"),
        (0.0, 1, "0.0 %"),
        (0.0004, 1, "< 0.1 %"),
        (0.0004, 2, "0.04 %"),
        (1e-12, 2, "< 0.01 %"),
        (0.001, 1, "0.1 %"),
    ],
)
def test_percentages_are_rounded_down_and_never_to_nothing(share, digits, text):
    assert percent(share, digits) == text


@pytest.mark.parametrize(
    ("share", "text"),
    [(0.0, "0.00 %"), (0.03471, "3.48 %"), (0.0348, "3.48 %"), (1e-9, "0.01 %"), (1.5, "150.00 %")],
)
def test_what_is_to_be_small_is_rounded_up(share, text):
    assert percent_at_most(share) == text


def test_the_worst_follows_the_mean():
    assert mean_and_worst(0.03471, 0.04701) == "3.48 %, at worst 4.71 %"


@pytest.mark.parametrize(
    ("share", "text"), [(0.99, "99 %"), (0.9995, "99.95 %"), (1.0, "100 %"), (0.0, "0 %")]
)
def test_a_bar_reads_as_it_was_typed(share, text):
    assert exact_percent(share) == text


@pytest.mark.parametrize(
    ("difference", "signed", "words"),
    [
        (0.032, "+3.2", "+3.2 points"),
        (-0.01, "-1.0", "-1.0 point"),
        (0.01, "+1.0", "+1.0 point"),
        (0.0104, "+1.0", "+1.0 point"),
        (-0.0004, "0.0", "0.0 points"),
    ],
)
def test_differences_of_shares_are_signed_points(difference, signed, words):
    assert (signed_points(difference), points(difference)) == (signed, words)


def test_a_median_has_its_range_only_where_there_is_one():
    assert median_points([0.032]) == "+3.2"
    assert median_points([0.0321, 0.0322]) == "+3.2"
    assert median_points([-0.01, 0.02, 0.04]) == "+2.0 (-1.0 to +4.0)"


@pytest.mark.parametrize(
    ("time", "text"),
    [(0.0, "0 ms"), (0.0004, "0 ms"), (0.5, "500 ms"), (1.0, "1.00 s"), (1234.5, "1,234.50 s")],
)
def test_times_are_milliseconds_below_a_second(time, text):
    assert seconds(time) == text


def test_a_length_that_nobody_promises():
    assert length(None) == "no promise"
    assert length(-0.0) == "0.000"


def test_counts_agree_with_their_noun():
    words = [count(number, "part") for number in (0, 1, 2, 1234)]
    assert words == ["0 parts", "1 part", "2 parts", "1,234 parts"]


def test_grids():
    assert grid_size([64, 1024, 5]) == "64 x 1024 x 5"


def test_a_line_in_a_picture_is_short_and_prints():
    assert picture_line("a\n$b$\u202e") == r"a?\$b\$?"
    assert picture_line("x" * 49) == "x" * 45 + "..."
    assert picture_line("x" * 48) == "x" * 48


@pytest.mark.parametrize(
    ("level", "starts", "words", "advice"),
    [
        (0, (50.6, 4037.4, 8074.8), "0 to 4,037", "use from 0 to 4,037 units; beyond, level 1"),
        (
            1, (50.6, 4037.4, 8074.8), "4,037 to 8,075",
            "use from 4,037 to 8,075 units; beyond, level 2",
        ),
        (2, (50.6, 4037.4, 8074.8), "8,075 and beyond", "use from 8,075 units on"),
        (0, (50.6,), "any", "use at any distance"),
        (0, (None, None), "any", "use at any distance"),
        (0, (1.0, None, 3.0), "0 to 3.000", "use from 0 to 3.000 units; beyond, level 2"),
        (1, (1.0, None, 3.0), "no promise", "never used: its error is not promised"),
    ],
)  # fmt: skip
def test_a_level_is_used_from_one_distance_to_another(level, starts, words, advice):
    assert distance_range(level, starts) == words
    assert distance_advice(level, starts) == advice


@pytest.mark.parametrize(
    ("line_of_sight", "up", "words"),
    [
        ((0.0, 0.0, -1.0), "y", "from the front"),
        ((-0.98, 0.2, 0.0), "y", "from the right, slightly below"),
        ((0.71, -0.5, 0.5), "y", "from the back left, above"),
        ((0.0, -1.0, 0.0), "y", "from straight above"),
        ((0.4, 0.9, 0.0), "y", "from the left, steeply below"),
        ((0.0, 1.0, 0.0), "z", "from the front"),
        ((-1.0, 0.0, 0.0), "z", "from the right"),
        ((0.0, 0.0, 1.0), "z", "from straight below"),
        ((0.0, 1.0, 0.0), "x", "from the right"),
        ((-0.3, 0.0, -0.95), "x", "from the front, slightly above"),
    ],
)
def test_a_viewpoint_is_named_as_people_say_it(line_of_sight, up, words):
    assert viewpoint(line_of_sight, up) == words


@pytest.mark.parametrize(
    ("time", "text"),
    [
        (0.004, "0.004 s"),
        (28.46, "28.5 s"),
        (119.9, "120 s"),
        (120.0, "2.0 minutes"),
        (2460.0, "41 minutes"),
        (7200.0, "2.0 hours"),
        (13_400.0, "3.7 hours"),
        (172_800.0, "2.0 days"),
        (5.37e6, "62 days"),
    ],
)
def test_durations(time, text):
    assert duration(time) == text


def test_files_never_read_as_options_in_a_command():
    words = ["occluder", "simplify", Path("-a b.ply"), "-o", Path("c/-d.glb"), "--budget", "8"]
    assert command_line(words) == "occluder simplify './-a b.ply' -o c/-d.glb --budget 8"
