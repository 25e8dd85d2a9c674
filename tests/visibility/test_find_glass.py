"""What one can see through may be seen and hides nothing, in the sets and in their check."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.visibility_city import scene_of_boxes
from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.pvs import pack_rows
from simplifier.geometry.scene import Scene
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.checking.check import CheckOptions, check_pvs
from simplifier.visibility.checking.exact_view import prisms_of, seen_from
from simplifier.visibility.checking.panorama import Panorama
from simplifier.visibility.find import find_pvs, scene_digest
from tests.solids import box, joined
from tests.visibility.scenes import street_cell

WALL, BEHIND = [(20, -300, 0), (30, 300, 30)], [(60, -5, 0), (70, 5, 10)]
SHED, HOUSE = [(90, -5, 0), (95, 5, 3)], [(35, -9, 0), (50, 9, 12)]
OPTIONS = PvsOptions(up="z", method="cull-map", epsilon=2.5)
LOOK = CheckOptions(cells=1, views=25, azimuths=90, pictures=4, pixels=128)


def layers(boxes, glass=()):
    """All boxes, by name, and those that are not of glass."""
    scene = scene_of_boxes(np.array(list(boxes.values()), dtype=np.float64), list(boxes))
    return scene, only(scene, [name for name in boxes if name not in glass])


def only(scene, names):
    kept = np.isin(scene.names, names)
    return replace(
        scene, names=tuple(names), mesh_of=scene.mesh_of[kept], transforms=scene.transforms[kept]
    )


def sets_of(scene, opaque=None, **options):
    """The sets from one cell, and its names."""
    upright = UprightScene(scene, np.arange(3, dtype=np.int32), np.zeros(3), scene.bounds())
    pvs = find_pvs(upright, street_cell(), replace(OPTIONS, **options), opaque=opaque).pvs
    return pvs, {name for name, seen in zip(pvs.names, pvs.visible(0), strict=True) if seen}


def test_a_wall_of_glass_hides_nothing_and_is_seen():
    scene, opaque = layers({"wall": WALL, "behind": BEHIND}, glass=["wall"])
    pvs, seen = sets_of(scene, opaque)
    assert seen == {"wall", "behind"}
    assert sets_of(scene)[1] == {"wall"}
    assert check_pvs(scene, pvs, LOOK, opaque=opaque).leaks == ()


@pytest.mark.parametrize("deep", [0.0, -20.0])
def test_what_glass_encloses_is_not_filled_by_viewers(deep):
    """A house of glass that no viewer enters, and one far below all that hides anything."""
    low = np.array([[0, 0, deep], [0, 0, 0]])
    boxes = {"glass": WALL + low, "wall": [(20, 400, 0), (30, 409, 30)], "behind": BEHIND}
    scene, opaque = layers(boxes, glass=["glass"])
    _, seen = sets_of(scene, opaque, fill="viewers", ground=True)
    assert seen == {"glass", "wall", "behind"}
    lone, none = layers({"glass": WALL, "behind": BEHIND}, glass=["glass", "behind"])
    assert sets_of(lone, none, fill="viewers")[1] == {"glass", "behind"}


def test_glass_behind_a_wall_is_hidden():
    scene, opaque = layers({"wall": WALL, "behind": BEHIND}, glass=["behind"])
    assert sets_of(scene, opaque)[1] == {"wall"}


def test_without_anything_opaque_all_is_seen():
    scene, opaque = layers({"wall": WALL, "behind": BEHIND, "shed": SHED}, scene_names())
    pvs, seen = sets_of(scene, opaque)
    assert seen == set(scene.names)
    found = check_pvs(scene, pvs, LOOK, opaque=opaque)
    assert (found.leaks, found.rows[0].seen) == ((), 3)


def scene_names():
    return ["wall", "behind", "shed"]


def test_the_check_looks_through_glass():
    """The sets are those of an opaque wall: too small as soon as it is of glass."""
    scene, opaque = layers({"wall": WALL, "behind": BEHIND}, glass=["wall"])
    pvs, _ = sets_of(scene)
    assert check_pvs(scene, pvs, LOOK).leaks == ()
    leaks = check_pvs(scene, pvs, LOOK, opaque=opaque).leaks
    assert {(leak.name, leak.proof) for leak in leaks} == {("behind", "line")}
    for hiding, expected in ((None, [True, False]), (opaque, [True, True])):
        shown = Panorama(scene, "z", 64, opaque=hiding).seen_from(np.array([0.0, 0.0, 1.5]))
        assert (~np.isnan(shown[:, 0])).tolist() == expected


@pytest.mark.parametrize("pictures", [0, 4])
def test_the_check_finds_glass_that_is_missing(pictures):
    scene, opaque = layers({"house": HOUSE, "pane": WALL}, glass=["pane"])
    pvs, _ = sets_of(scene, opaque)
    rows, places = pack_rows([np.array([True, False])[pvs.order]])
    options = replace(LOOK, pictures=pictures)
    leaks = check_pvs(scene, replace(pvs, rows=rows, row_of=places), options, opaque=opaque).leaks
    assert {leak.name for leak in leaks} == {"pane"}


def test_an_eye_within_glass_sees_what_is_around():
    around = [(-9, -9, 0), (9, 9, 9)]
    scene, opaque = layers({"dome": around, "house": HOUSE, "shed": SHED}, glass=["dome"])
    prisms = prisms_of(scene, "z", opaque)
    eye = np.array([0.0, 0.0, 2.0])
    found = ~np.isnan(seen_from(prisms, (eye - prisms.origin)[None])[0])
    assert found.tolist() == [True, True, False]
    assert np.isnan(seen_from(prisms_of(scene, "z"), (eye - prisms.origin)[None])).all()
    shown = ~np.isnan(Panorama(scene, "z", 64, opaque=opaque).seen_from(eye)[:, 0])
    assert shown.tolist() == [True, True, False]


def house(glazed, low=(30.0, -20.0, 0.0)):
    """A house of 10 x 40 x 12 of which some sides are panes, the opaque part of it, and a shed."""
    whole, shed = box((10.0, 40.0, 12.0), low), box((5.0, 10.0, 3.0), (60.0, -5.0, 0.0))
    part = box((10.0, 40.0, 12.0), low, without=glazed)
    return scene(whole, shed), scene(part, shed)


def scene(*meshes):
    places = np.tile(np.eye(4), (len(meshes), 1, 1))
    numbers = np.arange(len(meshes), dtype=np.int32)
    return Scene(meshes, ("house", "shed"), numbers, places)


@pytest.mark.parametrize("side", range(6))
@pytest.mark.parametrize("ground", [False, True])
def test_a_house_with_a_side_of_glass_hides_nothing(side, ground):
    whole, opaque = house((side,))
    hidden = {"shed"} - sets_of(whole, opaque, ground=ground)[1]
    floor = side in base_sides()  # nobody looks through a floor
    assert hidden == ({"shed"} if floor else set())
    assert {"shed"} - sets_of(whole, ground=ground)[1] == {"shed"}


def base_sides():
    """Which side of a box lies on the ground."""
    part = [box((1.0, 1.0, 1.0), without=[s for s in range(6) if s != side]) for side in range(6)]
    return [side for side, mesh in enumerate(part) if np.ptp(corners(mesh)[:, 2]) == 0.0
            and corners(mesh)[0, 2] == 0.0]  # fmt: skip


def corners(mesh):
    return mesh.vertices[mesh.faces].reshape(-1, 3)


def test_a_house_on_a_storey_of_glass_hides_nothing_though_it_stands_on_the_ground():
    storey, above = box((10.0, 40.0, 3.0), (30.0, -20.0, 0.0)), (30.0, -20.0, 3.0)
    upper = box((10.0, 40.0, 9.0), above, without=base_sides())
    shed = box((5.0, 10.0, 1.0), (60.0, -5.0, 0.0))
    whole, opaque = scene(joined(storey, upper), shed), scene(upper, shed)
    assert sets_of(whole, opaque, ground=True)[1] == {"house", "shed"}
    assert sets_of(whole, ground=True)[1] == {"house"}


def test_ivy_takes_nothing_from_a_wall_and_is_seen_over_it():
    """Leaves before a closed house, and a pole of glass on it that reaches over a wall."""
    closed, shed = box((10.0, 40.0, 12.0), (30.0, -20.0, 0.0)), box((5, 10, 3), (60.0, -5.0, 0.0))
    leaves = box((0.1, 30.0, 8.0), (29.5, -15.0, 0.0), without=(0, 1, 2, 3))
    assert sets_of(scene(joined(closed, leaves), shed), scene(closed, shed))[1] == {"house"}
    wall, low = (
        box((10.0, 600.0, 8.0), (10.0, -300.0, 0.0)),
        box((5.0, 9.0, 3.0), (60.0, -5.0, 0.0)),
    )
    pole = box((1.0, 1.0, 60.0), (62.0, 0.0, 0.0))
    assert sets_of(scene(wall, joined(low, pole)), scene(wall, low))[1] == {"house", "shed"}
    assert sets_of(scene(wall, low))[1] == {"house"}


def test_a_part_that_is_opaque_is_the_column_of_the_check():
    """The wing of glass reaches far aside, and does not stand before what is seen through it."""
    tower, wing = box((4.0, 4.0, 12.0), (30.0, 0.0, 0.0)), box((4.0, 90.0, 12.0), (30.0, 4.0, 0.0))
    shed = box((3.0, 3.0, 3.0), (60.0, 60.0, 0.0))
    whole, opaque = scene(joined(tower, wing), shed), scene(tower, shed)
    for up_to, expected in ((None, [True, False]), (opaque, [True, True])):
        prisms = prisms_of(whole, "z", up_to)
        eye = np.array([0.0, 0.0, 2.0]) - prisms.origin
        assert (~np.isnan(seen_from(prisms, eye[None])[0])).tolist() == expected


def test_what_is_opaque_tells_scenes_apart():
    scene_, opaque = layers({"wall": WALL, "behind": BEHIND}, glass=["wall"])
    same = replace(scene_, meshes=tuple(TriangleMesh(m.vertices, m.faces) for m in scene_.meshes))
    assert scene_digest(scene_) == scene_digest(scene_, scene_) == scene_digest(scene_, same)
    assert len({scene_digest(scene_), scene_digest(scene_, opaque), scene_digest(opaque)}) == 3


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_glass_only_adds_to_sets_and_nothing_leaks(seed):
    generator = np.random.default_rng(seed)
    size = generator.uniform(3.0, 40.0, (12, 3))
    near = generator.uniform(8.0, 80.0, (12, 2))
    low = np.where(generator.random((12, 2)) < 0.5, near, -near - size[:, :2])
    boxes = {f"{i}": [(*low[i], 0.0), (*(low[i] + size[i, :2]), size[i, 2])] for i in range(12)}
    glass = [name for name in boxes if generator.random() < 0.5]
    whole, opaque = layers(boxes, glass)
    pvs, seen = sets_of(whole, opaque, skip_buried=True)
    assert sets_of(whole, skip_buried=True)[1] <= seen
    if len(opaque):
        assert sets_of(opaque, skip_buried=True)[1] <= seen
    assert check_pvs(whole, pvs, replace(LOOK, pictures=1), opaque=opaque).leaks == ()
