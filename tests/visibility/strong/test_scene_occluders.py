"""Which convex bodies are made of the objects of a scene."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from simplifier.camera_paths.columns import UprightScene
from simplifier.errors import OptionError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.kernels.hull_rays import FLAT, VOLUME
from simplifier.visibility.strong.scene_occluders import occluders_of


def scene_of(*meshes):
    """Objects of vertices and faces."""
    made = tuple(TriangleMesh.from_soup(np.array(v, float), np.array(f)) for v, f in meshes)
    names = tuple(f"object {index}" for index in range(len(made)))
    transforms = np.tile(np.eye(4), (len(made), 1, 1))
    return Scene(made, names, np.arange(len(made), dtype=np.int32), transforms)


def shape(mesh, *, at=(0.0, 0.0, 0.0), without_base=False):
    vertices, faces = np.array(mesh.vertices) + at, np.array(mesh.faces)
    if without_base:
        faces = faces[vertices[faces][:, :, 2].max(axis=1) > vertices[:, 2].min() + 1e-9]
    return vertices, faces


def made_of(*shapes, **options):
    upright = UprightScene.of(scene_of(*shapes), "z")
    return occluders_of(upright, **options), upright


def inside(bodies, points):
    """(n,) whether each point is in a body."""
    found = np.zeros(len(points), dtype=np.bool_)
    for first, last in zip(bodies.starts, bodies.starts[1:], strict=False):
        planes = bodies.planes[first:last]
        found |= (points @ planes[:, :3].T <= planes[:, 3]).all(axis=1)
    return found


def box(size, low=(0.0, 0.0, 0.0)):
    return shape(trimesh.creation.box(extents=size), at=np.array(low) + 0.5 * np.array(size))


def ell():
    """An L of three by three by four less a corner of two by two; it stands."""
    plan = np.array([[0, 0], [3, 0], [3, 1], [1, 1], [1, 3], [0, 3]], dtype=float)
    low, high = (np.column_stack([plan, np.full(6, z)]) for z in (0.0, 4.0))
    cap = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]]
    sides = [[[i, (i + 1) % 6, 6 + (i + 1) % 6], [i, 6 + (i + 1) % 6, 6 + i]] for i in range(6)]
    faces = [
        *[c[::-1] for c in cap],
        *[[6 + k for k in c] for c in cap],
        *(face for side in sides for face in side),
    ]
    return np.concatenate([low, high]), np.array(faces)


def random_points(generator, low, high, count=4000):
    return generator.uniform(low, high, (count, 3))


@pytest.mark.parametrize(
    "mesh",
    [
        trimesh.creation.icosphere(subdivisions=2, radius=2.0),
        trimesh.creation.cylinder(radius=1.0, height=3.0, sections=16),
        trimesh.creation.cone(radius=1.0, height=2.0, sections=8),
        trimesh.convex.convex_hull(np.random.default_rng(3).normal(size=(30, 3))),
    ],
)
def test_what_is_convex_is_an_occluder_as_it_is(mesh):
    floor = box([1.0, 1.0, 1.0], [0.0, 0.0, -10.0])
    made, upright = made_of(floor, shape(mesh))
    bodies = made.occluders.bodies
    assert (len(bodies), made.kept) == (2, 1.0)
    points = random_points(np.random.default_rng(0), *mesh.bounds)
    depth = trimesh.convex.convex_hull(mesh)
    normals = depth.face_normals
    reach = (depth.triangles[:, 0] * normals).sum(axis=1)
    expected = (points @ normals.T <= reach - 1e-6).all(axis=1)
    found = inside(bodies, points - upright.origin)
    assert np.array_equal(found, expected)
    assert 0.2 < found.mean() < 0.9


def test_an_open_base_counts_where_it_stands():
    open_box = shape(trimesh.creation.box(extents=[2.0, 2.0, 2.0]), without_base=True)
    assert len(open_box[1]) == 10
    made, _ = made_of(open_box)
    assert made.occluders.bodies.kinds.tolist() == [VOLUME]
    above = shape(trimesh.creation.box(extents=[2, 2, 2]), at=(9, 0, 5.0), without_base=True)
    made, _ = made_of(open_box, above)
    assert made.occluders.bodies.kinds[1:].tolist() == [FLAT] * 10
    made, _ = made_of(open_box, above, ground=True)
    assert made.occluders.bodies.kinds.tolist() == [VOLUME] * 2


def test_the_ground_is_solid_under_what_stands_on_it():
    cone = shape(trimesh.creation.cone(radius=1.0, height=2.0, sections=8))
    high = shape(trimesh.creation.box(extents=[2.0, 2.0, 2.0]), at=(9.0, 0.0, 5.0))
    beside = np.array([[0.9, 0.0, -1e-7], [0.0, 0.0, -1e-3], [1.1, 0.0, -1e-7], [0.0, 0.0, -3.0]])
    for ground, expected in ((False, [1, 0, 0, 0]), (True, [1, 1, 0, 1])):
        made, upright = made_of(cone, high, ground=ground)
        found = inside(made.occluders.bodies, beside - upright.origin)
        assert found.astype(int).tolist() == expected
        under = np.array([[9.0, 0.0, 3.0]]) - upright.origin
        assert inside(made.occluders.bodies, under)[0] == ground


def test_boxes_are_found_in_what_is_not_convex():
    vertices, faces = ell()
    made, _ = made_of((vertices, faces))
    bodies = made.occluders.bodies
    assert 2 <= len(bodies) <= 8
    assert made.kept > 0.8
    points = random_points(np.random.default_rng(1), [-1, -1, -1e-7], [4, 4, 5])
    corner = (points[:, :2] > 1.0).all(axis=1)
    outside = ((points[:, :2] < 0) | (points[:, :2] > 3)).any(axis=1) | (points[:, 2] > 4.0)
    found = inside(bodies, points)
    assert not found[corner | outside].any()
    assert found[~(corner | outside)].mean() > 0.8


def test_boxes_are_found_in_what_floats():
    vertices, faces = ell()
    made, upright = made_of(box([1.0, 1.0, 1.0], [0.0, 0.0, -10.0]), (vertices, faces))
    assert made.kept > 0.6
    points = random_points(np.random.default_rng(1), [-1, -1, -1], [4, 4, 5])
    corner = (points[:, :2] > 1.0).all(axis=1)
    outside = ((points < 0) | (points > [3.0, 3.0, 4.0])).any(axis=1)
    found = inside(made.occluders.bodies, points - upright.origin)
    assert not found[corner | outside].any()
    assert found[~(corner | outside)].mean() > 0.6


def test_sheets_hide_by_their_triangles():
    made, _ = made_of(([[0, 0, 0], [4, 0, 0], [4, 0, 3], [0, 0, 3]], [[0, 1, 2], [0, 2, 3]]))
    assert made.occluders.bodies.kinds.tolist() == [FLAT, FLAT]
    assert made.kept == 1.0


def test_a_shell_with_a_dent_is_not_taken_for_its_hull():
    ball = trimesh.creation.icosphere(subdivisions=2, radius=2.0)
    vertices, faces = np.array(ball.vertices), np.array(ball.faces)
    vertices[0] *= 0.5
    made, upright = made_of(box([1.0, 1.0, 1.0], [0.0, 0.0, -10.0]), (vertices, faces))
    hole = vertices[:1] * 1.5 - upright.origin
    assert not inside(made.occluders.bodies, hole)[0]


def test_nothing_that_hides_is_refused():
    whole = scene_of(box([1.0, 1.0, 1.0]))
    empty = Scene((), (), np.zeros(0, dtype=np.int32), np.zeros((0, 4, 4)))
    with pytest.raises(OptionError, match="no object is convex"):
        occluders_of(UprightScene.of(whole, "z"), opaque=empty)
