"""An option is stated once: its class checks it, and the command line shows it."""

from __future__ import annotations

import dataclasses
import math
from typing import get_args

import pytest

from simplifier.accuracy.accuracy import AccuracyOptions
from simplifier.builds.finding import Requirements
from simplifier.errors import OptionError
from simplifier.options.fields import OptionGroup, OptionSet, changed, option, passed_on, shared
from simplifier.options.scene import CullOptions, PathOptions, SceneOptions
from simplifier.options.simplify import (
    EvaluateOptions,
    LodOptions,
    SimplifyOptions,
    WriteOptions,
)
from simplifier.options.tradeoff import TradeoffOptions

COMMANDS = {
    "simplify": SimplifyOptions, "evaluate": EvaluateOptions, "scene": SceneOptions,
    "path": PathOptions, "cull": CullOptions, "tradeoff": TradeoffOptions,
}  # fmt: skip
SETS = [*COMMANDS.values(), WriteOptions, Requirements]
LARGEST = 1e300  # what stands for no limit
OF_LEVELS = {"pixel_error", "screen_height", "fov"}


def built(kind, name, value):
    """An object of the class with that value; what needs levels of detail has some."""
    levels = {"lods": 2} if kind is SimplifyOptions and name in OF_LEVELS else {}
    return kind(**{**levels, name: value})


def within(one):
    """The lowest and highest value that are allowed."""
    low = 1e-6 if one.low_excluded or one.name == "eye_height" else one.low
    return low, LARGEST if one.high is None else one.high


def beyond(one):
    step = 1 if one.kind == "whole" else 1e-9
    yield one.low if one.low_excluded else one.low - step
    yield math.inf if one.high is None else one.high + max(step, abs(one.high) * 1e-9)
    yield from (math.nan, -math.inf, "1", True)


def fields_of(*kinds):
    return [
        pytest.param(options, one, id=f"{options.__name__}.{one.name}")
        for options in SETS
        for one in options.fields()
        if one.kind in kinds
    ]


@pytest.mark.parametrize(("kind", "one"), fields_of("whole", "number"))
def test_numbers_are_held_to_their_limits(kind, one):
    for value in within(one):
        assert getattr(built(kind, one.name, value), one.name) == value
    for value in beyond(one):
        with pytest.raises(OptionError, match=f"^{one.words}: "):
            built(kind, one.name, value)


@pytest.mark.parametrize(("kind", "one"), fields_of("choice"))
def test_choices_are_those_of_the_annotation(kind, one):
    assert len(one.choices) >= 2
    for value in one.choices:
        assert getattr(built(kind, one.name, value), one.name) == value
    for value in ("", one.choices[0].upper(), 1):
        with pytest.raises(OptionError, match=f"^{one.words}: .*; choose one of "):
            built(kind, one.name, value)


@pytest.mark.parametrize(("kind", "one"), fields_of("wholes", "numbers"))
def test_lists_are_held_to_their_limits(kind, one):
    low = 1e-6 if one.low_excluded else one.low
    for value in ((low,), (low, one.high)):
        assert getattr(built(kind, one.name, value), one.name) == value
    past = one.high * 1.01 if one.kind == "numbers" else one.high + 1
    for value in ((), (0,), (low, past), low, "1", (low, low), tuple(range(1, 18)), (None,)):
        with pytest.raises(OptionError, match=f"^{one.words}: "):
            built(kind, one.name, value)


@pytest.mark.parametrize("bounds", [(0.0, 1.0), (-1.0,), (math.nan,), (math.inf,), ("1",), 1.0])
def test_lengths_are_positive(bounds):
    for kind in (SimplifyOptions, LodOptions):
        assert kind(error_bounds=(1e-300, LARGEST)).error_bounds == (1e-300, LARGEST)
        with pytest.raises(OptionError, match=r"^error bounds: "):
            kind(error_bounds=bounds)


