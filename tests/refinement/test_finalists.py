"""The judge: figures of a report, and a choice that keeps to the aim."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.meshes import bumpy_sphere
from simplifier.accuracy.accuracy import AccuracyOptions, evaluate_accuracy
from simplifier.accuracy.overhang import measure_overhang
from simplifier.device.device import PROCESSOR, soup_masks
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.views import BoundingSphere, image_axes, random_directions
from simplifier.refinement.finalists import FineViews, Judge, Outlines, score_finalist
from tests.pictures import sphere_projections

MESH = bumpy_sphere(4_000)


def soup(scale):
    """The mesh itself, larger or smaller: (m, 3, 3)."""
    return np.array(MESH.vertices[MESH.faces] * scale)


@pytest.fixture(scope="module")
def views():
    sphere = BoundingSphere.of(MESH)
    axes = image_axes(random_directions(8, 3))
    maps = sphere_projections(axes, sphere.centre, 1.1 * sphere.radius)
    mesh = np.array(MESH.vertices), np.array(MESH.faces)
    return FineViews.of(*mesh, maps, Outlines.of(*mesh, maps))


def test_it_is_what_a_report_says(views):
    triangles = soup(0.8)
    found = score_finalist(triangles, views)
    occluder = Occluder(
        triangles.reshape(-1, 3), np.arange(3 * len(triangles), dtype=np.int32).reshape(-1, 3)
    )
    report = evaluate_accuracy(MESH, occluder, AccuracyOptions(8, seed=3, exact=True))
    assert found.recall == pytest.approx(report.recall, abs=0.02)
    assert found.precision == pytest.approx(report.precision, abs=0.001)


def test_the_mesh_itself_and_nothing(views):
    whole = score_finalist(soup(1.0), views)
    assert (whole.precision, whole.recall) == (1.0, 1.0)
    nothing = score_finalist(np.empty((0, 3, 3)), views)
    assert (nothing.precision, nothing.recall) == (1.0, 0.0)


def test_more_recall_wins_among_the_precise(views):
    small, large = soup(0.7), soup(0.9)
    assert Judge(views, 0.99).best_of([small, large]) is large
    assert Judge(views, 0.99).best_of([large, small]) is large


def test_what_hides_too_much_loses_and_so_does_what_hides_nothing(views):
    swollen, inner = soup(1.3), soup(0.9)
    assert score_finalist(swollen, views).precision < 0.97
    assert Judge(views, 0.99).best_of([swollen, inner]) is inner
    slightly = soup(1.02)  # a little short of an aim for perfection is better than nothing at all
    assert Judge(views, 1.0).best_of([np.empty((0, 3, 3)), slightly]) is slightly


def test_overhang_is_what_a_report_says(views):
    swollen = soup(1.05)
    found = score_finalist(swollen, views)
    occluder = Occluder(
        swollen.reshape(-1, 3), np.arange(3 * len(swollen), dtype=np.int32).reshape(-1, 3)
    )
    told = measure_overhang(MESH, occluder, random_directions(8, 3))
    assert found.overhang == pytest.approx(told.mean, rel=0.05)
    assert found.worst == pytest.approx(told.worst, rel=0.05)
    assert score_finalist(soup(1.0), views).worst == 0.0


def test_what_sticks_out_more_than_it_may_loses_though_it_hides_more(views):
    swollen, inner = soup(1.02), soup(0.85)
    assert Judge(views, 0.5, 0.005).best_of([swollen, inner]) is inner
    assert Judge(views, 0.5, 0.2).best_of([swollen, inner]) is swollen


def test_what_is_drawn_by_hand_never_sticks_out(views):
    spike = np.array([[[0.0, 0.0, 0.0], [3.0, 0.1, 0.0], [3.0, 0.0, 0.1]]])
    mesh = np.array(MESH.vertices), np.array(MESH.faces)
    corners = len(mesh[0]) + np.arange(3, dtype=np.int32).reshape(1, 3)
    both = np.concatenate([mesh[0], spike[0]]), np.concatenate([mesh[1], corners])
    outlines = Outlines.of(*both, views.projections / 4.0, spike)
    assert outlines.overhang(soup(0.9)).max() == 0.0
    assert outlines.overhang(soup(1.1)).min() > 0.0


def test_the_first_of_equals(views):
    one, same = soup(0.9), soup(0.9)
    assert Judge(views, 0.99).best_of([one, same]) is one


def test_what_is_spare_competes_where_the_best_is_worth_less_than_much(views):
    best, spare, made = soup(0.97), soup(0.99), []

    def make():
        made.append(True)
        return [spare]

    judge = Judge(views, 0.99)
    assert judge.worth(best) > 0.7
    assert judge.best_of([best], make) is best
    assert not made
    assert judge.best_of([best], make, 1.0) is spare


def test_pictures_of_a_soup_are_drawn_once(views, monkeypatch):
    drawn = []

    def score(triangles, views):
        drawn.append(triangles)
        return score_finalist(triangles, views)

    monkeypatch.setattr("simplifier.refinement.finalists.score_finalist", score)
    judge, some = Judge(views, 0.99), [soup(0.9), soup(0.97)]
    best = judge.best_of(some)
    assert judge.worth(best) <= judge.recall(best) == score_finalist(best, views).recall
    assert len(drawn) == 2


def pixels(masks):
    """(V, rows, columns) bool."""
    return np.unpackbits(masks.view(np.uint8), axis=2, bitorder="little").astype(bool)


@pytest.mark.parametrize("scale", [0.5, 0.9, 1.1])
def test_halved_pictures_are_every_other_pixel_of_the_fine_ones(views, scale):
    """Of the original, and of whatever is drawn to their size."""
    halved = views.halved()
    assert np.array_equal(pixels(halved.originals), pixels(views.originals)[:, ::2, ::2])
    assert halved.size == views.size // 2
    fine = soup_masks(PROCESSOR, soup(scale), views.projections, views.size)
    small = soup_masks(PROCESSOR, soup(scale), halved.projections, halved.size)
    assert np.array_equal(pixels(small), pixels(fine)[:, ::2, ::2])


@pytest.mark.parametrize("scale", [0.5, 0.8, 1.0, 1.02])
def test_coarser_pictures_show_nearly_the_same(views, scale):
    judge, triangles = Judge(views, 0.99, 0.005), soup(scale)
    fine, coarse = judge.score(triangles), judge.coarser().score(triangles)
    assert coarse.recall == pytest.approx(fine.recall, abs=0.01)
    assert coarse.precision == pytest.approx(fine.precision, abs=0.001)
    assert (coarse.overhang, coarse.worst) == (fine.overhang, fine.worst)


def test_no_card_is_asked_for_coarser_pictures(views):
    """By OpenGL a sheet took 1.5 in place of 0.8 s: each picture waits for an answer."""
    asks_none = replace(views, outlines=replace(views.outlines, device=None))
    expected = Judge(views, 0.99).coarser().score(soup(0.9))
    assert Judge(asks_none, 0.99).coarser().score(soup(0.9)) == expected


@pytest.mark.parametrize("scale", [0.5, 0.9, 1.02, 1.3])
def test_a_score_is_given_only_above_a_worth(views, scale):
    judge, triangles = Judge(views, 0.99, 0.005), soup(scale)
    worth = judge.worth(triangles)
    assert judge.score_above(worth, triangles) is None
    assert judge.score_above(worth - 1e-9, triangles) == judge.score(triangles)
    assert judge.worth_of(judge.score(triangles)) == worth


def test_what_sticks_out_too_much_is_not_drawn_for_recall(views, monkeypatch):
    judge, drawn = Judge(views, 0.99, 0.005), []

    def score(*given):
        drawn.append(given)
        return score_finalist(*given)

    monkeypatch.setattr("simplifier.refinement.finalists.score_finalist", score)
    assert judge.score_above(0.0, soup(1.05)) is None
    assert drawn == []
    assert judge.score_above(0.0, soup(0.9)) is not None
    assert len(drawn) == 1
