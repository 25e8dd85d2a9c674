"""The table of options says what the option classes do, and the command line says the same."""

from __future__ import annotations

import math
from dataclasses import fields
from inspect import signature

import pytest

import simplifier
from simplifier import (
    EVALUATE_FIELDS,
    SCENE_FIELDS,
    SIMPLIFY_FIELDS,
    TRADEOFF_FIELDS,
    EvaluateOptions,
    OptionError,
    SimplifyOptions,
    TradeoffOptions,
)
from simplifier.accuracy.accuracy import AccuracyOptions
from simplifier.hierarchy.options import SceneOptions
from simplifier.lods.options import LodOptions
from simplifier.memory.limit import check_limit
from simplifier.options import make_options
from simplifier.tradeoff.sweep import SweepOptions

ACCURACY = {"views", "image", "quads", "exact"}
LODS = {"lods", "error_bounds", "pixel_error", "screen_height", "fov"}
BESIDE = {"preview", "memory_limit"}  # of a scene: they have no part in its occluders
LARGEST = 1e300  # what stands for no limit


def simplifying(name, value):
    """The class of the library that holds an option of ``simplify``."""
    if name in ACCURACY:
        return AccuracyOptions(**{name: value})
    if name == "memory_limit":
        return check_limit(value)
    if name in LODS:
        counted = {} if name == "error_bounds" else {"lods": 2}
        return LodOptions(**{**counted, name: value})
    longest = value if name == "error_bound" else LARGEST
    return make_options(longest, **{name: value})


def of_scene(name, value):
    return SceneOptions(**{name: value})


def as_one(build):
    return lambda name, value: build(**{name: value})


# What the table says of each option, and a class that holds it to that.
HELD = [
    *((one, simplifying) for one in SIMPLIFY_FIELDS if one.name != "transparent"),
    *((one, as_one(SimplifyOptions)) for one in SIMPLIFY_FIELDS if one.name not in LODS),
    *((one, as_one(EvaluateOptions)) for one in EVALUATE_FIELDS),
    *((one, of_scene) for one in SCENE_FIELDS if one.name not in BESIDE),
]
NUMBERS = [row for row in HELD if row[0].kind in ("whole", "number")]


def within(one):
    """The lowest and highest value that the table allows."""
    low = one.low
    if one.low_excluded:
        low = 1e-300 if one.name != "time_limit" else 1e-6
    return low, LARGEST if one.high is None else one.high


def beyond(one):
    step = 1 if one.kind == "whole" else 1e-9
    yield one.low if one.low_excluded else one.low - step
    yield math.inf if one.high is None else one.high + max(step, abs(one.high) * 1e-9)
    yield from (math.nan, -math.inf)


@pytest.mark.parametrize(("one", "build"), NUMBERS, ids=lambda x: getattr(x, "name", ""))
def test_limits_are_those_of_the_classes(one, build):
    for value in within(one):
        one.check(value)
        build(one.name, value)
    for value in beyond(one):
        with pytest.raises(OptionError, match=f"^{one.words}: "):
            one.check(value)
        with pytest.raises(OptionError, match=f"^{one.words}: "):
            build(one.name, value)


@pytest.mark.parametrize(
    ("one", "build"), [row for row in HELD if row[0].kind == "choice"],
    ids=lambda x: getattr(x, "name", ""),
)  # fmt: skip
def test_choices_are_those_of_the_classes(one, build):
    for value in one.choices:
        one.check(value)
        build(one.name, value)
    for value in ("", one.choices[0].upper(), None, 1):
        with pytest.raises(OptionError, match=f"^{one.words}: .*; choose one of "):
            one.check(value)
        with pytest.raises(OptionError, match=f"^{one.words}: .*; choose one of "):
            build(one.name, value)


@pytest.mark.parametrize("bounds", [(0.0, 1.0), (-1.0,), (math.nan,), (math.inf,), ("1",)])
def test_lengths_are_held_to_their_limits(bounds):
    (one,) = (one for one in SIMPLIFY_FIELDS if one.kind == "lengths")
    one.check((1e-300, LARGEST))
    LodOptions(error_bounds=(1e-300, LARGEST))
    for build in (one.check, lambda value: LodOptions(error_bounds=value)):
        with pytest.raises(OptionError, match=r"^error bounds: "):
            build(bounds)


