"""Which voxels a triangle soup touches, against exact arithmetic and under metamorphic changes."""

from __future__ import annotations

from fractions import Fraction
from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from simplifier.errors import MeshError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.kernels.voxelize import mark_triangles
from simplifier.voxel.voxelize import voxelize, voxelize_finely

SIZE = 4
TOLERANCE = Fraction(1, 10**8)  # the kernel promises 1e-9 and rounding


def meets_box(triangle, low, high) -> bool:
    """Closed triangle against closed box, by clipping the polygon in exact arithmetic."""
    polygon = [tuple(Fraction(float(x)) for x in corner) for corner in triangle]
    for axis in range(3):
        for sign, limit in ((1, low[axis]), (-1, high[axis])):
            polygon = clip(polygon, axis, sign, limit)
    return bool(polygon)


def clip(polygon, axis, sign, limit):
    """The part of a convex polygon where ``sign * (p[axis] - limit) >= 0``."""
    kept = []
    for a, b in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        height_a, height_b = sign * (a[axis] - limit), sign * (b[axis] - limit)
        if height_a >= 0:
            kept.append(a)
        if height_a * height_b < 0:
            t = height_a / (height_a - height_b)
            kept.append(tuple(p + t * (q - p) for p, q in zip(a, b, strict=True)))
    return kept


def exactly_touched(triangle, shape, slack=Fraction(0)):
    touched = np.zeros(shape, dtype=np.bool_)
    for cell in np.ndindex(shape):
        touched[cell] = meets_box(
            triangle, [i - slack for i in cell], [i + 1 + slack for i in cell]
        )
    return touched


def marked(triangle, shape):
    touched = np.zeros(shape, dtype=np.bool_)
    faces = np.array([[0, 1, 2]], dtype=np.int32)
    points = np.array(triangle, dtype=np.float64)
    mark_triangles(points, faces, np.zeros(3), 1.0, 0, 1, touched)
    return touched


def check_against_exact(triangle, shape=(SIZE, SIZE, SIZE)):
    """Nothing that is touched is missed; nothing is marked that is further off than rounding."""
    got = marked(triangle, shape)
    must = exactly_touched(triangle, shape)
    assert not (must & ~got).any(), f"missed {np.argwhere(must & ~got).tolist()}"
    if (got & ~must).any():
        may = exactly_touched(triangle, shape, TOLERANCE)
        assert not (got & ~may).any(), f"too many {np.argwhere(got & ~may).tolist()}"


inside = st.floats(0.0, SIZE, allow_subnormal=False)
on_lattice = st.integers(0, SIZE).map(float)
half_lattice = st.integers(0, 2 * SIZE).map(lambda i: i / 2)


def triangles(coordinate):
    return st.tuples(*[st.tuples(coordinate, coordinate, coordinate)] * 3)


@settings(max_examples=150, deadline=None)
@given(triangles(inside))
@example(((1, 0, 1), (0, 0, 0), (0, 0, 1e-35)))  # its area vanishes by rounding, an edge does not
@example(((1, 1, 1), (0, 0, 0), (0, 1e-12, 0)))
def test_any_triangle(triangle):
    check_against_exact(triangle)


@settings(max_examples=150, deadline=None)
@given(triangles(on_lattice | half_lattice))
@example(((1, 1, 1), (3, 1, 1), (1, 3, 1)))  # lies in voxel faces
@example(((0, 0, 0), (4, 4, 0), (4, 4, 4)))  # runs along voxel edges and through corners
@example(((0, 0, 0), (4, 0, 0), (0, 4, 0)))  # lies in the grid's border
@example(((4, 0, 4), (4, 4, 4), (4, 4, 0)))  # lies in the grid's far border
@example(((2, 2, 2), (2, 2, 2), (2, 2, 2)))  # a point, in eight voxels
@example(((1, 1, 1), (3, 3, 3), (2, 2, 2)))  # a segment
def test_triangles_that_lie_in_faces_edges_and_corners(triangle):
    check_against_exact(triangle)


@settings(max_examples=100, deadline=None)
@given(triangles(inside), st.sampled_from([1e-3, 1e-8, 1e-13, 1e-15, 1e-16]), st.floats(0.0, 1.0))
def test_needles(triangle, width, at):
    a, b, off = np.array(triangle)
    needle = (a, b, np.clip(a + at * (b - a) + width * (off - a), 0.0, SIZE))
    check_against_exact(needle)


@settings(max_examples=100, deadline=None)
@given(triangles(inside), st.sampled_from([1e-1, 1e-4, 1e-10, 1e-15]))
def test_tiny_triangles(triangle, scale):
    corners = np.array(triangle)
    check_against_exact(np.clip(corners[0] + scale * (corners - corners[0]), 0.0, SIZE))


