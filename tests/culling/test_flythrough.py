"""What is hidden, culled, missed and culled wrongly along a path, in scenes where it is known."""

from __future__ import annotations

from dataclasses import astuple, replace
from threading import Event

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.culling.culler import Culler
from simplifier.culling.depth_buffer import DepthBuffer, Verdict
from simplifier.culling.fate import Counts, Fate
from simplifier.culling.flythrough import fly
from simplifier.culling.item_buffer import ItemBuffer
from simplifier.errors import CancelledError, OptionError, SceneError, UnreadablePathError
from simplifier.geometry.camera import CameraPath
from simplifier.geometry.occluder import Occluder
from simplifier.hierarchy.parts import split_large
from simplifier.options.scene import CullOptions
from tests.culling.occluded import (
    HIDDEN,
    SMALL,
    WALL,
    exact,
    looking,
    path_of,
    street,
    tree_of,
    wall_with_window,
)  # fmt: skip
from tests.solids import box, sphere
from tests.walkable import moved, scene_of


def flown(scene, occluders, *cameras, options=SMALL, **more):
    return fly(scene, tree_of(scene, occluders), path_of(*cameras), options, **more)


def test_a_wall_hides_what_is_behind_it():
    found = flown(street(), {"wall": exact(WALL)})
    figures = found.frames[0].figures
    assert figures.parts == figures.objects == Counts(in_view=6, hidden=4, culled=4)
    assert (figures.occluders, figures.occluder_triangles) == (1, 12)
    assert (figures.scene_triangles, figures.triangles_in_view) == (7 * 12, 6 * 12)
    assert figures.wrong_pixels == 0 < figures.covered_pixels
    assert figures.milliseconds > 0.0
    names = [found.scene.names[index] for index in found.parts.object_of]
    fates = dict(zip(names, found.shots[0].fates.tolist(), strict=True))
    assert fates == {
        "wall": Fate.SEEN, "beside": Fate.SEEN, "at the back": Fate.ABSENT,
        **dict.fromkeys(HIDDEN, Fate.CULLED),
    }  # fmt: skip


def test_without_occluders_all_is_missed():
    figures = flown(street(), {}).total
    assert figures.parts == Counts(in_view=6, hidden=4, culled=0)
    assert (figures.parts.recall, figures.occluders, figures.occluder_triangles) == (0.0, 0, 0)
    assert figures.triangle_share == 0.0


def test_through_a_window_something_is_seen():
    wall = wall_with_window()
    figures = flown(street(wall), {"wall": exact(wall)}).total
    assert figures.parts.hidden < 4  # the box in the middle shows
    assert figures.parts.wrong == figures.wrong_pixels == 0
    assert figures.parts.culled == figures.parts.hidden > 0


def test_an_occluder_that_closes_the_window_culls_wrongly():
    found = flown(street(wall_with_window()), {"wall": exact(WALL)})
    figures = found.total
    truth = ItemBuffer(4 * SMALL.rows, 4 * SMALL.columns)
    truth.draw(found.scene, looking())
    seen = [found.scene.names.index(name) for name in HIDDEN if truth.visible[_index(found, name)]]
    assert figures.parts.wrong == figures.objects.wrong == len(seen) > 0
    assert figures.wrong_pixels == truth.visible[seen].sum() > 0
    assert figures.covered_pixels == truth.visible.sum()
    assert figures.wrong_share == figures.wrong_pixels / figures.covered_pixels
    assert figures.parts.recall == 1.0  # of what is truly hidden


def _index(found, name):
    return found.scene.names.index(name)


