"""The contract of every slicer: the same solid, planes and pixels, whatever the backend.

A backend is added by one line in ``BACKENDS``; all tests below then hold for it.
"""

from __future__ import annotations

import builtins
import subprocess
import sys

import numpy as np
import pytest

from simplifier.errors import BackendUnavailableError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.solid import VoxelGrid
from simplifier.geometry.views import image_axes, random_directions
from simplifier.options.stages import SectionOptions
from simplifier.slicing.planes import SamplingPlan, plan_sections
from simplifier.slicing.sampler import GridSampler
from simplifier.slicing.sections import best_sections
from simplifier.slicing.stencil import StencilSlicer
from simplifier.voxel.fill import fill
from simplifier.voxel.surface import voxel_mesh
from simplifier.voxel.voxelize import voxelize
from tests.slicing.frames import every_depth_plan

CLEARANCE = 0.01  # voxels from a voxel face within which a pixel may go either way


def stencil_of(grid):
    vertices, faces = voxel_mesh(grid)
    return StencilSlicer(vertices, faces, grid.shape)


BACKENDS = {"cpu": GridSampler, "gl": stencil_of}


@pytest.fixture(params=sorted(BACKENDS))
def slicer_of(request):
    """``slicer_of(grid)``: a slicer of each backend in turn; skips where one cannot run."""
    made = []

    def make(grid):
        try:
            made.append(BACKENDS[request.param](grid))
        except BackendUnavailableError as error:
            pytest.skip(str(error))
        return made[-1]

    yield make
    for slicer in made:
        getattr(slicer, "close", lambda: None)()


def grid_of(inside):
    return VoxelGrid(np.array(inside, dtype=np.bool_), np.zeros(3), 1.0)


def centres(shape):
    return np.indices(shape) + 0.5 - np.array(shape).reshape(3, 1, 1, 1) / 2


def box():
    return np.pad(np.ones((7, 4, 10)), 2)


def sphere():
    return (centres((24, 24, 24)) ** 2).sum(axis=0) < 11**2


def torus():
    x, y, z = centres((30, 12, 30))
    return (np.hypot(x, z) - 9.5) ** 2 + y**2 < 4.5**2


def random_voxels():
    return np.random.default_rng(11).random((13, 17, 9)) < 0.5


SOLIDS = {
    "box": box,
    "sphere": sphere,
    "torus": torus,
    "random voxels": random_voxels,
    "checkerboard": lambda: np.indices((8, 9, 10)).sum(axis=0) % 2 == 0,
    "single voxel": lambda: np.ones((1, 1, 1)),
    "one-thick grid": lambda: np.random.default_rng(1).random((20, 1, 15)) < 0.7,
    "rod": lambda: np.ones((1, 70, 1)),
    "empty": lambda: np.zeros((4, 5, 6)),
}


def reference(inside, frame, depth):
    """Mask by plain indexing, and which pixels are clear of every voxel face."""
    rows, columns = np.indices((frame.rows, frame.columns))
    a = frame.corner[0] + frame.pixel * (columns + 0.5)
    b = frame.corner[1] + frame.pixel * (rows + 0.5)
    u, v, d = frame.axes
    points = a[..., None] * u + b[..., None] * v + depth * d
    cells = np.floor(points).astype(np.int64)
    known = ((cells >= 0) & (cells < inside.shape)).all(axis=-1)
    cells[~known] = 0
    mask = inside[tuple(np.moveaxis(cells, -1, 0))] & known
    clear = (np.abs(points - np.round(points)) > CLEARANCE).all(axis=-1)
    return mask, clear


def check_slicer(slicer, grid, plan, planes=None):
    planes = np.arange(len(plan)) if planes is None else planes
    areas = slicer.areas(plan)
    masks = slicer.masks(plan, planes)
    assert areas.shape == (len(plan),)
    assert areas.dtype == np.int64
    assert len(masks) == len(planes)
    compared = 0
    for index, mask in zip(planes, masks, strict=True):
        frame = plan.frames[plan.frame_of[index]]
        expected, clear = reference(grid.inside, frame, plan.depths[index])
        assert mask.dtype == np.bool_
        assert mask.shape == (frame.rows, frame.columns)
        wrong = (mask != expected) & clear
        assert not wrong.any(), f"plane {index}: pixels {np.argwhere(wrong)[:5].tolist()}"
        assert areas[index] == np.count_nonzero(mask)
        compared += np.count_nonzero(clear)
    assert compared > 0


