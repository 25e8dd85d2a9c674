"""Statistics of convergence, and tiny runs of its parts."""

from __future__ import annotations

import statistics

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import simplifier
from bench import meshes, record
from bench.stability.convergence import __main__ as convergence
from bench.stability.convergence import forms, making, measure, pictures, plot, report, slicers
from bench.stability.convergence.curve import curves, together
from bench.stability.convergence.spread import (
    Spread,
    below_half_a_point,
    fitted_power,
    least_good,
)
from simplifier.errors import BackendUnavailableError
from simplifier.geometry.solid import VoxelGrid
from simplifier.geometry.views import hemisphere_directions
from simplifier.options.stages import SectionOptions, make_options
from simplifier.pipeline import simplify_mesh

POINTS = st.floats(-100.0, 100.0)


@given(st.lists(POINTS, min_size=2, max_size=20))
def test_a_spread_is_mean_and_deviation_of_the_sample(values):
    spread = Spread.of(values)
    assert spread.mean == pytest.approx(statistics.fmean(values), abs=1e-9)
    assert spread.deviation == pytest.approx(statistics.stdev(values), abs=1e-6)
    assert spread.standard_error == pytest.approx(spread.deviation / len(values) ** 0.5)
    assert spread.typical == pytest.approx(np.sqrt(np.mean(np.square(values))), abs=1e-6)
    assert spread.reach >= abs(spread.mean)


@pytest.mark.parametrize("values", [[], [1.0], [[1.0, 2.0]]])
def test_values_without_a_scatter_are_refused(values):
    with pytest.raises(ValueError, match="two or more"):
        Spread.of(values)


@given(st.floats(-3.0, 3.0), st.floats(0.01, 100.0))
def test_the_exponent_of_a_power_law_is_found(exponent, factor):
    at = [16, 64, 256, 1024]
    power = fitted_power(at, [factor * value**exponent for value in at])
    assert power.exponent == pytest.approx(exponent, abs=1e-9)
    assert power.error == pytest.approx(0.0, abs=1e-6)


def test_the_error_of_an_exponent_is_that_of_the_slope():
    """A bend of one e-fold up in the middle of three: level, at 1 / sqrt(3) by hand."""
    power = fitted_power([1.0, np.e, np.e**2], [1.0, np.e, 1.0])
    assert power.exponent == pytest.approx(0.0, abs=1e-12)
    assert power.error == pytest.approx(np.sqrt(2.0 / 3.0 / 2.0))


@pytest.mark.parametrize("errors", [[1.0, 0.5], [1.0, 0.0, 0.5], [0.0, 0.0, 0.0]])
def test_two_points_have_no_fitted_exponent(errors):
    assert fitted_power([1, 2, 3][: len(errors)], errors) is None


def test_the_mean_of_independent_values_falls_with_the_root_of_their_number():
    draws = np.random.default_rng(0).normal(size=(40, 1024))
    at = [16, 64, 256, 1024]
    found = [Spread.of(draws.reshape(-1, n).mean(axis=1)).deviation for n in at]
    power = fitted_power(at, found)
    assert abs(power.exponent + 0.5) < 3.0 * power.error + 0.02


def test_good_from_is_after_the_last_error_that_is_too_large():
    small, large = Spread(0.1, 0.1, 8), Spread(0.1, 0.3, 8)
    assert least_good([8, 16, 32, 64], [large, small, large, small]) == 64
    assert least_good([64, 8], [small, small]) == 8
    assert least_good([8, 16], [small, large]) is None


@pytest.mark.parametrize(
    ("mean", "deviation", "verdict"),
    [(0.3, 0.1, "yes"), (-0.3, 0.1, "yes"), (0.9, 0.1, "no"), (-0.9, 0.1, "no"),
     (0.4, 0.4, "within noise"), (0.6, 0.4, "within noise")],
)  # fmt: skip
def test_a_gain_counts_when_it_is_out_of_its_noise(mean, deviation, verdict):
    assert below_half_a_point(Spread(mean, deviation, 4)) == verdict


def test_errors_of_a_report_fall_with_the_root_of_its_views():
    pixels = np.random.default_rng(1).gamma(4.0, size=(8, 1024, 3))
    found = report.view_curves("noise", pixels, (16, 64, 256))
    assert [curve.figure for curve in found] == ["recall", "precision"]
    for curve in found:
        power = fitted_power(curve.values, [curve.errors[n].deviation for n in curve.values])
        assert power.exponent == pytest.approx(-0.5, abs=0.15)
        assert [curve.errors[n].count for n in curve.values] == [512, 128, 32]
        assert abs(curve.errors[256].mean) < curve.errors[16].deviation
        assert str(curve.summary["exponent"]).startswith("-0.")


def test_seeds_together_scatter_by_the_root_of_their_number():
    apart = curves("m", "image", 8, {"recall": {8: [0.01, 0.03], 16: [0.0, 0.0]}})[0]
    joined = together(apart)
    assert joined.errors[8].mean == apart.errors[8].mean == pytest.approx(2.0)
    assert joined.errors[8].deviation == pytest.approx(apart.errors[8].standard_error)
    assert joined.values == apart.values


def test_views_of_one_kind_have_no_error():
    pixels = np.tile([6.0, 2.0, 0.0], (2, 32, 1))
    recall, precision = report.view_curves("same", pixels, (16, 32))
    assert report.shares(pixels[0]) == {"recall": 0.75, "precision": 1.0}
    for curve in (recall, precision):
        assert all(error.reach < 1e-12 for error in curve.errors.values())


def test_a_turned_lattice_is_the_same_lattice():
    lattice = hemisphere_directions(16)
    turned, other = measure.turned(lattice, 3), measure.turned(lattice, 4)
    assert np.allclose(turned @ turned.T, lattice @ lattice.T)
    assert not np.allclose(turned, other)
    assert np.array_equal(turned, measure.turned(lattice, 3))