def test_sums_are_those_of_a_plain_recount():
    rng = np.random.default_rng(4)
    boxes = [box(rng.uniform(0.5, 4.0, 3), rng.uniform(-9.0, 6.0, 3)) for _ in range(30)]
    ball = sphere(3.0, rings=12)  # is cut into parts
    scene = scene_of(ball, *boxes)
    swollen = Occluder(1.04 * boxes[2].vertices, boxes[2].faces, 0.0)  # hides too much
    occluders = {f"object {i}": exact(boxes[i - 1]) for i in range(1, 20)}
    occluders["object 3"] = swollen
    cameras = [looking((15 * np.cos(a), 15 * np.sin(a), 2.0), (-np.cos(a), -np.sin(a), -0.1))
               for a in (0.3, 2.0, 4.4)]  # fmt: skip
    tree = tree_of(scene, occluders)
    assert len(tree.object_of) > len(scene)
    found = fly(scene, tree, path_of(*cameras), SMALL)
    for frame, camera in zip(found.frames, cameras, strict=True):
        assert _shown(frame.figures) == _recount(scene, tree, camera)
    assert found.total.parts.culled > 0
    each = [_flat(frame.figures) for frame in found.frames]
    assert _flat(found.total) == pytest.approx([sum(column) for column in zip(*each, strict=True)])


def _flat(figures):
    drawn = [number for one in figures.drawn.values() for number in astuple(one)]
    numbers = [value for value in vars(figures).values() if isinstance(value, int | float)]
    return [*astuple(figures.objects), *astuple(figures.parts), *numbers, *drawn]


def _shown(figures):
    return figures.parts, figures.objects, figures.covered_pixels, figures.wrong_pixels


def _recount(scene, tree, camera):
    """By loops over pixels and parts, each part drawn alone."""
    parts = split_large(scene)
    verdicts = Culler(tree, DepthBuffer(SMALL.rows, SMALL.columns), 0.5).cull(camera).verdicts
    picture = ItemBuffer(4 * SMALL.rows, 4 * SMALL.columns)
    picture.draw(parts.scene, camera)
    seen = [0] * len(verdicts)
    for item in picture.items.ravel().tolist():
        if item >= 0:
            seen[item] += 1
    covers = []
    for part in range(len(verdicts)):
        picture.clear()
        picture.draw(parts.scene, camera, [part])
        covers.append((picture.items >= 0).any())
    of_parts = [({part}, part) for part in range(len(verdicts))]
    of_objects = [(set(np.nonzero(parts.object_of == i)[0].tolist()), i) for i in range(len(scene))]
    wrong = sum(n for n, verdict in zip(seen, verdicts, strict=True) if verdict == Verdict.HIDDEN)
    counts = [_plain_counts(some, verdicts, seen, covers) for some in (of_parts, of_objects)]
    return *counts, sum(seen), wrong


def _plain_counts(things, verdicts, seen, covers):
    in_view = hidden = culled = wrong = lost = 0
    for own, _ in things:
        said = {verdicts[part] for part in own}
        is_culled = Verdict.VISIBLE not in said and Verdict.HIDDEN in said
        is_seen, is_in_view = any(seen[p] for p in own), any(covers[p] for p in own)
        in_view += is_in_view
        hidden += is_in_view and not is_seen
        culled += is_in_view and not is_seen and is_culled
        wrong += is_seen and is_culled
        lost += is_seen and said == {Verdict.OUTSIDE}
    return Counts(in_view, hidden, culled, wrong, lost)


@settings(max_examples=12)
@given(st.integers(0, 2**32 - 1))
def test_occluders_that_keep_inside_cull_nothing_wrongly(seed):
    """A buffer of inner coverage is taken for them, which answers for whole pixels."""
    rng = np.random.default_rng(seed)
    boxes = [box(rng.uniform(0.5, 5.0, 3), rng.uniform(-9.0, 9.0, 3)) for _ in range(25)]
    scene = scene_of(*boxes)
    inside = {f"object {i}": exact(boxes[i]) for i in range(0, 25, 2)}
    tree = tree_of(scene, inside, conservative=True)
    angles = rng.uniform(0.0, 6.0, 3)
    cameras = [looking((22 * np.cos(a), 22 * np.sin(a), 3.0), (-np.cos(a), -np.sin(a), -0.1))
               for a in angles]  # fmt: skip
    total = fly(scene, tree, path_of(*cameras), SMALL).total
    assert total.parts.wrong == total.parts.lost == total.wrong_pixels == 0


