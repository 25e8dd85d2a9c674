"""Paths through scenes: never through a wall, at the right height, the same for the same seed."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from examples.castle import castle
from simplifier.camera_paths.generate import generate_path
from simplifier.errors import MeshError, OptionError
from simplifier.geometry.scene import Scene
from simplifier.io.scene import load_scene
from simplifier.options.scene import PathOptions
from tests.solids import box
from tests.walkable import (
    TO_UP,
    crossed,
    flat,
    house,
    moved,
    positions,
    scene_of,
    triangles,
    two_boxes,
)

LYON = (1_842_000.0, 5_176_000.0, 200.0)
SEEDS = range(5)


def steps(path):
    return np.linalg.norm(np.diff(positions(path), axis=0), axis=1)


def forwards(path):
    return np.array([camera.axes[2] for camera in path.cameras])


def upright(points, up):
    """World places (n, 3) of a scene that was turned, z up again."""
    return points[:, np.argsort(TO_UP[up])]


# A street between two houses.


@pytest.mark.parametrize("ground", [True, False])
@pytest.mark.parametrize("seed", SEEDS)
def test_street_keeps_off_the_houses_at_eye_height(ground, seed):
    scene = two_boxes(ground=ground)
    path = generate_path(scene, PathOptions("street", frames=40, up="z", seed=seed))
    places = positions(path)
    assert len(path.cameras) == 40
    assert path.name == "street"
    assert places[:, 2] == pytest.approx(1.7, abs=1e-9)
    bounds = scene.bounds()[:2]
    for low, high in bounds:
        away = np.maximum(np.maximum(low - places, places - high), 0.0)[:, :2]
        assert np.linalg.norm(away, axis=1).min() > 0.35 * 1.7 - 0.3
    assert crossed(path, triangles(scene)) == 0
    assert steps(path).max() <= 8.0 * 1.7 + 1e-9
    assert steps(path).sum() > 50.0
    if ground:
        low, high = scene.bounds()[2]
        assert ((places >= low)[:, :2] & (places <= high)[:, :2]).all()


def test_street_goes_between_the_houses():
    """In most of many walks; all of them would go around if clearance alone counted."""
    scene = two_boxes()
    between = 0
    for seed in range(8):
        x, y, _ = positions(
            generate_path(scene, PathOptions("street", frames=40, up="z", seed=seed))
        ).T
        between += bool(((x > 20.0) & (x < 28.0) & (y > 5.0) & (y < 35.0)).any())
    assert between >= 4


def test_views_follow_the_walk_and_turn():
    path = generate_path(two_boxes(), PathOptions("street", frames=40, up="z"))
    walk = np.diff(positions(path), axis=0)
    ahead = (forwards(path)[:-1] * walk).sum(axis=1) / np.linalg.norm(walk, axis=1)
    assert (ahead > 0.5).mean() > 0.85
    assert np.ptp(np.degrees(np.arccos(ahead.clip(-1.0, 1.0)))) > 20.0
    assert all(camera.fov == 60.0 for camera in path.cameras)
    assert np.array([camera.axes[1] for camera in path.cameras]) == pytest.approx(
        np.tile([0.0, 0.0, 1.0], (40, 1)), abs=1e-12
    )


@pytest.mark.parametrize("thickness", [0.0, 0.5, 2.5])
def test_street_walks_on_a_slab_not_under_it(thickness):
    ground = flat(60.0, 52.0, (-6.0, -6.0, 0.0))
    if thickness:
        ground = box((60.0, 52.0, thickness), (-6.0, -6.0, -thickness))
    scene = scene_of(*two_boxes().meshes[:2], ground)
    path = generate_path(scene, PathOptions("street", frames=30, up="z"))
    assert positions(path)[:, 2] == pytest.approx(1.7, abs=1e-9)
    assert crossed(path, triangles(scene)) == 0


def test_street_follows_a_hill():
    """Houses without a ground, on a slope of 1 in 10."""
    houses = [
        box((16.0, 16.0, 9.0), (24.0 * i, 24.0 * j, 2.4 * i)) for i in range(4) for j in range(3)
    ]
    path = generate_path(scene_of(*houses), PathOptions("street", frames=60, up="z", seed=3))
    places = positions(path)
    # A base is level over 16, so up to 1.6 above the slope.
    assert np.abs(places[:, 2] - 1.7 - 0.1 * places[:, 0].clip(0.0, 88.0)).max() < 1.7
    assert np.ptp(places[:, 2]) > 2.0
    assert crossed(path, triangles(scene_of(*houses))) == 0


# Rooms.


@pytest.mark.parametrize("seed", SEEDS)
def test_inside_visits_both_rooms_through_the_door(seed):
    scene = house()
    path = generate_path(scene, PathOptions("inside", frames=30, up="z", seed=seed))
    places = positions(path)
    assert crossed(path, triangles(scene)) == 0
    assert (places[:, 0] < 5.2).any()
    assert (places[:, 0] > 5.4).any()
    assert (places > [0.2, 0.2, 0.0]).all()
    assert (places < [10.4, 5.2, 2.6]).all()
    # Floors are found to a voxel of 0.1.
    assert places[:, 2] == pytest.approx(1.7, abs=0.21)


def test_doors_by_name_are_walked_through():
    path = generate_path(house(door_leaf=True), PathOptions("inside", frames=30, up="z"))
    x = positions(path)[:, 0]
    assert (x < 5.2).any()
    assert (x > 5.4).any()
    assert crossed(path, triangles(house(door_leaf=True), without="IfcDoor")) == 0


def test_other_leaves_are_not_walked_through():
    """An indoor plant is no door."""
    scene = house(door_leaf=True)
    names = (*scene.names[:-1], "indoor plant")
    closed = Scene(scene.meshes, names, scene.mesh_of.copy(), scene.transforms.copy())
    path = generate_path(closed, PathOptions("inside", frames=30, up="z"))
    x = positions(path)[:, 0]
    assert (x < 5.2).all() or (x > 5.4).all()
    assert crossed(path, triangles(closed)) == 0


def test_inside_climbs_stairs():
    """Ten steps of 0.2 from one half of a hall to the other."""
    parts = [
        box((4.0, 4.0, 0.2), (0.0, 0.0, -0.2)),
        *(box((0.3, 4.0, 0.2 * (i + 1) + 0.2), (4.0 + 0.3 * i, 0.0, -0.2)) for i in range(10)),
        box((4.0, 4.0, 2.2), (7.0, 0.0, -0.2)),
        box((11.0, 4.0, 6.0), (0.0, 0.0, -0.2), without=(1, 4)),
    ]
    path = generate_path(scene_of(*parts), PathOptions("inside", frames=40, up="z", seed=1))
    z = positions(path)[:, 2]
    assert z.min() < 2.0
    assert z.max() > 3.5
    assert crossed(path, triangles(scene_of(*parts))) == 0


def test_open_topped_rooms_count():
    parts = house()
    scene = scene_of(*(mesh for i, mesh in enumerate(parts.meshes) if i != 1))
    path = generate_path(scene, PathOptions("inside", frames=20, up="z"))
    assert (positions(path)[:, :2] < [10.4, 5.2]).all()
    assert (positions(path)[:, :2] > 0.2).all()


def test_shells_without_floors_have_no_interior():
    shells = [box((9.0, 15.0, 6.0), (17.0 * i, 0.0, 0.0), without=(4,)) for i in range(2)]
    with pytest.raises(MeshError, match=r"no room .* inside .*; choose street or roof, or an eye"):
        generate_path(scene_of(*shells), PathOptions("inside", up="z"))


def test_the_inside_of_solids_is_no_interior():
    """Floor, walls and roof, but nothing leads out."""
    houses = [box((9.0, 15.0, 6.0), (17.0 * i, 0.0, 0.0)) for i in range(2)]
    with pytest.raises(MeshError, match="choose street or roof"):
        generate_path(
            scene_of(*houses, flat(38.0, 27.0, (-6.0, -6.0, 0.0))), PathOptions("inside", up="z")
        )


# A flight.


@pytest.mark.parametrize("frames", [1, 2, 7, 60])
@pytest.mark.parametrize("seed", SEEDS)
def test_roof_is_above_all_that_it_passes(frames, seed):
    rng = np.random.default_rng(seed)
    towers = [
        box((9.0, 9.0, float(rng.uniform(3.0, 40.0))), (12.0 * i, 12.0 * j, 0.0))
        for i in range(8)
        for j in range(6)
    ]
    scene = scene_of(*towers)
    path = generate_path(scene, PathOptions("roof", frames=frames, up="z", seed=seed))
    assert crossed(path, triangles(scene)) == 0
    places = positions(path)
    between = np.linspace(places[:-1], places[1:], 50).reshape(-1, 3)
    dense = np.concatenate([places, between])
    for low, high in scene.bounds():
        over = ((dense >= low) & (dense <= high))[:, :2].all(axis=1)
        assert (dense[over, 2] >= high[2] + 5.0).all()
    assert (forwards(path)[:, 2] < 0.0).all()
    assert positions(path)[:, 2].max() < 40.0 + 5.2


def test_roof_stays_near_low_roofs():
    """One tower does not lift the whole flight."""
    houses = [box((8.0, 8.0, 5.0), (12.0 * i, 12.0 * j, 0.0)) for i in range(20) for j in range(20)]
    scene = scene_of(*houses, box((8.0, 8.0, 90.0), (0.0, 12.0 * 20, 0.0)))
    z = positions(generate_path(scene, PathOptions("roof", frames=120, up="z")))[:, 2]
    assert np.median(z) == pytest.approx(5.0 + 3.0 * 1.7, abs=0.1)


# What holds for all.


@pytest.mark.parametrize("kind", ["street", "roof", "inside"])
def test_the_same_seed_gives_the_same_path_another_one_another(kind):
    scene = house() if kind == "inside" else two_boxes()
    first, again, other = (
        generate_path(scene, PathOptions(kind, frames=20, up="z", seed=seed)) for seed in (0, 0, 1)
    )
    assert positions(first).tobytes() == positions(again).tobytes()
    assert forwards(first).tobytes() == forwards(again).tobytes()
    assert forwards(first).tobytes() != forwards(other).tobytes()


@pytest.mark.sweep(2)
@pytest.mark.parametrize("kind", ["street", "roof", "inside"])
@pytest.mark.parametrize("up", ["x", "y", "z"])
def test_up_turns_the_path_with_the_scene(kind, up):
    scene = house() if kind == "inside" else two_boxes()
    plain = generate_path(scene, PathOptions(kind, frames=12, up="z"))
    turned = generate_path(moved(scene, up=up), PathOptions(kind, frames=12, up=up))
    assert upright(positions(turned), up) == pytest.approx(positions(plain), abs=1e-9)
    assert upright(forwards(turned), up) == pytest.approx(forwards(plain), abs=1e-9)
    for camera in turned.cameras:
        assert camera.axes @ camera.axes.T == pytest.approx(np.eye(3), abs=1e-12)
        assert np.linalg.det(camera.axes) == pytest.approx(-1.0)


@pytest.mark.parametrize("kind", ["street", "inside"])
def test_map_coordinates_keep_the_path(kind):
    scene = house() if kind == "inside" else two_boxes()
    far = moved(scene, LYON)
    path = generate_path(far, PathOptions(kind, frames=20, up="z"))
    near = generate_path(scene, PathOptions(kind, frames=20, up="z"))
    assert crossed(path, triangles(far)) == 0
    assert np.abs(positions(path) - LYON - positions(near)).max() < 1e-6


def test_units_are_those_of_the_eye_height():
    scene = house()
    scene = Scene(scene.meshes, scene.names, scene.mesh_of.copy(), 100.0 * scene.transforms)
    scene.transforms.setflags(write=True)
    scene.transforms[:, 3, 3] = 1.0
    path = generate_path(scene, PathOptions("inside", frames=20, up="z", eye_height=170.0))
    plain = generate_path(house(), PathOptions("inside", frames=20, up="z"))
    assert positions(path) / 100.0 == pytest.approx(positions(plain), abs=1e-6)
    assert path.cameras[0].near == pytest.approx(100.0 * plain.cameras[0].near)


@pytest.mark.parametrize("kind", ["street", "roof", "inside"])
@pytest.mark.parametrize("frames", [1, 2, 3])
def test_few_frames(kind, frames):
    scene = house() if kind == "inside" else two_boxes()
    path = generate_path(scene, PathOptions(kind, frames=frames, up="z"))
    assert len(path.cameras) == frames
    assert np.isfinite(positions(path)).all()
    assert np.linalg.norm(forwards(path), axis=1) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"kind": "submarine"}, "kind: 'submarine' is not known; choose one of street, roof"),
        ({"frames": 0}, "frames: 0 is out of range"),
        ({"frames": 2.5}, "frames: 2.5 is not a whole number"),
        ({"up": "w"}, "up: 'w' is not known"),
        ({"seed": -1}, "seed: -1 is out of range"),
        ({"eye_height": 0.0}, "eye height: 0 is not a height"),
        ({"eye_height": float("nan")}, "eye height: nan is not a length"),
        ({"fov": 180.0}, "fov: 180.0 is out of range"),
        ({"fov": float("nan")}, "fov: nan is out of range"),
    ],
)
def test_options_out_of_range(change, words):
    with pytest.raises(OptionError, match=words):
        generate_path(two_boxes(), PathOptions(**{"kind": "roof", **change}))


# Larger scenes.


@pytest.mark.parametrize("kind", ["street", "roof", "inside"])
def test_castle(kind):
    scene = scene_of(castle())
    path = generate_path(scene, PathOptions(kind, frames=60))
    assert crossed(path, triangles(scene)) == 0
    if kind == "street":
        assert positions(path)[:, 1] == pytest.approx(1.7, abs=0.5)


REAL = {
    "city_lyon_buildings.glb": ("z", ("street", "roof"), 50.0),
    "sponza_dabrovic.glb": ("y", ("street", "roof", "inside"), 15.0),
    "level_dungeon.ply": ("y", ("street", "roof", "inside"), 40.0),
    "building_duplex.glb": ("z", ("street", "roof", "inside"), 8.0),
    "building_fzk_haus.glb": ("z", ("street", "roof", "inside"), 8.0),
    "terrain_jacksboro_60160.ply": ("z", ("street", "roof"), 50.0),
}


@pytest.fixture(scope="module")
def real(asset):
    """``real("sponza_dabrovic.glb")``: the scene, read once for all kinds of paths."""
    return cache(lambda name: load_scene(asset(name)))


@pytest.mark.sweep(5)
@pytest.mark.parametrize(
    ("name", "kind"), [(name, kind) for name, (_, kinds, _) in REAL.items() for kind in kinds]
)
def test_real_scenes(real, name, kind):
    up, _, spread = REAL[name]
    scene = real(name)
    path = generate_path(scene, PathOptions(kind, up=up))
    assert crossed(path, triangles(scene, without="IfcDoor")) == 0
    places = positions(path)
    assert np.ptp(places, axis=0).max() > spread
    low, high = scene.bounds()[:, 0].min(axis=0), scene.bounds()[:, 1].max(axis=0)
    assert ((places > low - 10.0) & (places < high + 10.0)).all()


def test_buildings_without_floors_have_no_interior(real):
    scene = real("city_lyon_buildings.glb")
    with pytest.raises(MeshError, match="choose street or roof"):
        generate_path(scene, PathOptions("inside", up="z"))