def test_what_is_turned_stands_among_its_values():
    for knob in making.KNOBS:
        assert knob.default in knob.values
        assert list(knob.values) == sorted(knob.values)


@pytest.mark.parametrize("of", ["sphere", "castle"])
def test_pictures_of_a_whole_word_give_the_librarys_bytes(of):
    mesh = meshes.bumpy_sphere(400) if of == "sphere" else meshes.mesh_named("castle")
    options = make_options(2.5, budget=12, resolution=20, moves=800, seed=5)
    expected = simplify_mesh(mesh, options).occluder
    whole = pictures.made_by_pictures(mesh, options, 64)
    small = pictures.made_by_pictures(mesh, options, 8)
    assert np.array_equal(whole.vertices, expected.vertices)
    assert np.array_equal(whole.faces, expected.faces)
    assert whole.error_bound == expected.error_bound
    assert not np.array_equal(small.vertices, expected.vertices)


def test_smaller_pictures_keep_their_middle():
    projections = np.random.default_rng(2).normal(size=(3, 2, 4))
    point = np.array([0.3, -0.2, 0.9, 1.0])
    small = pictures.shrunk(projections, 16)
    assert np.allclose(small @ point - 32.0, (projections @ point - 32.0) / 4.0)
    assert np.array_equal(pictures.shrunk(projections, 64), projections)


@pytest.fixture
def small_knobs(monkeypatch):
    monkeypatch.setattr(making, "JUDGE", making.AccuracyOptions(8, 32, exact=True))
    monkeypatch.setattr(making, "SEEDS", 2)
    by_name = {knob.name: knob for knob in making.KNOBS}
    return (
        making.Knob("resolution", 64, (8, 64), by_name["resolution"].make),
        making.Knob("views of refining", 144, (144, 150), by_name["views of refining"].make),
    )


@pytest.fixture
def tiny():
    """A mesh that is simplified in no time, as the parts take one."""
    options = {"budget": 4, "moves": 40}
    return convergence.Subject("tiny", meshes.bumpy_sphere(200), options)


@pytest.mark.slow
def test_trials_share_the_default_and_are_judged_alike(small_knobs, tiny, tmp_path, monkeypatch):
    found = list(making.trials(tiny, small_knobs))
    places = [(trial.knob.name, trial.value) for trial in found]
    assert places == [(knob.name, value) for knob in small_knobs for value in knob.values]
    assert found[1].by_seed == found[2].by_seed  # the default of either knob
    assert found[0].by_seed != found[1].by_seed
    rows = list(making.verdicts(found))
    assert [row["compared with"] for row in rows] == [8, 150]
    record.write_table(
        tmp_path / "stability_convergence_making_by_value.csv", [one.row for one in found], "me"
    )
    defaults = {knob.name: knob.default for knob in small_knobs}
    monkeypatch.setitem(convergence.PICTURES, "making", (plot.plot_gains, defaults, "Trials"))
    folders = ["-o", str(tmp_path), "--images", str(tmp_path)]
    convergence.main(["--only", "making", "--draw", *folders])
    assert cv2.imread(str(tmp_path / "convergence_making.png")).shape[1] > 500


def test_errors_are_drawn(tmp_path):
    values = {8: [0.01, -0.01, 0.02], 16: [0.0, 0.0, 0.0], 32: [0.001, 0.0, 0.002]}
    found = curves("m", "views", 8, {"recall": values, "precision": values})
    record.write_table(tmp_path / "t.csv", [row for one in found for row in one.rows()], "me")
    table = record.read_table(tmp_path / "t.csv")
    rows = [dict(zip(table.columns, cells, strict=True)) for cells in table.rows]
    plot.plot_errors(tmp_path / "p.png", rows, {"views": 8}, "Errors", "me")
    assert cv2.imread(str(tmp_path / "p.png")).shape[0] > 500


def test_an_image_that_shows_nothing_has_no_scale():
    images = np.zeros((3, 64), dtype=np.uint64)
    images[1, 20:40] = np.uint64(0xFFFFF00000)
    found = forms.both_forms(images)
    assert found.bits.shape == found.exact.shape == (1,)
    assert found.scale[0] == pytest.approx(1.0, abs=0.05)


def test_forms_are_compared_for_every_file(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(meshes, "ASSETS", tmp_path)
    monkeypatch.setattr(forms, "_STEPS", 2)
    solid = meshes.bumpy_sphere(200)
    simplifier.save(simplifier.Occluder(solid.vertices, solid.faces), tmp_path / "solid.ply")
    (tmp_path / "broken.ply").write_text("no mesh")
    convergence.main(["--only", "forms", "-o", str(tmp_path), "--images", str(tmp_path)])
    table = record.read_table(tmp_path / "stability_convergence_forms.csv")
    assert "| solid |" in capsys.readouterr().out
    broken, row = (dict(zip(table.columns, cells, strict=True)) for cells in table.rows)
    assert "refused" in broken["note"]
    assert float(row["correlation"]) > 0.99
    assert int(row["steps"]) == 2


def test_slicers_differ_at_faces_of_voxels_alone():
    places = np.indices((20, 14, 17)).reshape(3, -1).T - [9.5, 6.5, 8.0]
    inside = (np.linalg.norm(places, axis=1) < 7.0).reshape(20, 14, 17)
    grid = VoxelGrid(inside, np.zeros(3), 1.0)
    try:
        found = slicers.compared(grid, SectionOptions(directions=6))
    except BackendUnavailableError as error:
        pytest.skip(str(error))
    assert found.covered > 1000
    assert found.near == found.pixels < found.covered // 1000
    assert found.planes <= found.pixels