@settings(max_examples=40, deadline=None)
@given(triangles(st.floats(0.0, 1.0)), st.tuples(*[st.integers(1, 7)] * 3))
def test_grids_of_any_shape(triangle, shape):
    check_against_exact(np.array(triangle) * shape, shape)


def test_needle_whose_normal_is_lost_to_rounding():
    """The cross product of its edges is noise; a plane of that normal misses the far end."""
    a = np.array([0.1, 0.2, 0.3])
    b = np.array([3.9, 3.7, 3.8])
    for steps in (1, 2, 3):
        off = a + (b - a) / 3
        for _ in range(steps):
            off = np.nextafter(off, [4.0, 0.0, 4.0])
        check_against_exact((a, b, off))


def test_needle_across_a_large_grid_is_not_missed():
    """Coordinates near 500 leave the fewest digits for the plane's slope."""
    rng = np.random.default_rng(5)
    shape = (500, 500, 500)
    touched = np.zeros(shape, dtype=np.bool_)
    for _ in range(8):
        a, b = rng.uniform(0, 500, (2, 3))
        c = np.clip(a + (b - a) * rng.uniform() + rng.normal(size=3) * 1e-13, 0, 500)
        mark_triangles(
            np.array([a, b, c]), np.array([[0, 1, 2]], dtype=np.int32),
            np.zeros(3), 1.0, 0, 1, touched,
        )  # fmt: skip
        i, j, k = (a + np.linspace(0, 1, 4001)[:, None] * (b - a)).astype(np.int64).T
        assert touched[i, j, k].all()
    # A segment crosses at most 500 voxel faces an axis; no slab of noise around it is marked.
    assert touched.sum() < 8 * 3 * 500


def cube_mesh(low=0.0, high=1.0):
    corners = np.array(list(product((low, high), repeat=3)))
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return TriangleMesh.from_soup(corners, faces)


def random_mesh(seed, count=40, extent=(3.0, 2.0, 1.0)):
    rng = np.random.default_rng(seed)
    points = rng.uniform(0, 1, (3 * count, 3)) * extent
    return TriangleMesh.from_soup(points, np.arange(3 * count).reshape(-1, 3))


@pytest.mark.parametrize("resolution", [1, 2, 3, 8])
def test_cube_is_a_shell(resolution):
    """The cube's faces lie in the grid's border: all voxels there, none within."""
    grid = voxelize(cube_mesh(-2.0, 5.0), resolution)
    expected = np.ones((resolution,) * 3, dtype=np.bool_)
    if resolution > 2:
        expected[1:-1, 1:-1, 1:-1] = False
    assert np.array_equal(grid.inside, expected)
    assert grid.cell_size == pytest.approx(7.0 / resolution)
    np.testing.assert_allclose(grid.origin, [-2.0] * 3, atol=1e-12)


@pytest.mark.parametrize("resolution", [1, 2, 3, 17, 64])
@pytest.mark.parametrize("seed", [0, 1])
def test_grid_holds_the_mesh_and_is_no_larger_than_needed(resolution, seed):
    mesh = random_mesh(seed)
    grid = voxelize(mesh, resolution)
    spans = np.array(grid.shape) * grid.cell_size
    low, high = mesh.bounds
    assert max(grid.shape) == resolution
    assert (grid.origin <= low + 1e-9).all()
    assert (grid.origin + spans >= high - 1e-9).all()
    assert (spans - mesh.extent < grid.cell_size).all()
    np.testing.assert_allclose(grid.origin + spans / 2, (low + high) / 2, atol=1e-12)
    assert not grid.inside.flags.writeable


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_flat_mesh_gives_a_flat_grid_and_lies_in_its_middle(axis):
    points = np.insert(
        np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]]), axis, 7.0, axis=1
    )
    grid = voxelize(TriangleMesh.from_soup(points, [[0, 1, 2], [0, 2, 3]]), 16)
    assert grid.shape == tuple(np.insert([16, 8], axis, 1))
    assert grid.inside.all()
    assert grid.to_grid(points)[:, axis] == pytest.approx(0.5)


def test_thin_sheet_pair_marks_both_layers():
    """Two sheets a hundredth of a voxel apart astride a voxel face: a layer on each side."""
    sheet = np.array([[0.0, 0, 0], [8, 0, 0], [8, 8, 0], [0, 8, 0]])
    points = np.concatenate([sheet + np.array([0.0, 0.0, z]) for z in (0.0, 3.995, 4.005, 8.0)])
    faces = np.concatenate([np.array([[0, 1, 2], [0, 2, 3]]) + 4 * i for i in range(4)])
    grid = voxelize(TriangleMesh.from_soup(points, faces), 8)
    assert np.array_equal(grid.inside.all(axis=(0, 1)), grid.inside.any(axis=(0, 1)))
    assert np.nonzero(grid.inside[0, 0])[0].tolist() == [0, 3, 4, 7]


