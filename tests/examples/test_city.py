"""The city is what it says: closed buildings that keep off the streets and each other."""

from __future__ import annotations

import sys
from collections import Counter

import numpy as np
import pytest
import shapely
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from examples import city as program
from examples.city import city
from examples.city_models import building_models, lamp, trees
from simplifier.io.scene import load_scene
from tests.examples.test_building import open_edges

BUILDINGS = {
    "house", "row", "corner", "horseshoe", "courtyard", "slab", "hall", "office", "tower",
}  # fmt: skip


@pytest.fixture(scope="module")
def models():
    return building_models(np.random.default_rng(0))


@pytest.fixture
def ready_models(models, monkeypatch):
    """Cities of models that are there, without the second that making them takes."""
    monkeypatch.setattr(program, "building_models", lambda generator: models)


@pytest.fixture(scope="module")
def scene():
    return city(1500, seed=1)


def kinds(scene):
    return np.array([name.rsplit(" ", 1)[0] for name in scene.names])


def plans(scene, chosen):
    """The ground that objects take: the box of each mesh, turned as the object is."""
    found = []
    for index in np.nonzero(chosen)[0]:
        mesh = scene.meshes[scene.mesh_of[index]]
        (x0, _, z0), (x1, _, z1) = mesh.bounds
        corners = np.array([[x0, 0, z0], [x1, 0, z0], [x1, 0, z1], [x0, 0, z1]])
        transform = scene.transforms[index]
        found.append(shapely.Polygon((corners @ transform[:3, :3].T + transform[:3, 3])[:, [0, 2]]))
    return np.array(found)


def shared_area(first, second):
    """The largest area that one of each has in common."""
    tree = shapely.STRtree(second)
    a, b = tree.query(first, predicate="intersects")
    if first is second:
        a, b = a[a < b], b[a < b]
    return shapely.area(shapely.intersection(first[a], second[b])).max(initial=0.0)


def test_there_are_many_models_of_many_heights(models):
    assert 60 <= len(models) <= 200
    assert len({model.mesh.vertices.tobytes() for model in models}) == len(models)
    heights = np.array([model.mesh.bounds[1, 1] for model in models])
    assert heights.min() > 6.0
    assert 140.0 < heights.max() < 160.0
    assert np.count_nonzero(heights < 60.0) > 0.8 * len(models)


def test_every_model_is_closed_and_all_its_pieces_are_wound_outwards(models):
    for model in [*models, *trees(), lamp()]:
        mesh = model.mesh
        assert open_edges(mesh) == []
        assert mesh.dropped.total == 0
        ends = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]]])
        links = coo_matrix((np.ones(len(ends)), ends.T), shape=(len(mesh.vertices),) * 2)
        count, piece = connected_components(links, directed=False)
        volumes = np.linalg.det(mesh.vertices[mesh.faces]) / 6.0
        assert (np.bincount(piece[mesh.faces[:, 0]], volumes, count) > 0.01).all(), model.kind


def test_models_stand_on_the_ground_within_what_they_take(models):
    for model in [*models, *trees()]:
        low, high = model.mesh.bounds
        assert low[1] == 0.0
        assert max(-low[0], high[0]) <= model.width / 2.0 + 1e-9
        assert max(-low[2], high[2]) <= model.depth / 2.0 + 1e-9


@pytest.mark.slow
def test_ten_thousand_buildings_have_about_ten_million_triangles():
    scene = city(10_000)
    counts = Counter(kinds(scene).tolist())
    assert sum(counts[kind] for kind in BUILDINGS) == 10_000
    assert set(counts) == BUILDINGS | {"tree", "lamp", "pavement", "lawn", "avenue", "ground"}
    assert 8e6 < scene.triangle_counts.sum() < 12e6
    assert 0.03 < (counts["tree"] + counts["lamp"]) / len(scene) < 0.1
    assert counts["tower"] >= 20
    assert len(set(scene.names)) == len(scene)


@pytest.mark.parametrize("count", [1, 2, 100, 731])
def test_exactly_as_many_buildings_as_asked_for(count, ready_models):
    assert np.isin(kinds(city(count)), list(BUILDINGS)).sum() == count


@pytest.mark.slow
def test_the_same_arguments_give_the_same_city():
    first, again, other = city(200, seed=5), city(200, seed=5), city(200, seed=6)
    assert first.names == again.names
    assert first.transforms.tobytes() == again.transforms.tobytes()
    for ours, theirs in zip(first.meshes, again.meshes, strict=True):
        assert ours.vertices.tobytes() == theirs.vertices.tobytes()
        assert ours.faces.tobytes() == theirs.faces.tobytes()
    assert other.transforms.tobytes() != first.transforms.tobytes()


