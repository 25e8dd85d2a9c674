"""What is drawn by hand and left open, through to the occluder."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import simplifier
from simplifier.errors import OptionError, OverridesError
from simplifier.geometry.overrides import DrawnPart, OpenRegion, Overrides, Region
from tests.schema import check_report
from tests.solids import blob, box, joined, sphere

QUICK = {"resolution": 16, "preset": "draft", "moves": 600}
STANDING = np.array([0.0, 0.0, 0.0, 1.0])


def drawn_box(centre, size, name="box 1"):
    return DrawnPart(name, Region.of(np.array(centre, float), np.array(size, float), STANDING)
                     .triangles)  # fmt: skip


def drawn_quad(corners, name="quad 1"):
    points = np.array(corners, dtype=np.float64)
    return DrawnPart(name, points[[[0, 1, 2], [0, 2, 3]]])


def opening(centre, size, rotation=STANDING, name="open 1"):
    return OpenRegion(name, Region.of(np.array(centre, float), np.array(size, float), rotation))


def soup(occluder):
    return occluder.vertices[occluder.faces]


def ordered(triangles):
    """Rows that do not depend on the order of triangles or of their corners."""
    flat = [tuple(sorted(map(tuple, triangle.tolist()))) for triangle in triangles]
    return sorted(flat)


QUAD = [[0.1, 0.2, 0.3], [0.7, 0.2, 0.3], [0.7, 0.9, 1 / 3], [0.1, 0.9, 1 / 3]]


@pytest.mark.parametrize("more", [{}, {"moves": 0}, {"trim": "area"}, {"conservative": True}])
def test_drawn_parts_are_in_the_result_exactly_and_count_towards_the_budget(more):
    overrides = Overrides((drawn_box((0.4, 0.5, 0.6), (1.9, 0.3, 0.3)), drawn_quad(QUAD)))
    occluder = simplifier.simplify(
        box(), budget=20, overrides=overrides, **{**QUICK, **more}
    ).occluder
    assert 14 < len(occluder.faces) <= 20
    there = ordered(soup(occluder))
    assert all(triangle in there for triangle in ordered(overrides.triangles))


def test_a_budget_that_is_all_drawn_leaves_the_drawn_parts_alone():
    overrides = Overrides((drawn_quad(QUAD),))
    occluder = simplifier.simplify(box(), budget=2, overrides=overrides, **QUICK).occluder
    assert ordered(soup(occluder)) == ordered(overrides.triangles)


def test_a_budget_below_what_is_drawn_is_refused_with_the_numbers():
    overrides = Overrides((drawn_box((0.5, 0.5, 0.5), (1, 1, 1)),))
    with pytest.raises(OptionError, match=r"budget: 11 triangles are fewer than the 12 .* 12 or"):
        simplifier.simplify(box(), budget=11, overrides=overrides, **QUICK)


def test_a_part_in_an_open_region_is_refused():
    with pytest.raises(OverridesError, match=r"'box 1' reaches into the open region open 1; make"):
        Overrides((drawn_box((0, 0, 0), (1, 1, 1)),), (opening((0.5, 0, 0), (0.1, 0.1, 0.1)),))


def test_nothing_overridden_gives_the_same_bytes_as_no_overrides():
    plain = simplifier.simplify(blob(), budget=16, **QUICK).occluder
    same = simplifier.simplify(blob(), budget=16, overrides=Overrides(), **QUICK).occluder
    assert plain.vertices.tobytes() == same.vertices.tobytes()
    assert plain.faces.tobytes() == same.faces.tobytes()


def test_a_mesh_within_the_budget_is_not_its_own_occluder_where_a_person_decided():
    """Else its own triangles would close the region, and come twice beside what is drawn."""
    hole = opening((0.5, 0.5, 0.5), (0.4, 0.4, 3.0))
    own = ordered(box().vertices[box().faces])
    assert ordered(soup(simplifier.simplify(box(), budget=40, **QUICK).occluder)) == own
    found = soup(
        simplifier.simplify(box(), budget=40, overrides=Overrides(open=(hole,)), **QUICK).occluder
    )
    assert len(found) > 0
    assert not hole.region.crossed_by(found).any()
    drawn = Overrides((drawn_quad(QUAD),))
    found = ordered(soup(simplifier.simplify(box(), budget=40, overrides=drawn, **QUICK).occluder))
    assert len(found) <= 40
    assert not any(triangle in found for triangle in own)
    assert all(triangle in found for triangle in ordered(drawn.triangles))


def test_what_are_no_overrides_is_refused_by_name():
    say = "overrides: 'castle.overrides.toml' is no overrides; give what simplifier.load_overrides"
    text = "castle.overrides.toml"
    occluder = simplifier.Occluder(box().vertices, box().faces)
    for call in (
        lambda: simplifier.simplify(box(), overrides=text).occluder,
        lambda: simplifier.simplify(box(), overrides=text, lods=3).chain,
        lambda: simplifier.simplify(box(), overrides=text).measure(),
        lambda: simplifier.evaluate(box(), occluder, overrides=text),
    ):
        with pytest.raises(OptionError, match=say):
            call()
    with pytest.raises(OptionError, match=r"ignore: 'glass' is no ignore; give"):
        simplifier.load("a.obj", ignore="glass")
    with pytest.raises(OptionError, match=r"path: 3 is no path; give"):
        simplifier.load_overrides(3)


def test_what_is_drawn_over_one_half_leaves_the_search_the_other():
    mesh = joined(box(), box(low=(3.0, 0.0, 0.0)))
    overrides = Overrides((drawn_box((0.5, 0.5, 0.5), (1, 1, 1)),))
    chosen = {**QUICK, "budget": 24, "overhang": 1.0}  # few moves: a fine would leave little
    occluder = simplifier.simplify(mesh, overrides=overrides, **chosen).occluder
    found = [one for one in ordered(soup(occluder)) if one not in ordered(overrides.triangles)]
    assert found
    assert np.array(found)[:, :, 0].mean() > 2.5
    assert simplifier.evaluate(mesh, occluder, views=16, image=64).accuracy.recall > 0.7


# Regions left open.


def rays_into(region, generator, count):
    """Segments between points of the region: begin (n, 3) and end (n, 3)."""
    shares = generator.uniform(-1.0, 1.0, (2, count, 3)) * region.half
    return shares[0] @ region.axes + region.centre, shares[1] @ region.axes + region.centre


def hits(begin, end, triangles):
    """(n,) whether each segment meets a triangle (Moller and Trumbore)."""
    along = (end - begin)[:, None]
    edge, other = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    p = np.cross(along, other)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = 1.0 / np.einsum("mi,nmi->nm", edge, p)
        away = begin[:, None] - triangles[:, 0]
        u = np.einsum("nmi,nmi->nm", away, p) * scale
        q = np.cross(away, edge)
        v = np.einsum("nmi,nmi->nm", np.broadcast_to(along, q.shape), q) * scale
        t = np.einsum("mi,nmi->nm", other, q) * scale
        met = (u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0) & (t <= 1)
    return met.any(axis=1)


@settings(max_examples=8, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([{}, {"moves": 0}, {"trim": "area"}, {"conservative": True},
                     {"preset": "balanced", "budget": 40}]),
)  # fmt: skip
def test_no_ray_within_an_open_region_meets_the_occluder(seed, more):
    generator = np.random.default_rng(seed)
    region = opening(
        generator.uniform(-0.6, 0.6, 3), generator.uniform(0.05, 1.5, 3), generator.normal(size=4)
    )
    overrides = Overrides(open=(region,))
    options = {"budget": 16, **QUICK, **more}
    occluder = simplifier.simplify(sphere(), overrides=overrides, **options).occluder
    assert not region.region.crossed_by(soup(occluder)).any()
    begin, end = rays_into(region.region, generator, 400)
    assert not hits(begin, end, soup(occluder)).any()


def test_a_region_stays_open_in_every_file(tmp_path):
    """Rounding to 32 bits moves corners, by more the further they are from the origin."""
    far = np.array([400.0, 0.0, 200.0])
    ball_there = simplifier.TriangleMesh.from_soup(sphere().vertices + far, sphere().faces)
    region = opening(far + np.array([0.2, 0.1, 0.0]), (0.4, 0.4, 3.0))
    occluder = simplifier.simplify(
        ball_there, overrides=Overrides(open=(region,)), **QUICK
    ).occluder
    assert len(occluder.faces) > 0
    for suffix in (".glb", ".obj", ".stl"):
        simplifier.save(occluder, tmp_path / f"out{suffix}")
        read = simplifier.load_occluder(tmp_path / f"out{suffix}")
        assert not region.region.crossed_by(soup(read)).any()


def test_the_unrefined_cut_would_pass_through_without_the_region():
    region = opening((0, 0, 0), (0.5, 0.5, 3.0))
    for moves in (0, 600):
        plain = simplifier.simplify(sphere(), budget=16, **{**QUICK, "moves": moves}).occluder
        assert region.region.crossed_by(soup(plain)).any()


def test_a_region_around_all_of_it_leaves_an_empty_occluder_and_a_warning():
    product = simplifier.simplify(
        box(), simplifier.SimplifyOptions(**QUICK, views=4, image=32, quads=50),
        overrides=Overrides(open=(opening((0.5, 0.5, 0.5), (9, 9, 9)),)),
    ).measure()  # fmt: skip
    assert len(product.occluder.faces) == 0
    assert any("open region" in warning for warning in product.warnings)


# Levels, reports, judgements.


def test_every_level_has_what_is_drawn_and_leaves_regions_open():
    quad = [[-0.2, -0.2, 0], [0.2, -0.2, 0], [0.2, 0.2, 0], [-0.2, 0.2, 0]]
    hole = opening((0.8, 0.0, 0.0), (0.3, 0.3, 3.0))
    parts = tuple(drawn_quad(np.array(quad) * s, f"quad {s}") for s in (1, 2, 3))
    overrides = Overrides(parts, (hole,))
    chain = simplifier.simplify(
        sphere(), lods=3, budget=16, overrides=overrides, resolution=24, preset="draft", moves=600
    ).chain
    assert len(chain.levels) > 1
    for level in chain.levels:
        there = ordered(soup(level.occluder))
        assert all(triangle in there for triangle in ordered(overrides.triangles))
        assert not hole.region.crossed_by(soup(level.occluder)).any()


def test_a_report_tells_of_a_part_that_sticks_out_and_by_how_much():
    out = DrawnPart("sail", drawn_box((3.0, 0.5, 0.5), (2, 1, 1)).triangles, "a.overrides.toml:7")
    inside = drawn_box((0.5, 0.5, 0.5), (0.5, 0.5, 0.5), "core")
    options = simplifier.SimplifyOptions(**QUICK, views=4, image=32, quads=50)
    product = simplifier.simplify(box(), options, overrides=Overrides((out, inside))).measure()
    told = [warning for warning in product.warnings if "sticks out" in warning]
    assert len(told) == 1
    assert told[0].startswith("sail (a.overrides.toml:7) sticks out of the mesh by 3")
    report = product.report()
    assert report["deviation"] == pytest.approx(3.0, abs=0.1)
    assert report["error_bound"] < 0.3
    assert report["options"]["overrides"] == {
        "drawn": ["sail", "core"], "triangles": 24, "open": [], "viewers": 0,
    }  # fmt: skip


def test_judging_tells_of_triangles_that_pass_through_an_open_region():
    options = simplifier.EvaluateOptions(resolution=8, views=4, image=32, quads=50)
    whole = simplifier.Occluder(box().vertices, box().faces)
    window = opening((0.5, 0.5, 0.0), (0.2, 0.2, 0.2), name="window")
    judged = simplifier.evaluate(box(), whole, options, overrides=Overrides(open=(window,)))
    report = judged.report()
    assert report["warnings"] == ["2 triangles pass through the open region window"]
    assert report["options"]["overrides"] == {
        "drawn": [],
        "triangles": 0,
        "open": ["window"],
        "viewers": 0,
    }
    check_report(report)