@pytest.mark.parametrize("size", [(0, 9), (9, 0), (9,), 9, (9, 9, 9), (9.0, 9), (9, 4097)])
def test_a_size_is_columns_and_rows(size):
    assert (CullOptions((4096, 1)).columns, CullOptions((4096, 1)).rows) == (4096, 1)
    with pytest.raises(OptionError, match=r"^(image|rows|columns): "):
        CullOptions(size)


@pytest.mark.parametrize("kind", SETS, ids=lambda kind: kind.__name__)
def test_a_table_is_sound(kind):
    table = kind.fields()
    assert len({one.name for one in table}) == len(table)
    assert {one.name: one.default for one in table}.items() <= vars(kind()).items()
    for one in table:
        one.check(one.default)
        assert one.nullable == (one.default is None)
        assert one.help.endswith(".")
        for value in (object(), *([] if one.nullable else [None])):
            with pytest.raises(OptionError, match=f"^{one.words}: "):
                one.check(value)


@pytest.mark.parametrize("command", COMMANDS)
def test_the_command_line_shows_the_table(command):
    from typer.main import get_command

    from simplifier.cli.main import app

    table = COMMANDS[command].fields()
    shown = {one.name: one for one in get_command(app).commands[command].params}
    groups = get_args(OptionGroup)
    listed = sorted(table, key=lambda one: groups.index(one.group))
    assert [name for name in shown if name in {one.name for one in table}] == [
        one.name for one in listed
    ]
    for one in table:
        parameter = shown[one.name]
        assert parameter.rich_help_panel == one.group
        assert parameter.opts == [f"--{one.name.replace('_', '-')}"]
        assert (parameter.help, parameter.default) == (one.help, typed(one))
        assert parameter.is_flag == (one.kind == "flag")


def typed(one):
    if not isinstance(one.default, tuple):
        return one.default
    return ("x" if one.kind == "size" else ",").join(f"{value:g}" for value in one.default)


@dataclasses.dataclass(frozen=True)
class Whole(OptionSet):
    height: float = option(2.0, "How high.", above=0.0, unit="metres")
    count: int | None = option(None, "How many.", low=1, high=9, absent="some")
    limit: int = option(7, "How much at most.", low=0, high=9, of_result=False)


@dataclasses.dataclass(frozen=True)
class Stage(OptionSet):
    height: float = shared(Whole, "height", 1.0)
    count: int = shared(Whole, "count", 3)
    inner: int = option(5, low=0, high=10, words="inner count")


def test_a_stage_takes_what_it_shares_and_its_own_default_for_what_was_not_chosen():
    assert passed_on(Stage, Whole()) == Stage(2.0, 3, 5)
    assert passed_on(Stage, Whole(4.0, 2), inner=0) == Stage(4.0, 2, 0)
    with pytest.raises(
        OptionError, match=r"^height: 0\.0 is out of range; choose a number above 0"
    ):
        Stage(height=0.0)
    with pytest.raises(OptionError, match=r"^inner count: 11 is out of range; choose 0 to 10"):
        Stage(inner=11)
    assert [one.name for one in Stage.fields()] == ["height", "count"]  # what users choose
    assert Whole.fields()[0].unit == "metres"


def test_what_the_result_depends_on():
    assert Whole().chosen() == {"height": 2.0, "count": None}


def test_changes_to_options():
    assert changed(Whole, None, {}) == Whole()
    assert changed(Whole, Whole(3.0), {"count": 2}) == Whole(3.0, 2)
    some = Whole(3.0)
    assert changed(Whole, some, {}) is some
    with pytest.raises(OptionError, match=r"^width: there is no such option; choose from height"):
        changed(Whole, some, {"width": 1})
    with pytest.raises(OptionError, match=r"^options: .* give simplifier\.Whole"):
        changed(Whole, Stage(), {})


def test_how_accuracy_is_measured_is_the_command_s():
    chosen = SimplifyOptions(
        views=9, image=32, quads=7, seed=3, exact=True, viewers="above", up="z"
    )
    assert passed_on(AccuracyOptions, chosen) == AccuracyOptions(9, 32, 7, 3, True, "above", "z")
