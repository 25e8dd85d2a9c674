"""What a depth buffer promises about boxes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import event, given, settings
from hypothesis import strategies as st

from simplifier.culling.depth_buffer import DepthBuffer, Verdict
from simplifier.errors import MeshError, OptionError
from simplifier.geometry.camera import Camera
from tests.rasters import hits, looking_ahead, random_camera

AHEAD = Camera.looking(np.zeros(3), np.array([0, 0, 1.0]), np.array([0, 1.0, 0]), 60.0, 0.1)


def wall(depth, half=1.0, x=0.0):
    """Two triangles across the view."""
    a, b, c, d = [[x + s * half, t * half, depth] for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return np.array([[a, b, c], [a, c, d]], dtype=np.float64)


def box(low, high):
    return np.array([low, high], dtype=np.float64)


def verdicts(boxes, triangles=None, camera=AHEAD, error=0.0, size=(60, 80)):
    buffer = DepthBuffer(*size)
    if triangles is not None:
        buffer.draw(triangles, camera, error)
    return [Verdict(v) for v in buffer.test(np.array(boxes), camera)]


def test_behind_a_wall_hidden_before_it_or_past_its_edge_visible():
    boxes = [
        box((-0.3, -0.3, 6.0), (0.3, 0.3, 7.0)),
        box((-0.3, -0.3, 3.0), (0.3, 0.3, 4.0)),
        box((-0.3, -0.3, 4.0), (0.3, 0.3, 7.0)),  # sticks through
        box((0.5, -0.3, 6.0), (1.6, 0.3, 7.0)),
        box((-0.3, -0.3, 5.0), (0.3, 0.3, 7.0)),  # touches: its face may be the wall
    ]
    assert verdicts(boxes, wall(5.0)) == [
        Verdict.HIDDEN, Verdict.VISIBLE, Verdict.VISIBLE, Verdict.VISIBLE, Verdict.VISIBLE,
    ]  # fmt: skip


def test_outside_of_the_frustum():
    boxes = [
        box((-1, -1, -5), (1, 1, -4)),
        box((-1, -1, 0.01), (1, 1, 0.09)),  # before the near plane
        box((50, -1, 4), (60, 1, 5)),
        box((-60, -1, 4), (-50, 1, 5)),
        box((-1, 50, -9), (1, 60, 5)),  # above, and from behind the camera to before it
        box((-1, -60, 4), (1, -50, 5)),
    ]
    assert verdicts(boxes) == [Verdict.OUTSIDE] * 6


def test_a_box_around_the_camera_is_visible_behind_whatever():
    boxes = [box((-1, -1, -1), (1, 1, 1)), box((-1, -1, -1), (1, 1, 50))]
    assert verdicts(boxes, wall(0.2, 5.0)) == [Verdict.VISIBLE] * 2


def test_what_is_off_the_screen_needs_no_occluder():
    """The wall fills the screen; the box reaches far past it."""
    assert verdicts([box((-90, -1, 8), (90, 1, 9))], wall(5.0, 20.0)) == [Verdict.HIDDEN]


def test_nothing_drawn_hides_nothing_and_no_box_is_no_verdict():
    assert verdicts([box((-0.3, -0.3, 6.0), (0.3, 0.3, 7.0))]) == [Verdict.VISIBLE]
    buffer = DepthBuffer()
    buffer.draw(np.empty((0, 3, 3)), AHEAD)
    assert len(buffer.test(np.empty((0, 2, 3)), AHEAD)) == 0
    assert (buffer.depth_image() == 0).all()


def test_values_that_are_not_numbers_are_visible():
    boxes = [box((np.nan, 0, 6), (1, 1, 7)), box((-1, -1, np.nan), (1, 1, 7))]
    assert verdicts(boxes, wall(5.0, 20.0)) == [Verdict.VISIBLE] * 2
    assert verdicts([box((-1, -1, 6), (1, 1, np.inf))], wall(5.0, 20.0)) == [Verdict.VISIBLE]


def test_an_error_asks_for_a_margin_and_for_depth():
    tight = box((-0.9, -0.9, 5.2), (0.9, 0.9, 5.4))
    assert verdicts([tight], wall(5.0)) == [Verdict.HIDDEN]
    assert verdicts([tight], wall(5.0), error=0.01) == [Verdict.HIDDEN]
    assert verdicts([tight], wall(5.0), error=0.15) == [Verdict.VISIBLE]  # outline
    small = box((-0.1, -0.1, 5.2), (0.1, 0.1, 5.4))
    assert verdicts([small], wall(5.0), error=0.15) == [Verdict.HIDDEN]
    assert verdicts([small], wall(5.0), error=0.25) == [Verdict.VISIBLE]  # depth
    assert verdicts([small], wall(5.0), error=np.inf) == [Verdict.VISIBLE]


def test_each_triangle_may_have_its_own_error():
    walls = np.concatenate([wall(5.0, x=-1.2), wall(5.0, x=1.2)])
    errors = np.array([0.0, 0.0, 0.5, 0.5])
    boxes = [box((x - 0.7, -0.7, 6.0), (x + 0.7, 0.7, 6.1)) for x in (-1.2, 1.2)]
    assert verdicts(boxes, walls, error=errors) == [Verdict.HIDDEN, Verdict.VISIBLE]


def scene_of(rng, camera, walls=12, boxes=60):
    """Triangles about the camera, and boxes further out."""
    triangles = camera.position + rng.normal(size=(walls, 3, 3)) * 4.0
    centres = camera.position + rng.normal(size=(boxes, 1, 3)) * 8.0
    reach = rng.uniform(0.02, 1.0, (boxes, 1, 3))
    return triangles, np.concatenate([centres - reach, centres + reach], axis=1)


def judged(camera, triangles, boxes, error):
    buffer = DepthBuffer(45, 80)
    buffer.draw(triangles, camera, error)
    return buffer.test(boxes, camera)


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1))
def test_a_larger_error_hides_no_more(seed):
    rng = np.random.default_rng(seed)
    camera = random_camera(rng)
    triangles, boxes = scene_of(rng, camera)
    small = rng.uniform(0.0, 0.1, len(triangles))
    loose = judged(camera, triangles, boxes, small + rng.uniform(0.0, 0.3, len(triangles)))
    tight = judged(camera, triangles, boxes, small)
    assert not ((loose == Verdict.HIDDEN) & (tight != Verdict.HIDDEN)).any()
    assert ((loose == Verdict.OUTSIDE) == (tight == Verdict.OUTSIDE)).all()


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_the_same_far_out_in_map_coordinates(seed):
    rng = np.random.default_rng(seed)
    # On a lattice, so that the move itself rounds nothing.
    camera = random_camera(rng)
    camera = Camera(np.round(camera.position * 64) / 64, camera.axes, camera.fov, camera.near)
    triangles, boxes = (np.round(a * 64) / 64 for a in scene_of(rng, camera))
    far = np.array([1e7, -1e7, 1e7])
    there = Camera(camera.position + far, camera.axes, camera.fov, camera.near)
    assert (
        judged(camera, triangles, boxes, 0.05)
        == judged(there, triangles + far, boxes + far, 0.05)
    ).all()  # fmt: skip


def test_scenes_of_the_properties_have_hidden_boxes():
    counts = np.zeros(3, dtype=int)
    for seed in range(10):
        rng = np.random.default_rng(seed)
        camera = random_camera(rng)
        counts += np.bincount(judged(camera, *scene_of(rng, camera), 0.05), minlength=3)
    assert (counts >= 30).all()


def test_drawing_and_testing_may_take_turns():
    """A tile that a test has made fresh must be made so again after the next triangle."""
    camera = looking_ahead()
    triangles, boxes = scene_of(np.random.default_rng(2), camera, 30)
    turns, once = DepthBuffer(45, 80), DepthBuffer(45, 80)
    for triangle in triangles:
        turns.draw(triangle[None], camera)
        turns.test(boxes, camera)
    once.draw(triangles, camera)
    assert (turns.test(boxes, camera) == once.test(boxes, camera)).all()
    assert (turns.depth == once.depth).all()
    turns.clear()
    assert Verdict.HIDDEN not in turns.test(boxes, camera)


def test_a_mesh_is_drawn_as_its_triangles():
    camera = looking_ahead()
    vertices = np.random.default_rng(0).normal(size=(9, 3)) * 3.0
    faces = np.random.default_rng(1).integers(0, 9, (20, 3)).astype(np.int32)
    mesh, soup = DepthBuffer(45, 80), DepthBuffer(45, 80)
    mesh.draw_mesh(vertices, faces, camera, 0.1)
    soup.draw(vertices[faces], camera, 0.1)
    assert (mesh.depth == soup.depth).all()
    assert (mesh.tiles == soup.tiles).all()


def test_the_picture_is_brighter_where_it_is_nearer():
    buffer = DepthBuffer(60, 80)
    buffer.draw(np.concatenate([wall(9.0, 2.0), wall(3.0, 0.2)]), AHEAD)
    image = buffer.depth_image()
    assert image.shape == (60, 80)
    assert image[30, 40] > image[30, 48] > image[2, 2] == 0


def test_refuses_what_has_another_shape_or_sense():
    buffer = DepthBuffer()
    triangle = wall(5.0)
    with pytest.raises(MeshError, match="shape"):
        buffer.draw(triangle[0], AHEAD)
    with pytest.raises(MeshError, match="shape"):
        buffer.test(triangle, AHEAD)
    with pytest.raises(MeshError, match="shape"):
        buffer.draw_mesh(triangle, np.zeros((1, 3), np.int32), AHEAD)
    with pytest.raises(MeshError, match="names none"):
        buffer.draw_mesh(triangle[0], np.array([[0, 1, 3]], np.int32), AHEAD)
    for error in (-0.1, np.nan):
        with pytest.raises(OptionError, match="error"):
            buffer.draw(triangle, AHEAD, error)
    for rows, columns in ((0, 5), (5, 0), (5, 20_000)):
        with pytest.raises(OptionError, match=r"^(rows|columns): .* out of range"):
            DepthBuffer(rows, columns)


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1))
def test_inner_coverage_never_hides_a_point_that_can_be_seen(seed):
    """Points all over the boxes, each looked at along its own ray past every occluder."""
    rng = np.random.default_rng(seed)
    camera = random_camera(rng)
    vertices = camera.position + rng.normal(size=(12, 3)) * 4.0
    faces = rng.integers(0, 12, (16, 3)).astype(np.int32)
    _, boxes = scene_of(rng, camera, boxes=80)
    buffer = DepthBuffer(23, 41, "inner")
    buffer.draw_mesh(vertices, faces, camera)
    hidden = np.nonzero(buffer.test(boxes, camera) == Verdict.HIDDEN)[0]
    event("some hidden" if len(hidden) > 3 else "few hidden")
    for index in hidden:
        low, high = boxes[index]
        face = rng.integers(0, 3, 400)
        points = low + rng.uniform(size=(400, 3)) * (high - low)
        points[np.arange(400), face] = np.where(rng.uniform(size=400) < 0.5, low[face], high[face])
        assert not seen(points, vertices[faces], camera, 41 / 23).any()


def seen(points, triangles, camera, aspect):
    """(n,) whether no triangle lies before a point that is on the screen."""
    local = (points - camera.position) @ camera.axes.T
    half = np.tan(np.radians(0.5 * camera.fov)) * local[:, 2]
    result = (np.abs(local[:, 0]) < half * aspect) & (np.abs(local[:, 1]) < half)
    for triangle in triangles:
        depth, doubt = hits(triangle, camera, (points - camera.position)[None] / local[:, 2, None])
        result &= ~((depth[0] > 1.0 / local[:, 2]) | doubt[0])
    return result