def test_it_tells_its_share_and_ends_when_told_to(slicer_of):
    grid = grid_of(sphere())
    slicer, plan = slicer_of(grid), plan_sections(grid, SectionOptions(directions=8))
    shares = []
    areas = slicer.areas(plan, shares.append)
    assert shares == sorted(shares)
    assert 0.0 <= shares[0] <= shares[-1] <= 1.0

    def enough(share):
        raise KeyError(share)

    with pytest.raises(KeyError):
        slicer.areas(plan, enough)
    assert np.array_equal(slicer.areas(plan), areas)  # it can go on after that


@pytest.mark.sweep(4)
@pytest.mark.parametrize("solid", sorted(SOLIDS))
@pytest.mark.parametrize("step", [1.0, 0.3])
def test_every_plane_of_a_plan(slicer_of, solid, step):
    grid = grid_of(SOLIDS[solid]())
    options = SectionOptions(directions=5, direction_samples=2, depth_step=step)
    check_slicer(slicer_of(grid), grid, plan_sections(grid, options))


@pytest.mark.parametrize("pixel", [0.21, 1.0, 3.0])
def test_directions_all_around_and_pixels_of_any_size(slicer_of, pixel):
    """Depths out of order, repeated, and beyond the solid; pictures that cut it off."""
    grid = grid_of(random_voxels())
    axes = image_axes(np.concatenate([random_directions(6, 3), np.eye(3), -np.eye(3)]))
    slicer = slicer_of(grid)
    depths = (3.37, -8.61, 99.0, 0.52, -99.0, 6.43, 3.37)
    for corner, rows, columns in (((-20.0, -20.0), 45, 40), ((1.3, -2.7), 6, 80)):
        check_slicer(slicer, grid, every_depth_plan(axes, corner, rows, columns, pixel, depths))


def test_more_walls_behind_a_pixel_than_a_stencil_byte_counts(slicer_of):
    """300 walls in a row: back faces and front faces must cancel, in whatever order they come."""
    grid = grid_of(np.indices((600, 3, 4))[0] % 2 == 0)
    directions = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.9999, 0.01, 0.0]])
    axes = image_axes(directions / np.linalg.norm(directions, axis=1, keepdims=True))
    plan = every_depth_plan(
        axes, (-20.31, -20.27), 40, 40, 1.0, (0.47, -300.5, 300.52, 599.1, -0.51)
    )
    check_slicer(slicer_of(grid), grid, plan)


def test_directions_almost_along_an_axis(slicer_of):
    """Faces seen nearly edge-on: their depth slope reaches 1e9."""
    grid = grid_of(torus())
    tilts = np.array([[t, s, 1.0] for t in (0.0, 1e-9, -1e-5, 1e-3) for s in (0.0, -1e-7, 1e-2)])
    directions = tilts / np.linalg.norm(tilts, axis=1, keepdims=True)
    turned = np.concatenate([directions, directions[:, [2, 0, 1]], directions[:, [1, 2, 0]]])
    plan = every_depth_plan(
        image_axes(turned), (-30.31, -30.27), 90, 90, 1.0, (2.31, 6.52, 11.47, 20.5)
    )
    check_slicer(slicer_of(grid), grid, plan)


def test_the_same_question_twice_and_in_any_order(slicer_of):
    grid = grid_of(sphere())
    plan = plan_sections(grid, SectionOptions(directions=4))
    slicer = slicer_of(grid)
    areas = slicer.areas(plan)
    every = slicer.masks(plan, np.arange(len(plan)))
    order = np.random.default_rng(2).permutation(len(plan))[:40]
    for index, mask in zip(order, slicer.masks(plan, order), strict=True):
        assert np.array_equal(mask, every[index])
    assert slicer.masks(plan, np.empty(0, dtype=np.int64)) == []
    assert np.array_equal(slicer.areas(plan), areas)


def test_plans_of_different_picture_sizes_in_turn(slicer_of):
    """A picture buffer that grows, and one that is larger than the picture."""
    grid = grid_of(sphere())
    slicer = slicer_of(grid)
    axes = image_axes(random_directions(2, 8))
    for size in (9, 70, 30):
        plan = every_depth_plan(axes, (-15.0, -15.0), size, size + 13, 0.9, (1.23, 9.87))
        check_slicer(slicer, grid, plan)


def test_two_slicers_side_by_side(slicer_of):
    first, second = grid_of(box()), grid_of(torus())
    slicers = [(slicer_of(grid), grid) for grid in (first, second)]
    for slicer, grid in slicers + slicers[::-1]:
        check_slicer(slicer, grid, plan_sections(grid, SectionOptions(directions=2)))


