"""Deviation: against brute force over dense samples, and shapes whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from simplifier.accuracy.deviation import SLACK, _Original, deviation
from simplifier.errors import MeshError
from simplifier.geometry.bit_grid import BitGrid
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.solid import VoxelGrid
from tests.solids import interior_of

CELL = 0.5
ORIGIN = np.array([10.0, -20.0, 30.0])


def solid_box(side=8, wall=1):
    """A cube of ``side`` voxels at the grid's corner: mesh, touched shell, filled."""
    low, high = ORIGIN, ORIGIN + side * CELL
    shape = trimesh.creation.box(bounds=[low, high])
    mesh = TriangleMesh.from_soup(shape.vertices, shape.faces)
    filled = np.ones((side, side, side), bool)
    touched = filled.copy()
    touched[wall:-wall, wall:-wall, wall:-wall] = False
    return mesh, VoxelGrid(touched, ORIGIN, CELL), VoxelGrid(filled, ORIGIN, CELL)


def occluder_of(grid_points):
    """Triangles from consecutive grid-space points."""
    points = np.asarray(grid_points, np.float64) * CELL + ORIGIN
    return Occluder(points, np.arange(len(points), dtype=np.int32).reshape(-1, 3))


def test_inside_costs_nothing():
    mesh, touched, filled = solid_box()
    assert (
        deviation(
            occluder_of([[1, 1, 1], [7, 7, 7], [1, 7, 2]]), mesh, interior_of(touched, filled)
        )
        == 0.0
    )


def test_on_the_surface_costs_nothing():
    mesh, touched, filled = solid_box()
    same = Occluder(mesh.vertices, mesh.faces)
    assert deviation(same, mesh, interior_of(touched, filled)) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("corner", "expected"),
    [
        ([11, 4, 4], 3.0),  # out of a face, beyond the grid
        ([-4, -3, 4], 5.0),  # beside an edge
        ([10, 9, 10], 3.0),  # beside a corner
        ([0.5, 4, 4], 0.5),  # in the wall: half a voxel from both the face and the interior
        ([0.7, 4, 4], 0.3),  # in the wall, the interior is nearer
        ([0.2, 4, 4], 0.2),  # in the wall, the surface is nearer
    ],
)
def test_point_near_a_cube(corner, expected):
    mesh, touched, filled = solid_box()
    found = deviation(occluder_of([corner] * 3), mesh, interior_of(touched, filled)) / CELL
    assert found == pytest.approx(expected, abs=1e-12)


def test_plate_that_sticks_out_of_a_cube():
    mesh, touched, filled = solid_box()
    plate = [[4, 4, 4], [11, 4, 4], [11, 6, 4], [4, 4, 4], [11, 6, 4], [4, 6, 4]]
    assert deviation(occluder_of(plate), mesh, interior_of(touched, filled)) == pytest.approx(
        3 * CELL
    )


def test_without_interior_only_the_surface_counts():
    mesh, touched, _ = solid_box()
    everything = touched.with_inside(np.ones(touched.shape, bool))
    found = deviation(occluder_of([[4, 4, 4]] * 3), mesh, interior_of(everything, everything))
    assert found == pytest.approx(4 * CELL, abs=1e-12)


def test_the_middle_of_a_triangle_counts():
    # All three corners touch the surface; the centre is far from it.
    mesh, touched, _ = solid_box(16)
    hollow = touched.with_inside(np.zeros(touched.shape, bool))
    occluder = occluder_of([[0, 0, 8], [16, 0, 8], [8, 16, 8]])
    found = deviation(occluder, mesh, interior_of(touched, hollow)) / CELL
    x, y = np.meshgrid(np.linspace(0, 16, 801), np.linspace(0, 16, 801))
    inside = y <= np.minimum(2 * x, 2 * (16 - x))
    true = np.minimum.reduce([x, 16 - x, y, 16 - y])[inside].max()
    assert true - SLACK <= found <= true + 1e-9


def squared_to_triangles(points, corners):
    """(n,) least squared distance from (n, 3) points to (m, 3, 3) triangles, by least squares."""
    best = np.full(len(points), np.inf)
    for a, b, c in corners:
        basis = np.stack([b - a, c - a], axis=1)
        weights = np.linalg.lstsq(basis, (points - a).T, rcond=None)[0].T
        inside = (weights >= 0).all(axis=1) & (weights.sum(axis=1) <= 1)
        foot = a + weights @ basis.T
        best = np.where(inside, np.minimum(best, ((points - foot) ** 2).sum(axis=1)), best)
        for p, q in ((a, b), (b, c), (c, a)):
            t = np.clip((points - p) @ (q - p) / ((q - p) @ (q - p)), 0.0, 1.0)
            foot = p + t[:, None] * (q - p)
            best = np.minimum(best, ((points - foot) ** 2).sum(axis=1))
    return best


