"""What the defaults are worth: a report is good to half a point, the search's measure is true."""

from __future__ import annotations

import numpy as np
import pytest

import simplifier
from bench.meshes import bumpy_sphere
from bench.stability.convergence.forms import both_forms, compared_choices, pictures
from bench.stability.convergence.report import pixels_of, view_curves
from bench.stability.convergence.spread import Spread, fitted_power
from examples.castle import castle
from simplifier.evaluation.accuracy import AccuracyOptions, evaluate_accuracy
from simplifier.options import make_options
from simplifier.progress import Stopwatch
from simplifier.solidify import solidify


@pytest.fixture(scope="module")
def castle_and_occluder():
    mesh = castle()
    return mesh, simplifier.simplify(mesh, ground=True, preset="draft")


def test_a_default_report_of_the_castle_is_good_to_half_a_point(castle_and_occluder):
    reports = [simplifier.evaluate(*castle_and_occluder, seed=seed) for seed in range(6)]
    recall = Spread.of([100.0 * report.recall for report in reports])
    precision = Spread.of([100.0 * report.precision for report in reports])
    assert 0.0 < recall.deviation < 0.5
    assert 0.0 < precision.deviation < 0.5


def test_four_times_the_views_halve_the_error(castle_and_occluder):
    options = AccuracyOptions(4096, 64, seed=11, exact=True)
    pixels = pixels_of(evaluate_accuracy(*castle_and_occluder, options))
    recall, _ = view_curves("castle", pixels[None], (16, 64, 256))
    power = fitted_power(recall.values, [recall.errors[n].deviation for n in recall.values])
    assert power.exponent == pytest.approx(-0.5, abs=0.15)


def test_twice_the_pixels_change_a_report_by_less_than_half_a_point(castle_and_occluder):
    usual, fine = (
        evaluate_accuracy(*castle_and_occluder, AccuracyOptions(64, image, exact=True))
        for image in (256, 512)
    )
    assert abs(usual.recall - fine.recall) < 0.005
    assert abs(usual.precision - fine.precision) < 0.005


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


def test_the_exact_form_would_choose_no_much_better_sections():
    mesh = bumpy_sphere(1000)
    options = make_options(float(mesh.extent.max()), preset="draft")
    choices = compared_choices(mesh, solidify(mesh, options.solid, Stopwatch()), options)
    assert choices.steps > 3
    assert choices.worst_loss < 0.5