LISTS = [one for one in TRADEOFF_FIELDS if one.kind in ("wholes", "numbers")]


@pytest.mark.parametrize("one", LISTS, ids=lambda one: one.name)
def test_lists_are_held_to_the_limits_of_the_sweep(one):
    low = 1e-6 if one.low_excluded else one.low
    for value in ((low,), (low, one.high)):
        one.check(value)
        SweepOptions(**{one.name: value})
    beyond = one.high * 1.01 if one.kind == "numbers" else one.high + 1
    for value in ((), (0,), (low, beyond)):
        with pytest.raises(OptionError, match=f"^{one.words}: "):
            one.check(value)
        with pytest.raises(OptionError):
            SweepOptions(**{one.name: value})
    for value in (low, "1", (low, low), tuple(range(1, 18)), (None,), (True,)):
        with pytest.raises(OptionError, match=f"^{one.words}: "):
            one.check(value)


@pytest.mark.parametrize("table", [SIMPLIFY_FIELDS, EVALUATE_FIELDS, SCENE_FIELDS, TRADEOFF_FIELDS])
def test_a_table_is_sound(table):
    assert len({one.name for one in table}) == len(table)
    for one in table:
        one.check(one.default)
        assert one.nullable == (one.default is None)
        assert one.help.endswith(".")
        assert bool(one.choices) == (one.kind == "choice")
        wrong = {
            "whole": 1.5, "number": "1", "flag": 1, "choice": 1, "lengths": 1.0, "wholes": 1,
            "numbers": 1.0,
        }[one.kind]  # fmt: skip
        for value in (wrong, *([] if one.nullable else [None])):
            with pytest.raises(OptionError, match=f"^{one.words}: "):
                one.check(value)


@pytest.mark.parametrize(
    ("table", "kind"),
    [
        (SIMPLIFY_FIELDS, SimplifyOptions),
        (EVALUATE_FIELDS, EvaluateOptions),
        (TRADEOFF_FIELDS, TradeoffOptions),
        ([one for one in SCENE_FIELDS if one.name not in BESIDE], SceneOptions),
    ],
)
def test_classes_have_the_options_of_the_table(table, kind):
    assert {one.name: one.default for one in table} == {
        field.name: field.default for field in fields(kind)
    }


def test_functions_have_the_defaults_of_the_table():
    effective = {"lods": None, "pixel_error": 1.0, "screen_height": 1080, "fov": 60.0}
    for function, table in (
        (simplifier.simplify, SIMPLIFY_FIELDS),
        (simplifier.simplify_lods, SIMPLIFY_FIELDS),
        (simplifier.evaluate, EVALUATE_FIELDS),
        (simplifier.simplify_scene, SCENE_FIELDS),
    ):
        defaults = {one.name: one.default for one in table}
        if function is simplifier.simplify_lods:
            defaults |= effective
        for name, parameter in signature(function).parameters.items():
            if name in defaults:
                assert parameter.default == defaults[name], (function, name)
    assert {one.name for one in SCENE_FIELDS} < set(signature(simplifier.simplify_scene).parameters)


@pytest.mark.parametrize(
    ("command", "table"),
    [
        ("simplify", SIMPLIFY_FIELDS),
        ("evaluate", EVALUATE_FIELDS),
        ("scene", SCENE_FIELDS),
        ("tradeoff", TRADEOFF_FIELDS),
    ],
)
def test_the_command_line_shows_the_table(table, command):
    from typer.main import get_command

    from simplifier.cli.main import app

    shown = {one.name: one for one in get_command(app).commands[command].params}
    assert [name for name in shown if name in {one.name for one in table}] == [
        one.name for one in table
    ]
    for one in table:
        option = shown[one.name]
        assert option.opts == [f"--{one.name.replace('_', '-')}"]
        assert (option.help, option.default) == (one.help, _as_typed(one.default))
        assert option.is_flag == (one.kind == "flag")


def _as_typed(default):
    return ",".join(f"{one:g}" for one in default) if isinstance(default, tuple) else default