def squared_to_voxels(points, inside):
    best = np.full(len(points), np.inf)
    for voxel in np.argwhere(inside):
        gap = np.maximum(np.maximum(voxel - points, points - voxel - 1), 0.0)
        best = np.minimum(best, (gap**2).sum(axis=1))
    return best


def lattice(corners, steps):
    """Points of a triangle, corners and edges included."""
    i, j = np.nonzero(np.add.outer(np.arange(steps + 1), np.arange(steps + 1)) <= steps)
    weights = np.stack([i, j, steps - i - j], axis=1) / steps
    return weights @ corners


def random_case(seed):
    """A soup with slivers and large triangles, an arbitrary interior, occluders in and out."""
    generator = np.random.default_rng(seed)
    corners = generator.uniform(0, 8, (15, 1, 3)) + generator.normal(0, 1.5, (15, 3, 3))
    corners[:3, 2] = corners[:3, 1] + 1e-7 * (corners[:3, 1] - corners[:3, 0])[:, ::-1]
    interior = generator.random((8, 8, 8)) < 0.01
    points = corners.reshape(-1, 3) * CELL + ORIGIN
    mesh = TriangleMesh.from_soup(points, np.arange(45).reshape(-1, 3))
    touched = VoxelGrid(np.zeros((8, 8, 8), bool), ORIGIN, CELL)
    occluder = generator.uniform(-3, 11, (2, 3, 3))
    return corners, interior, mesh, touched, occluder


@pytest.mark.sweep(2)
@pytest.mark.parametrize("seed", range(12))
def test_against_brute_force_over_dense_samples(seed):
    corners, interior, mesh, touched, triangles = random_case(seed)
    samples = np.concatenate([lattice(one, 60) for one in triangles])
    squares = squared_to_triangles(samples, corners)
    squares = np.minimum(squares, squared_to_voxels(samples, interior))
    sampled = np.sqrt(squares.max())
    filled = touched.with_inside(interior)
    found = (
        deviation(occluder_of(triangles.reshape(-1, 3)), mesh, interior_of(touched, filled)) / CELL
    )
    # The lattice itself misses the true maximum by at most its covering radius.
    spacing = max(np.linalg.norm(t - np.roll(t, 1, axis=0), axis=1).max() for t in triangles) / 60
    assert sampled - SLACK - 1e-9 <= found <= sampled + spacing / np.sqrt(3) + 1e-9


@pytest.mark.parametrize("largest", [0.0, 0.4, 3.0])
@pytest.mark.parametrize("seed", range(4))
def test_no_point_of_a_piece_is_further_than_it_says_or_than_the_largest(seed, largest):
    corners, interior, mesh, touched, _ = random_case(seed)
    filled = touched.with_inside(interior)
    # Pieces beside the triangles of the mesh, and some of their own place.
    generator = np.random.default_rng(seed + 100)
    pieces = corners + generator.normal(0.0, 0.3, corners.shape)
    pieces = np.concatenate([pieces, corners, generator.uniform(0, 8, (9, 3, 3))])
    original = _Original.of(
        touched.to_grid(mesh.vertices), mesh.faces, interior_of(touched, filled).bits
    )
    distances, reaches = original.piece_bounds(pieces, largest, SLACK)
    for piece, distance, reach in zip(pieces, distances, reaches, strict=True):
        samples = lattice(piece, 24)
        squares = squared_to_triangles(samples, corners)
        furthest = np.sqrt(np.minimum(squares, squared_to_voxels(samples, interior)).max())
        assert furthest <= max(distance + reach, largest) + 1e-6


def test_a_mesh_that_is_its_own_occluder_is_not_cut_up(monkeypatch):
    """A cube of twelve triangles once took half a million pieces."""
    monkeypatch.setattr("simplifier.accuracy.deviation.halve_pieces", None)
    mesh, touched, filled = solid_box()
    assert deviation(Occluder(mesh.vertices, mesh.faces), mesh, interior_of(touched, filled)) == 0.0


@pytest.mark.parametrize("seed", range(12))
def test_corners_are_exact(seed):
    # Occluders shrunk to points: no slack is left.
    corners, interior, mesh, touched, triangles = random_case(seed)
    filled = touched.with_inside(interior)
    for point in triangles.reshape(-1, 3):
        squares = squared_to_triangles(point[None], corners)
        expected = np.sqrt(min(squares[0], squared_to_voxels(point[None], interior)[0]))
        found = deviation(occluder_of([point] * 3), mesh, interior_of(touched, filled)) / CELL
        assert found == pytest.approx(expected, abs=1e-9)