def test_worst_frames():
    """The first sees nothing hidden, the second misses all, the third culls wrongly."""
    scene = street(wall_with_window())
    away, aside = looking(forward=(0.0, -1.0, 0.0)), looking((0.0, -1.0, 3.0))
    found = flown(scene, {"wall": exact(WALL)}, away, looking(), aside)
    assert found.frames[0].figures.parts.hidden == 0
    shares = [frame.figures.wrong_share for frame in found.frames]
    assert found.worst_picture.index == int(np.argmax(shares)) > 0
    recalls = {f.index: f.figures.parts.recall for f in found.frames if f.figures.parts.hidden}
    assert found.worst_recall.index == min(recalls, key=recalls.get)
    alone = flown(scene, {}, away)
    assert alone.worst_recall is None
    assert alone.total.parts.recall is None


def test_the_pixel_error_is_that_of_the_build_unless_given():
    scene, rough = street(), Occluder(WALL.vertices, WALL.faces, 0.05)
    tree = tree_of(scene, {"wall": rough}, pixel_error=4.0)
    found = fly(scene, tree, path_of(), SMALL)
    assert (found.pixel_error, found.total.occluders) == (4.0, 1)
    strict = fly(scene, tree, path_of(), replace(SMALL, pixel_error=1e-3))
    assert (strict.pixel_error, strict.total.occluders, strict.total.parts.culled) == (1e-3, 0, 0)


def test_pictures_of_frames_spread_over_the_path():
    cameras = [looking((x, -10.0, 3.0)) for x in np.linspace(-2.0, 2.0, 7)]
    found = flown(street(), {"wall": exact(WALL)}, *cameras, options=replace(SMALL, shots=3))
    assert [shot.index for shot in found.shots] == [0, 3, 6]
    assert flown(street(), {}, *cameras, options=replace(SMALL, shots=0)).shots == ()
    assert len(flown(street(), {}, *cameras).shots) == 7


def test_cancelled_it_keeps_the_frames_so_far():
    cancel, told = Event(), []

    def tell(done, name):
        told.append((done, name))
        if done == 1:
            cancel.set()

    cameras = [looking()] * 4
    found = flown(street(), {"wall": exact(WALL)}, *cameras, tell=tell, cancel=cancel)
    assert told == [(0, "frame 0"), (1, "frame 1")]
    assert (len(found.frames), found.complete) == (2, False)
    with pytest.raises(CancelledError, match="before the first frame"):
        flown(street(), {}, cancel=cancel)


def test_occluders_of_another_scene():
    scene = street()
    tree = tree_of(scene, {"wall": exact(WALL)})
    for other, words in (
        (
            scene_of(*scene.meshes, names=["gate", *scene.names[1:]]),
            "object 0 is 'gate' here and 'wa",
        ),
        (scene_of(*scene.meshes[:-1], names=scene.names[:-1]), "object 6 is missing here"),
        (scene_of(*scene.meshes, WALL, names=[*scene.names, "more"]), "'more' here and missing"),
        (moved(scene, (0.01, 0.0, 0.0)), "' is off by 0.01"),
        (scene_of(*scene.meshes[:-1], sphere(3.0), names=scene.names), "parts here and 7 there"),
    ):
        with pytest.raises(SceneError, match="build them again with 'occluder scene'") as caught:
            fly(other, tree, path_of(), SMALL)
        assert words in str(caught.value)
    assert fly(moved(scene, (1e-7, 0.0, 0.0)), tree, path_of(), SMALL).total.parts.culled == 4


def test_a_path_without_frames():
    scene = street()
    with pytest.raises(UnreadablePathError, match="path 'none': it has no frames"):
        fly(scene, tree_of(scene, {}), CameraPath("none", ()), SMALL)


@pytest.mark.parametrize(
    ("name", "value"),
    [("image", (320, 0)), ("image", (320, 5000)),
     ("image", (0, 180)), ("detail", 0), ("detail", 17), ("repeats", 0),
     ("shots", -1), ("pixel_error", 0.0), ("pixel_error", float("nan")), ("pixel_error", 1e4)],
)  # fmt: skip
def test_options_out_of_range(name, value):
    words = "rows|columns" if name == "image" else name.replace("_", " ")
    with pytest.raises(OptionError, match=f"^({words}): "):
        CullOptions(**{name: value})
