"""What the defaults are worth: a report is good to half a point, the search's measure is true."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import simplifier
from bench.meshes import bumpy_sphere
from bench.stability.convergence import forms
from bench.stability.convergence.forms import both_forms, compared_choices, pictures
from bench.stability.convergence.report import pixels_of, view_curves
from bench.stability.convergence.spread import HALF_A_POINT, Spread, fitted_power
from examples.castle import castle
from simplifier.accuracy.accuracy import AccuracyOptions, evaluate_accuracy
from simplifier.options.stages import make_options
from simplifier.progress import Stopwatch
from simplifier.steps.solid import solidify


@pytest.fixture(scope="module")
def castle_and_occluder():
    mesh = castle()
    return mesh, simplifier.simplify(mesh, ground=True, preset="draft", overhang=1.0).occluder


@pytest.fixture(scope="module")
def castle_recall_and_precision(castle_and_occluder):
    """Errors of reports of more and more views, from one set of many."""
    options = AccuracyOptions(4096, 64, seed=11, exact=True)
    pixels = pixels_of(evaluate_accuracy(*castle_and_occluder, options))
    return view_curves("castle", pixels[None], (64, 256, 1024))


def test_default_views_are_good_to_half_a_point_of_precision(castle_recall_and_precision):
    _, precision = castle_recall_and_precision
    assert 0.0 < precision.errors[256].reach < HALF_A_POINT


def test_on_the_castle_half_a_point_of_recall_takes_more_than_the_default_views(
    castle_recall_and_precision,
):
    """Few of its views hold the largest quads and weigh most: recall scatters by them."""
    recall, _ = castle_recall_and_precision
    assert recall.errors[256].deviation < 1.5
    assert recall.errors[256].reach > HALF_A_POINT
    assert recall.errors[1024].reach < recall.errors[256].reach


def test_four_times_the_views_halve_the_error(castle_recall_and_precision):
    for curve in castle_recall_and_precision:
        power = fitted_power(curve.values, [curve.errors[n].deviation for n in curve.values])
        assert power.exponent == pytest.approx(-0.5, abs=0.2)


def test_default_reports_of_a_round_solid_are_good_to_half_a_point():
    mesh = bumpy_sphere(1000)
    occluder = simplifier.simplify(mesh, preset="draft").occluder
    reports = [evaluate_accuracy(mesh, occluder, AccuracyOptions(seed=seed)) for seed in range(8)]
    for figure in ("recall", "precision"):
        found = Spread.of([100.0 * getattr(report, figure) for report in reports])
        assert 0.0 < found.deviation < HALF_A_POINT


def test_twice_the_pixels_change_a_report_by_less_than_half_a_point(castle_and_occluder):
    # Of the castle a few views hold the largest quads: in so many they do not tell.
    options = AccuracyOptions(512, exact=True)
    usual = evaluate_accuracy(*castle_and_occluder, options)
    fine = evaluate_accuracy(*castle_and_occluder, replace(options, image=512))
    assert abs(usual.recall - fine.recall) < 0.003
    assert abs(usual.precision - fine.precision) < 0.003


def test_the_bit_form_of_the_measure_follows_the_exact_one():
    mesh = bumpy_sphere(1000)
    options = make_options(float(mesh.extent.max()))
    solid = solidify(mesh, options.solid, Stopwatch())
    found = both_forms(pictures(mesh, solid, options, 128))
    # A ball's views are alike, so the shape is varied too: each view with a strip cut off.
    strips = np.uint64(2**64 - 1) << np.arange(0, 48, 3, dtype=np.uint64)
    images = pictures(mesh, solid, options, 16)
    cut = both_forms((images[:, None, :] & strips[None, :, None]).reshape(-1, 64))
    assert np.abs(found.scale - 1.0).max() < 0.03
    assert cut.correlation > 0.999


def test_the_exact_form_would_choose_no_much_better_sections(monkeypatch):
    monkeypatch.setattr(forms, "_CONTENDERS", 24)  # each is judged exactly, which takes long
    mesh = bumpy_sphere(1000)
    options = make_options(float(mesh.extent.max()), preset="draft")
    choices = compared_choices(mesh, solidify(mesh, options.solid, Stopwatch()), options)
    assert choices.steps > 3
    assert choices.worst_loss < 0.5