def along_edges(points, corners):
    """(n,) from points (n, 3) to the edges of one triangle, to more digits than a float64 has."""
    points, corners = points.astype(np.longdouble), corners.astype(np.longdouble)
    nearest = np.full(len(points), np.inf, dtype=np.longdouble)
    for begin, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along = end - begin
        square = along @ along
        shares = np.clip((points - begin) @ along / square, 0.0, 1.0) if square > 0 else 0.0
        away = points - begin - np.multiply.outer(shares, along)
        nearest = np.minimum(nearest, np.sqrt((away**2).sum(axis=1)))
    return nearest.astype(np.float64)


@pytest.mark.parametrize("thin", [0.0, 1e-17, 1e-15, 1e-13, 1e-11, 1e-9])
def test_a_needle_is_as_far_away_as_its_edges(thin):
    """Its normal is rounding alone: two triangles, of which one was a needle and which were their
    own occluder, were 8.5 voxels away from themselves."""
    rng = np.random.default_rng(7)
    for _ in range(300):
        begin, end, off = rng.normal(size=(3, 3)) * 20.0
        corners = np.array([begin, end, begin + rng.uniform() * (end - begin) + thin * off])
        near = rng.dirichlet(np.ones(3), 20) @ corners + rng.normal(size=(20, 3)) * rng.choice(
            [0.0, 1e-6, 1.0, 30.0], size=(20, 1)
        )
        original = _Original.of(
            corners, np.array([[0, 1, 2]], dtype=np.int32), BitGrid.empty((1, 1, 1))
        )
        found = original.distances(np.ascontiguousarray(near))
        length = np.linalg.norm(end - begin)
        assert found == pytest.approx(along_edges(near, corners), abs=(1e-7 + thin) * length)


def test_a_voxel_that_is_touched_is_not_interior():
    mesh, touched, filled = solid_box()
    everything = touched.with_inside(np.ones(touched.shape, bool))
    occluder = occluder_of([[3, 4, 4], [5, 4, 4], [4, 5, 4]])
    assert deviation(occluder, mesh, interior_of(touched, filled)) == 0.0
    assert deviation(occluder, mesh, interior_of(everything, filled)) / CELL >= 3.0


def test_huge_triangle_is_bounded_work():
    mesh, touched, filled = solid_box()
    occluder = occluder_of([[4e9, 0, 0], [-4e9, 3e9, 0], [0, -4e9, 5e9]])
    found = deviation(occluder, mesh, interior_of(touched, filled)) / CELL
    assert found == pytest.approx(np.hypot(4e9, 5e9), rel=1e-8)


def test_same_on_any_number_of_threads(monkeypatch):
    _, interior, mesh, touched, _ = random_case(0)
    triangles = np.random.default_rng(9).uniform(-3, 11, (60, 3))
    filled = touched.with_inside(interior)
    results = []
    for threads in ("1", "2", "5"):
        monkeypatch.setenv("OCCLUDER_THREADS", threads)
        results.append(deviation(occluder_of(triangles), mesh, interior_of(touched, filled)))
    assert len(set(results)) == 1


def test_no_triangles_do_not_deviate():
    mesh, touched, filled = solid_box()
    empty = Occluder(np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    assert deviation(empty, mesh, interior_of(touched, filled)) == 0.0


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e200])
def test_coordinates_out_of_reach_are_refused(value):
    mesh, touched, filled = solid_box()
    with pytest.raises(MeshError, match="occluder"):
        deviation(
            occluder_of([[value, 4, 4], [5, 4, 4], [4, 5, 4]]), mesh, interior_of(touched, filled)
        )


def test_real_mesh_does_not_deviate_from_itself(asset):
    loaded = trimesh.load(asset("bunny_4968.ply"), process=False)
    mesh = TriangleMesh.from_soup(loaded.vertices, loaded.faces)
    low, high = mesh.bounds
    cell = float((high - low).max()) / 32
    nothing = VoxelGrid(np.zeros((32, 32, 32), bool), low, cell)
    occluder = Occluder(mesh.vertices, mesh.faces)
    assert deviation(occluder, mesh, nothing) == pytest.approx(0.0, abs=1e-9)
    lifted = Occluder(mesh.vertices + np.array([0.0, 5.0 * cell, 0.0]), mesh.faces)
    found = deviation(lifted, mesh, nothing)
    samples, _ = trimesh.sample.sample_surface(
        trimesh.Trimesh(lifted.vertices, lifted.faces), 2000, seed=1
    )
    cloud, _ = trimesh.sample.sample_surface(loaded, 200_000, seed=2)
    nearest = cKDTree(cloud).query(samples)[0].max()
    assert nearest - 0.1 * cell <= found <= 5.0 * cell + 1e-9