def test_buildings_keep_off_each_other(scene):
    buildings = plans(scene, np.isin(kinds(scene), list(BUILDINGS)))
    assert shared_area(buildings, buildings) < 1e-6


def test_buildings_keep_off_the_streets_and_the_avenue(scene):
    """Pavements are the blocks, so what is within one is off all streets of the grid."""
    kind = kinds(scene)
    buildings = plans(scene, np.isin(kind, list(BUILDINGS)))
    blocks = shapely.unary_union(plans(scene, kind == "pavement"))
    assert shapely.covers(blocks.buffer(-2.0), buildings).all()
    assert shared_area(buildings, plans(scene, kind == "avenue")) < 1e-6


def test_blocks_keep_apart_by_the_width_of_a_street(scene):
    blocks = plans(scene, kinds(scene) == "pavement")
    near = shapely.STRtree(blocks).query(blocks, predicate="dwithin", distance=11.9)
    assert (near[0] == near[1]).all()


def test_trees_stand_on_lawns_and_lamps_beside_the_street(scene):
    kind = kinds(scene)
    assert np.count_nonzero(kind == "tree") == 60
    assert np.count_nonzero(kind == "lamp") == 45
    lawns = shapely.unary_union(plans(scene, kind == "lawn"))
    assert shapely.covers(lawns, plans(scene, kind == "tree")).all()
    buildings = plans(scene, np.isin(kind, list(BUILDINGS)))
    for small in ("tree", "lamp"):
        assert shared_area(plans(scene, kind == small), buildings) == 0.0
    assert shared_area(plans(scene, kind == "lamp"), plans(scene, kind == "avenue")) == 0.0


def test_ground_lies_below_everything_and_its_tiles_do_not_overlap(scene):
    kind = kinds(scene)
    tiles = plans(scene, kind == "ground")
    assert shared_area(tiles, tiles) < 1e-6
    assert shapely.covers(shapely.unary_union(tiles), plans(scene, kind == "pavement")).all()
    assert scene.bounds()[kind == "ground"][:, 1, 1].max() == 0.0
    assert scene.bounds()[kind != "ground"][:, 0, 1].min() == 0.0


def test_buildings_are_turned_by_exact_quarters_but_for_those_along_the_avenue(scene):
    kind = kinds(scene)
    linear = scene.transforms[np.isin(kind, list(BUILDINGS)), :3, :3]
    quarter = np.isin(linear, [-1.0, 0.0, 1.0]).all(axis=(1, 2))
    assert 0.7 < quarter.mean() < 0.99
    odd = linear[~quarter]
    np.testing.assert_allclose(
        odd @ odd.transpose(0, 2, 1), np.eye(3)[None].repeat(len(odd), 0), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(linear), 1.0)
    avenue = scene.transforms[kind == "avenue"][0, :3, 0]
    along = np.abs(odd[:, :, 0] @ avenue / np.linalg.norm(avenue))
    np.testing.assert_allclose(along, 1.0)


def test_towers_stand_nearer_to_the_middle_than_houses(scene):
    kind, places = kinds(scene), np.linalg.norm(scene.transforms[:, [0, 2], 3], axis=1)
    tall, low = np.isin(kind, ["tower", "office"]), kind == "house"
    assert np.median(places[tall]) < 0.6 * np.median(places[low])


def test_the_program_writes_a_city_that_reads_back_the_same(tmp_path, monkeypatch, ready_models):
    path = tmp_path / "city.glb"
    monkeypatch.setattr(sys, "argv", ["city", str(path), "--buildings", "60", "--seed", "3"])
    program.main()
    back, made = load_scene(path), city(60, seed=3)
    assert back.names == made.names
    assert back.warnings == ()
    assert back.transforms.tobytes() == made.transforms.tobytes()
    assert back.triangle_counts.tolist() == made.triangle_counts.tolist()
    for ours, theirs in zip(back.meshes, made.meshes, strict=True):
        np.testing.assert_array_equal(ours.vertices[ours.faces], theirs.vertices[theirs.faces])


@pytest.mark.parametrize(
    ("arguments", "said"),
    [(["city.glb", "--buildings", "0"], "must be 1 or more"), (["city.obj"], "use .glb")],
)
def test_the_program_refuses_in_one_line(
    tmp_path, monkeypatch, capsys, ready_models, arguments, said
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["city", *arguments, "--seed", "1"])
    if arguments == ["city.obj"]:
        sys.argv += ["--buildings", "5"]
    with pytest.raises(SystemExit) as stopped:
        program.main()
    assert said in str(stopped.value.code) + capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_no_buildings_are_refused():
    with pytest.raises(ValueError, match="choose 1 or more"):
        city(0)
