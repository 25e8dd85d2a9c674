"""The contract of cull maps: nothing visible is left out, and both backends find the same umbra.

How far they may be apart: the map of one backend is, but for :data:`PRECISION` of the range of
heights, nowhere lower than that of the other whose occluders are shrunk by a pixel more, two the
other way round.  From above, the rays of the processor lose a step's slope in the pixels of an
occluder itself.  No closer bound holds, since light that falls through a slit narrower than a pixel
meets the rays of the one and misses the middles of pixels of the other.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from bench.visibility_city import generated_city, scene_of_boxes, street_cells
from simplifier.errors import BackendUnavailableError
from simplifier.geometry.view_cells import ViewCells
from simplifier.kernels.umbra import see_over
from simplifier.visibility.checking.check import viewpoints
from simplifier.visibility.cull_maps.cull_map import (
    CullMaps,
    samples_by_erosion,
    see_by_cull_maps,
    umbra_heights,
)
from simplifier.visibility.cull_maps.cull_map_gl import OpenGLCullMaps
from simplifier.visibility.cull_maps.erosion import Window
from simplifier.visibility.cull_maps.umbra_buffer import PRECISION
from simplifier.visibility.solid.height_field import height_field
from tests.visibility.cull_maps.test_cull_map import named, proven, slits
from tests.visibility.scenes import PUZZLES, one_box
from tests.visibility.solid.test_height_field import upright


class Processor:
    """The same face as ``OpenGLCullMaps``."""

    def __init__(self, maps):
        self.maps = maps

    def see(self, cells):
        return see_by_cull_maps(self.maps, cells)

    def umbra_heights(self, cells, cell):
        return umbra_heights(self.maps, cells, cell)

    def close(self):
        pass


BACKENDS = {"cpu": Processor, "opengl": OpenGLCullMaps}


@pytest.fixture
def made():
    """``made(backend, maps)``: closed at the end; skips where the backend cannot run."""
    open_ = []

    def make(backend, maps):
        try:
            open_.append(BACKENDS[backend](maps))
        except BackendUnavailableError as error:
            pytest.skip(str(error))
        return open_[-1]

    yield make
    for one in open_:
        one.close()


@pytest.fixture(params=sorted(BACKENDS))
def backend(request, made):
    """``backend(maps)`` of each in turn."""
    return lambda maps: made(request.param, maps)


def maps_of(scene, cells, pixel, spacing):
    around = np.array([cells.low[:, :2].min(axis=0), cells.high[:, :2].max(axis=0)])
    return CullMaps(height_field(upright(scene), pixel, around), spacing)


def shrunk(maps, pixels):
    """The same with occluders that are shrunk by so many pixels more."""
    size = 2 * pixels + 1
    inner = ndimage.minimum_filter(maps.field.inner, size, mode="constant", cval=-np.inf)
    return CullMaps(replace(maps.field, inner=inner), maps.spacing)


@pytest.mark.parametrize("make", PUZZLES)
def test_what_is_seen_in_scenes_built_against_it(backend, make):
    puzzle = make()
    maps = maps_of(puzzle.scene, puzzle.cells, 1.0, 2.5)
    found = named(puzzle.scene, backend(maps).see(puzzle.cells)[0][0])
    assert puzzle.seen <= found


@pytest.mark.parametrize("seed", [0, 1])
def test_all_that_any_point_of_a_cell_sees_of_a_city_is_in_its_set(backend, seed):
    city = generated_city(4, seed=seed)
    cells = street_cells(city, 3, seed=seed)
    found = backend(maps_of(city, cells, 1.0, 5.0)).see(cells)[0]
    for cell in range(len(cells)):
        seen = proven(city, viewpoints(cells, cell, 60, np.random.default_rng(seed)))
        assert not (seen & ~found[cell]).any()
        assert seen.sum() > 5
    assert found.mean() < 0.5


def test_what_stands_in_a_cell_and_what_cells_overlap(backend):
    """Cells anywhere on a grid: houses stand in most of them."""
    city = generated_city(3, seed=2)
    corners = np.array([[x, y, 0.0] for x in (0.0, 62.0) for y in (14.0, 50.0)])
    cells = ViewCells.boxes(corners, corners + np.array([25.0, 25.0, 30.0]))
    found = backend(maps_of(city, cells, 1.0, 5.0)).see(cells)[0]
    bounds = city.bounds()[:, :, :2]
    stands = 0
    for cell in range(len(cells)):
        low, high = cells.low[cell, :2], cells.high[cell, :2]
        inside = ((bounds[:, 0] <= high) & (bounds[:, 1] >= low)).all(axis=1)
        assert found[cell][inside].all()
        stands += inside.sum()
        seen = proven(city, viewpoints(cells, cell, 40, np.random.default_rng(0)))
        assert not (seen & ~found[cell]).any()
    assert stands > 5


def test_what_stands_in_a_cell_hides_nothing_from_it(backend):
    boxes = np.array([[(-2.0, 3.0, 0.0), (2.0, 7.0, 9.0)], [(-1.0, 30.0, 0.0), (1.0, 34.0, 5.0)]])
    scene = scene_of_boxes(boxes, ["wall", "behind"])
    cells = ViewCells.boxes(
        np.array([[-5.0, -5.0, 0.0], [-1.0, -5.0, 0.0]]),
        np.array([[5.0, 5.0, 2.0], [1.0, 2.5, 2.0]]),
    )
    found = backend(maps_of(scene, cells, 0.25, 0.5)).see(cells)[0]
    assert named(scene, found[0]) == {"wall", "behind"}
    assert named(scene, found[1]) == {"wall"}
    # Now it stands before all there; what of it is beyond the cell does hide.
    boxes[0, :, 0] = -30.0, 30.0
    wide = scene_of_boxes(boxes, ["wall", "behind"])
    assert backend(maps_of(wide, cells, 0.25, 0.5)).see(cells)[0].tolist() == [
        [True, False],
        [True, False],
    ]


@pytest.mark.parametrize("pixel", [0.3, 0.9])
def test_what_shows_through_slits_is_in_the_set(backend, pixel):
    for seed, turned in ((0, False), (1, True)):
        scene, cells, points = slits(seed, turned)
        seen = proven(scene, points)
        assert seen[-3:].all()
        found = backend(maps_of(scene, cells, pixel, 10.0)).see(cells)[0][0]
        assert not (seen & ~found).any()


def test_an_erosion_that_is_left_out_is_found_out(backend, monkeypatch):
    none = Window.box(0, 0)
    whole = CullMaps.erosion
    monkeypatch.setattr(CullMaps, "erosion", lambda self, window: whole(self, none))
    missed = 0
    for seed in range(2):
        scene, cells, points = slits(seed)
        seen = proven(scene, points)
        found = backend(maps_of(scene, cells, 0.5, 10.0)).see(cells)[0][0]
        missed += int((seen & ~found).sum())
    assert missed > 0


@pytest.mark.parametrize("eye", [2.0, 18.0, 60.0])
def test_the_backends_find_the_same_umbra(made, eye):
    city = generated_city(4, seed=3)
    cells = street_cells(city, 2, eye=eye, seed=1)
    maps = maps_of(city, cells, 1.0, 5.0)
    drawn = made("opengl", maps)
    drawn_less, cpu_less = made("opengl", shrunk(maps, 2)), Processor(shrunk(maps, 1))
    low, high = drawn.range
    precision = PRECISION * (high - low) * max(1.0, abs(eye - low) / (high - low))
    compared = 0
    for cell in range(len(cells)):
        lowest = [
            np.where(one < low, -np.inf, np.minimum(one, high))
            for one in (
                drawn.umbra_heights(cells, cell),
                umbra_heights(maps, cells, cell),
                drawn_less.umbra_heights(cells, cell),
                cpu_less.umbra_heights(cells, cell),
            )
        ]
        by_gl, by_cpu, less_gl, less_cpu = lowest
        assert (by_gl >= less_cpu - precision).all()
        rough = precision + a_step(maps, cells, cell, less_gl)
        assert ((by_cpu >= less_gl - rough) | (less_gl - rough < low)).all()
        compared += np.isfinite(less_gl).sum() + np.isfinite(less_cpu).sum()
    assert compared > 20_000


def a_step(maps, cells, cell, umbra):
    """What a map may fall from a pixel to the next, seen from above."""
    middle = 0.5 * (cells.low[cell] + cells.high[cell])[:2]
    half = 0.5 * (cells.high[cell] - cells.low[cell])[0] / maps.field.cell
    centre = (middle - maps.field.low) / maps.field.cell
    x, y = np.indices(umbra.shape) + 0.5
    steps = np.maximum(np.abs(x - centre[0]), np.abs(y - centre[1])) - half
    over = np.maximum(cells.high[cell, 2] - umbra, 0.0)
    return np.where(np.isfinite(over), over, 0.0) / np.maximum(steps - 2.0, 1e-9)


def test_the_umbra_of_one_box_is_known(backend):
    """A cell of 10 x 10 sees over the near edge of a box as wide, from its own far edge."""
    puzzle, pixel, spacing = one_box(), 0.25, 0.5
    reach = ViewCells.boxes(np.array([[-5.0, -5.0, 0.0]]), np.array([[60.0, 5.0, 2.0]]))
    maps = maps_of(puzzle.scene, reach, pixel, spacing)
    umbra = backend(maps).umbra_heights(puzzle.cells, 0)
    x, y = (maps.field.low[axis] + pixel * (np.indices(umbra.shape)[axis] + 0.5) for axis in (0, 1))
    # Heights above the highest object are one to the buffer.
    umbra = np.minimum(umbra, 10.0)
    exact = np.minimum(2.0 + 8.0 * (x + 5.0) / 25.0, 10.0)
    lost = 4.0 * pixel  # by pixels of the raster, what is shrunk, and a step
    least = np.minimum(2.0 + 8.0 * (x - lost + 5.0) / (25.0 + lost), 10.0)
    behind = (x > 20.0 + lost) & (np.abs(y) < 3.5)  # of shrunk boxes shadows grow narrower
    near = (x > 20.0) & (np.abs(y) < 5.0)
    assert behind.sum() > 1000
    assert (umbra[behind] >= least[behind] - 0.01).all()
    assert (umbra[near] <= exact[near] + 0.01).all()
    assert np.isneginf(umbra[~near]).all()


def test_the_umbra_as_an_array_is_what_sets_are_found_by():
    city = generated_city(4, seed=5)
    cells = street_cells(city, 6, seed=5)
    maps = maps_of(city, cells, 1.0, 5.0)
    assert max(maps.field.shape) < 256  # the first ring of rays reaches all
    found = see_by_cull_maps(maps, cells)[0]
    field = maps.field
    for cell in range(len(cells)):
        seen = np.zeros(len(city), dtype=np.bool_)
        samples_by_erosion(maps, cells, cell, seen)
        see_over(
            umbra_heights(maps, cells, cell), 0, 0, field.shape[1], field.starts, field.objects,
            field.object_tops, seen,
        )  # fmt: skip
        assert np.array_equal(seen, found[cell])


def test_maps_that_grow_find_what_one_large_map_finds(made, monkeypatch):
    city = generated_city(5, seed=7)
    cells = street_cells(city, 2, seed=7)
    maps = made("opengl", maps_of(city, cells, 1.0, 10.0))
    grown, work = maps.see(cells)
    monkeypatch.setattr("simplifier.visibility.cull_maps.cull_map_gl.FIRST_WINDOW", 1024)
    whole, all_work = maps.see(cells)
    assert grown.sum() <= 1.05 * whole.sum()
    assert (grown & whole).sum() >= 0.97 * whole.sum()
    assert (work[:, 0] < 0.6 * all_work[:, 0]).all()