def test_large_grid_keeps_its_precision(slicer_of):
    """A sparse grid as long as the largest resolution: float32 has the fewest digits there."""
    inside = np.zeros((1024, 8, 640), dtype=np.bool_)
    rng = np.random.default_rng(0)
    inside[rng.integers(0, 1024, 900), rng.integers(0, 8, 900), rng.integers(0, 640, 900)] = True
    inside[1000:, :, 600:] = rng.random((24, 8, 40)) < 0.5
    grid = grid_of(inside)
    options = SectionOptions(directions=3, direction_samples=1, depth_step=60.0)
    plan = plan_sections(grid, options)
    few = SamplingPlan(
        plan.frames[3:], (plan.frame_of[plan.frame_of > 2] - 3).astype(np.int32),
        plan.bin_of[plan.frame_of > 2], plan.depths[plan.frame_of > 2], plan.bins,
    )  # fmt: skip
    check_slicer(slicer_of(grid), grid, few, np.arange(0, len(few), 10))


REAL = {
    "bunny_4968.ply": frozenset({(1, 0)}),  # its base is open: it stands on the ground
    "dragon_871k.ply": frozenset(),
}


@pytest.fixture(scope="module")
def real_grid(asset):
    trimesh = pytest.importorskip("trimesh")
    known = {}

    def load(name):
        if name not in known:
            source = trimesh.load(asset(name), process=False, force="mesh")
            mesh = TriangleMesh.from_soup(source.vertices, source.faces)
            known[name] = fill(voxelize(mesh, 64), REAL[name])
        return known[name]

    return load


@pytest.mark.sweep(3)
@pytest.mark.parametrize("name", sorted(REAL))
def test_real_meshes(slicer_of, real_grid, name):
    grid = real_grid(name)
    assert 0.05 < grid.inside.mean() < 0.8
    plan = plan_sections(grid, SectionOptions(directions=8))
    slicer = slicer_of(grid)
    check_slicer(slicer, grid, plan, np.arange(0, len(plan), 5))
    assert len(best_sections(plan, slicer)) > 40


@pytest.mark.parametrize("name", sorted(REAL))
def test_backends_cut_the_same_slices_but_for_pixels_at_voxel_faces(slicer_of, real_grid, name):
    """Of 902 planes one differs by Mesa and 55 by an H200, which moves corners by half of 1/256
    pixel: of a plane that runs beside a face, a line of pixels may go either way."""
    grid = real_grid(name)
    plan = plan_sections(grid, SectionOptions(directions=8))
    slicer, sampler = slicer_of(grid), GridSampler(grid)
    differing = np.flatnonzero(slicer.areas(plan) != sampler.areas(plan))
    assert len(differing) < len(plan) // 10
    pairs = zip(slicer.masks(plan, differing), sampler.masks(plan, differing), strict=True)
    for index, (mask, expected) in zip(differing, pairs, strict=True):
        _, clear = reference(grid.inside, plan.frames[plan.frame_of[index]], plan.depths[index])
        assert not ((mask != expected) & clear).any()


def test_closing_a_stencil_slicer_twice_does_no_harm(slicer_of):
    slicer = slicer_of(grid_of(box()))
    if isinstance(slicer, StencilSlicer):
        slicer.close()
        slicer.close()
        with stencil_of(grid_of(box())) as other:
            assert other.areas(plan_sections(grid_of(box()), SectionOptions())).sum() > 0


def test_gl_on_a_machine_without_the_python_packages(monkeypatch):
    real_import = builtins.__import__

    def without(name, *rest, **kwargs):
        if name in ("moderngl", "glcontext"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        return real_import(name, *rest, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(BackendUnavailableError, match="glcontext is missing") as refusal:
        stencil_of(grid_of(box()))
    assert "'gl' extra" in str(refusal.value)
    assert "cpu slicer" in str(refusal.value)


def test_gl_on_a_machine_without_the_libraries(monkeypatch):
    glcontext = pytest.importorskip("glcontext")
    pytest.importorskip("moderngl")

    def refuse(**_):
        raise Exception("libEGL.so not loaded")  # what the package really raises

    monkeypatch.setattr(glcontext, "get_backend_by_name", lambda _: refuse)
    with pytest.raises(BackendUnavailableError, match=r"libEGL\.so not loaded") as refusal:
        stencil_of(grid_of(box()))
    assert "libegl-mesa0" in refusal.value.remedy


def test_slicing_imports_no_opengl_before_it_is_asked_to():
    """The cpu slicer must work where the gl extra is not installed."""
    code = (
        "import sys, simplifier.slicing.sampler, simplifier.slicing.stencil; "
        "sys.exit('moderngl' in sys.modules or 'glcontext' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