def test_sheet_exactly_in_a_voxel_face_marks_both_sides_whatever_the_rounding():
    """Named for the rounding of the map to grid space: thirds and an offset are not exact."""
    for scale, offset in product((1.0, 1.0 / 3.0, 1e-7, 1e7), (0.0, 0.1, -1e3)):
        cube = cube_mesh(0.0, 6.0)
        sheet = np.array([[0.0, 0, 2], [6, 0, 2], [6, 6, 2]])
        points = np.concatenate([cube.vertices, sheet])
        faces = np.concatenate([cube.faces, [[8, 9, 10]]])
        shift = offset * scale
        grid = voxelize(TriangleMesh.from_soup(points * scale + shift, faces), 6)
        assert grid.inside[3, 1, 1:3].all(), (scale, offset)


@pytest.mark.parametrize("seed", range(4))
def test_marks_follow_translation_scale_and_axis_order(seed):
    mesh = random_mesh(seed)
    expected = voxelize(mesh, 24).inside
    # Powers of two and whole numbers: no rounding, so the answer must be the very same.
    moved = TriangleMesh.from_soup(mesh.vertices * 4.0, mesh.faces)
    assert np.array_equal(voxelize(moved, 24).inside, expected)
    shifted = voxelize(TriangleMesh.from_soup(mesh.vertices + 1.0e3, mesh.faces), 24).inside
    assert np.count_nonzero(shifted != expected) <= 2  # rounding of the input itself
    for order in permutations(range(3)):
        turned = TriangleMesh.from_soup(mesh.vertices[:, order], mesh.faces)
        assert np.array_equal(voxelize(turned, 24).inside, expected.transpose(order))


@pytest.mark.parametrize("seed", range(3))
def test_order_winding_duplication_and_threads_do_not_matter(seed, monkeypatch):
    mesh = random_mesh(seed, count=6000)
    monkeypatch.setenv("OCCLUDER_THREADS", "1")
    expected = voxelize(mesh, 32).inside
    assert expected.any()
    rng = np.random.default_rng(seed)
    for faces in (
        rng.permutation(mesh.faces),
        mesh.faces[:, ::-1],
        np.roll(mesh.faces, 1, axis=1),
        np.concatenate([mesh.faces, mesh.faces]),
    ):
        other = TriangleMesh.from_soup(mesh.vertices, faces)
        assert np.array_equal(voxelize(other, 32).inside, expected)
    for threads in ("2", "5"):
        monkeypatch.setenv("OCCLUDER_THREADS", threads)
        assert np.array_equal(voxelize(mesh, 32).inside, expected)


def test_soup_is_the_union_of_its_triangles():
    mesh = random_mesh(9, count=12, extent=(5.0, 5.0, 5.0))
    grid = voxelize(mesh, 5)
    points = grid.to_grid(mesh.vertices)
    expected = np.zeros(grid.shape, dtype=np.bool_)
    for face in mesh.faces:
        expected |= marked(points[face], grid.shape)
    assert np.array_equal(grid.inside, expected)


def test_mesh_too_small_for_its_numbers_is_refused():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]) * 1e-320
    with pytest.raises(MeshError, match="scale it up"):
        voxelize(TriangleMesh.from_soup(points, [[0, 1, 2]]), 64)


def test_real_mesh_every_surface_point_lies_in_a_marked_voxel(asset):
    trimesh = pytest.importorskip("trimesh")
    source = trimesh.load(asset("bunny_4968.ply"), process=False, force="mesh")
    mesh = TriangleMesh.from_soup(source.vertices, source.faces)
    grid = voxelize(mesh, 64)
    rng = np.random.default_rng(0)
    weights = rng.dirichlet(np.ones(3), (len(mesh.faces), 20))
    points = grid.to_grid((weights[..., None] * mesh.vertices[mesh.faces][:, None]).sum(axis=2))
    i, j, k = np.clip(points.reshape(-1, 3).astype(np.int64), 0, np.array(grid.shape) - 1).T
    assert grid.inside[i, j, k].all()
    assert 0.02 < grid.inside.mean() < 0.2


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 60), st.integers(1, 9), st.integers(1, 8))
def test_cells_are_those_of_which_a_voxel_is_touched(seed, count, resolution, size):
    """Marked once in fine voxels, a mesh touches the cells that it touches when marked in these."""
    mesh = random_mesh(seed, count)
    expected = voxelize(mesh, resolution)
    cells, voxels = voxelize_finely(mesh, resolution, size)
    assert np.array_equal(cells.inside, expected.inside)
    assert cells.cell_size == expected.cell_size
    assert np.array_equal(cells.origin, expected.origin)
    assert np.array_equal(voxels.origin, expected.origin)
    assert voxels.cell_size == pytest.approx(expected.cell_size / size)
    nx, ny, nz = cells.shape
    blocks = voxels.inside.reshape(nx, size, ny, size, nz, size)
    assert np.array_equal(blocks.any(axis=(1, 3, 5)), cells.inside)
