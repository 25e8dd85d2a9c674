"""The command to try next is one that can be run, and helps where the options are to blame."""

from __future__ import annotations

import shlex

import pytest

import simplifier
from simplifier import EvaluateOptions, SimplifyOptions
from simplifier.accuracy.verdict import VerdictFigures, verdict_on
from simplifier.production.next_try import look_command, next_evaluate, next_simplify
from tests.solids import box, sphere

GOOD = {"triangles": 60, "precision": 0.9999, "recall": 0.9, "overhang": 0.004, "coverage": 0.1}
LITTLE = verdict_on(VerdictFigures(**{**GOOD, "recall": 0.2}))
WRONG = verdict_on(VerdictFigures(**{**GOOD, "precision": 0.9}))
LARGE = verdict_on(VerdictFigures(**{**GOOD, "overhang": 0.2}))
THIN = verdict_on(VerdictFigures(**{**GOOD, "coverage": 1e-6}))
BEGIN = "occluder simplify MESH -o OCCLUDER"


@pytest.mark.parametrize(
    ("chosen", "verdict", "words"),
    [
        ({}, LITTLE, "--preset best --budget 128"),
        ({"preset": "draft", "budget": 16}, LITTLE, "--budget 32 --preset best"),
        ({"time_limit": 0.5, "ground": True}, LITTLE, "--ground --preset best --budget 128"),
        ({"conservative": True, "up": "z"}, LITTLE, "--up z"),
        ({"overhang": 0.0}, LITTLE, ""),
        ({"overhang": 0.2}, LARGE, ""),
        ({"overhang": 0.2, "min_precision": 0.9}, WRONG, ""),
        ({}, LARGE, "--preset best --budget 128"),
        ({"preset": "best"}, WRONG, "--preset best --conservative"),
        ({"preset": "best", "lods": 3}, WRONG, "--lods 3 --preset best --budget 128"),
        ({"error_bounds": (0.5, 2.0)}, LITTLE, "--error-bounds 0.5,2.0 --preset best --budget 128"),
        ({}, THIN, "--image 1024"),
    ],
)
def test_what_to_change(chosen, verdict, words):
    command = next_simplify(SimplifyOptions(**chosen), verdict)
    assert command is not None
    assert command.split() == [*BEGIN.split(), *words.split()]


def test_there_is_nothing_to_try_where_it_is_good_or_all_was_tried():
    assert next_simplify(SimplifyOptions(), verdict_on(VerdictFigures(**GOOD))) is None
    all_of_it = SimplifyOptions(preset="best", budget=100_000)
    assert next_simplify(all_of_it, LITTLE) is None
    assert next_simplify(SimplifyOptions(image=4096), THIN) is None
    assert next_evaluate(EvaluateOptions(image=4096), THIN) is None


@pytest.mark.parametrize(
    ("chosen", "objects", "words"),
    [
        ({"ground": True, "up": "z", "seed": 3}, 11, "scene MESH -o OCCLUDER --up z --ground"),
        ({}, 10, "simplify MESH -o OCCLUDER --preset best --budget 128"),
        ({"budget": 2}, 2, "scene MESH -o OCCLUDER"),
        # Of one object a scene would have nothing to choose from.
        ({"budget": 2}, 1, "simplify MESH -o OCCLUDER --budget 4 --preset best"),
        ({"budget": 100}, 16, "simplify MESH -o OCCLUDER --budget 200 --preset best"),
    ],
)
def test_what_has_more_objects_than_boxes_is_a_scene(chosen, objects, words):
    nothing = verdict_on(VerdictFigures(**{**GOOD, "triangles": 0, "recall": 0.0}))
    options = SimplifyOptions(**chosen)
    assert next_simplify(options, nothing, objects=objects) == f"occluder {words}"
    assert next_simplify(options, LITTLE, objects=objects).startswith("occluder simplify")


def test_names_with_spaces_are_quoted():
    command = next_simplify(SimplifyOptions(), LITTLE, ("my castle.glb", "out.glb"))
    assert command is not None
    assert shlex.split(command)[2:5] == ["my castle.glb", "-o", "out.glb"]


def test_an_occluder_from_elsewhere_is_made_or_looked_at_more_closely():
    options = EvaluateOptions(up="z", image=2048)
    assert next_evaluate(options, LITTLE) == f"{BEGIN} --up z --image 2048"
    closer = "occluder evaluate MESH OCCLUDER --up z --image 4096"
    assert next_evaluate(options, THIN) == closer
    made = next_evaluate(EvaluateOptions(), LITTLE, ("a/castle.obj", "a/by_hand.obj"))
    assert made == "occluder simplify a/castle.obj -o a/castle_occluder.glb"


def test_what_kept_wholly_inside_of_a_shell_and_hid_nothing_is_free_to_hide():
    """An open shell has no inside in a flood fill: at some length from it nothing hides."""
    mesh = box(without=[0, 1])
    options = SimplifyOptions(
        shrink=0.01, fill="flood", resolution=16, preset="draft", moves=100, views=8, image=64
    )
    found = simplifier.simplify(mesh, options).measure()
    assert found.verdict.word == "unusable"
    assert found.recall == 0.0
    command = found.report()["verdict"]["next"]
    assert "--shrink" not in command
    freed = simplifier.simplify(mesh, options, shrink=0.0).measure()
    assert freed.verdict.is_good


def test_the_result_of_a_closed_ball_is_good_and_that_of_two_triangles_is_not():
    options = SimplifyOptions(resolution=16, preset="draft", views=8, image=64)
    found = simplifier.simplify(sphere(), options).measure()
    assert found.verdict.is_good
    occluder = simplifier.simplify(sphere(), options, budget=2).occluder
    two = simplifier.evaluate(sphere(), occluder, views=64, image=128)
    assert two.verdict.word == "unusable" or two.recall >= 0.1
    assert two.report()["verdict"]["word"] == two.verdict.word


def test_a_name_that_begins_with_a_dash_is_no_option():
    names = ("-mesh.ply", "-out.glb")
    options = SimplifyOptions()
    assert look_command(options, names).startswith(
        "occluder evaluate ./-mesh.ply ./-out.glb --pictures ./-out_pictures"
    )
    assert " ./-mesh.ply -o ./-out.glb " in next_simplify(options, LITTLE, names)
