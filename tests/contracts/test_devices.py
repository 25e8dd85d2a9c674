"""The contract of every device: the pictures and scores of exact arithmetic, the same on all.

A device is added by one line in ``DEVICES``; all tests below then hold for it.
"""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from threading import Thread

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.device import depth_program, opengl_device, programs, quads_program
from simplifier.device.choice import open_device
from simplifier.device.device import PROCESSOR, QuadSample
from simplifier.geometry.views import BoundingSphere, image_axes, random_directions
from simplifier.io.load import load
from simplifier.kernels.coverage import unpack_masks
from tests.conftest import ASSETS
from tests.kernels.test_coverage import FLAT, edge_functions
from tests.kernels.test_front import NOTHING, depths_along_rays, soup
from tests.selection.scenes import random_candidates
from tests.solids import sphere

MESHES = sorted(path.name for path in ASSETS.glob("*") if path.suffix in (".ply", ".glb"))

DEVICES = {"cpu": lambda: PROCESSOR, "gpu": lambda: open_device("gpu")}


@pytest.fixture(params=sorted(DEVICES), scope="module")
def device(request):
    """Each device in turn; skips where one cannot run."""
    yield from opened(request.param)


@pytest.fixture(params=sorted(DEVICES.keys() - {"cpu"}), scope="module")
def other(request):
    """Each but the processor, which others are compared with."""
    yield from opened(request.param)


def opened(name):
    found = DEVICES[name]()
    if name != "cpu" and found.name == "cpu":
        pytest.skip(*found.remarks)
    with pytest.MonkeyPatch.context() as patch:
        # Else the processor would stand in for what OpenGL fails at, and pass.
        patch.setattr(opengl_device, "forgiven", nullcontext)
        yield found


def seen_from(views, image):
    """(V, 3, 4) maps of the unit sphere to pictures, with depths."""
    maps = np.zeros((views, 3, 4))
    maps[:, :, :3] = image_axes(random_directions(views, views))
    maps[:, :2] *= image / 2.0
    maps[:, :2, 3] = image / 2.0
    return maps


def masks(device, corners, rows, columns):
    """(rows, columns) bool of a soup (m, 3, 2) in pixels."""
    flat = np.asarray(corners, dtype=np.float64)
    points, faces = soup(np.concatenate([flat, np.zeros((*flat.shape[:2], 1))], axis=2))
    return unpack_masks(device.coverage_masks(points, faces, FLAT, rows, columns), columns)[0]


eighths = st.integers(-40, 200).map(lambda value: value / 8)
triangle = st.lists(st.tuples(eighths, eighths), min_size=3, max_size=3)


@settings(max_examples=60, deadline=None)
@given(corners=triangle)
def test_a_triangle_covers_what_exact_edge_functions_say(device, corners):
    values = edge_functions(np.array(corners), 17, 19)
    inside = (values > 0).all(axis=0) | (values < 0).all(axis=0)
    outside = (values > 0).any(axis=0) & (values < 0).any(axis=0)
    mask = masks(device, [corners], 17, 19)
    assert mask[inside].all()
    assert not mask[outside].any()


@settings(max_examples=60, deadline=None)
@given(corners=st.lists(triangle, min_size=1, max_size=8), rows=st.integers(1, 40))
def test_ties_go_as_on_the_processor(other, corners, rows):
    """Corners and edges that meet pixel centres are where a rule about ties is at work."""
    assert (masks(other, corners, rows, 70) == masks(PROCESSOR, corners, rows, 70)).all()


@settings(max_examples=40, deadline=None)
@given(
    mesh=st.integers(0, 12), occluder=st.integers(0, 6), image=st.integers(1, 70),
    seed=st.integers(0, 2**32 - 1),
)  # fmt: skip
def test_what_stands_in_front_is_what_rays_say(device, mesh, occluder, image, seed):
    random = np.random.default_rng(seed)
    size = np.array([image, image, 4.0])
    own, other = (random.uniform(-0.3, 1.3, (n, 3, 3)) * size for n in (mesh, occluder))
    (depths, doubt), (before, unsure) = (depths_along_rays(one, image) for one in (own, other))
    seen, behind = np.isfinite(depths), np.full(depths.shape, -np.inf)
    np.subtract(depths, before, out=behind, where=seen & np.isfinite(before))
    doubt |= unsure | (np.abs(behind - 0.5) < 1e-9)
    flat = np.eye(3, 4)[None]
    ((there, front),) = device.front_pixels(soup(own), soup(other), flat, image, 0.5)
    assert (seen & ~doubt).sum() <= there <= (seen | doubt).sum()
    assert ((behind > 0.5) & ~doubt).sum() <= front <= ((behind > 0.5) | doubt).sum()
    limits = device.depth_limits(*soup(own), flat, image, 0.5)[0]
    assert np.allclose(limits[seen & ~doubt], depths[seen & ~doubt] - 0.5, atol=1e-5)
    assert (limits[~seen & ~doubt] == -np.inf).all()


@pytest.mark.parametrize(("enough", "few"), [(1, 0), (1 << 30, 0), (1, 4096)])
@pytest.mark.parametrize(("rings", "views", "image"), [(6, 5, 64), (20, 3, 350)])
def test_every_device_gives_the_same_bits(other, rings, views, image, enough, few, monkeypatch):
    """Of many triangles, and of few, whose rows are shared out."""
    monkeypatch.setattr(programs, "_ENOUGH", enough)
    monkeypatch.setattr(depth_program, "_FEW", few)
    ball, maps = sphere(1.0, rings=rings), seen_from(views, image)
    small = sphere(0.7, rings=5)
    flat = np.ascontiguousarray(maps[:, :2])
    mesh, occluder = (ball.vertices, ball.faces), (small.vertices * [1.2, 1.0, 0.5], small.faces)

    def everything(one):
        return (
            one.coverage_masks(*mesh, flat, image, image + 3).tobytes(),
            one.front_pixels(mesh, occluder, maps, image, -0.3).tobytes(),
            one.front_pixels(mesh, NOTHING, maps, image, 0.1).tobytes(),
            one.front_pixels(NOTHING, occluder, maps, image, 0.1).tobytes(),
            one.depth_limits(*mesh, maps, image, 0.02).tobytes(),
        )

    assert everything(other) == everything(PROCESSOR)


@settings(max_examples=40, deadline=None)
@given(
    mesh=st.integers(1, 9), occluders=st.lists(st.integers(0, 5), max_size=3),
    image=st.integers(8, 140), spread=st.sampled_from([0.05, 0.4, 1.0]),
    seed=st.integers(0, 2**64 - 1),
)  # fmt: skip
def test_what_is_counted_in_silhouettes_is_the_same(other, mesh, occluders, image, spread, seed):
    """Near the mesh, far from it and across it; views in which nothing shows among others."""
    random = np.random.default_rng(seed)
    corners = random.uniform(0.0, 1.0, (mesh, 3, 3)) * spread * image
    own = soup(corners)
    others = [soup(random.uniform(-0.1, 1.1, (n, 3, 3)) * image) for n in occluders]
    maps = np.repeat(np.eye(2, 4)[None], 3, axis=0)
    maps[1, :, 3] = 0.5 * image
    maps[2, :, 3] = 2.0 * image
    sample = QuadSample(quads=300, seed=seed, first_view=seed % 7)

    def everything(one):
        areas, pixels = one.quad_pixels(own, others, maps, image, sample)
        beside, farthest = one.overhang_pixels(own, others, maps, image)
        assert pixels.shape == (len(others), 3, 3)
        assert farthest.shape == (len(others), 3)
        return [part.tobytes() for part in (areas, pixels, beside, farthest)]

    assert everything(other) == everything(PROCESSOR)


@pytest.mark.parametrize("blocks", [1, 1 << 26])
@pytest.mark.parametrize(("quads", "image"), [(1, 8), (20_000, 700)])
def test_many_quads_in_large_pictures_are_the_same(other, quads, image, blocks, monkeypatch):
    """Their pixels take more than 32 bits; with views one by one, and tables too."""
    monkeypatch.setattr(programs, "_MOST_BYTES", blocks)
    monkeypatch.setattr(quads_program, "_MOST_BYTES", blocks)
    monkeypatch.setattr(quads_program, "MOST_GROUPS", 3 if blocks == 1 else 65_535)
    ball, maps = sphere(1.0, rings=12), np.ascontiguousarray(seen_from(4, image)[:, :2])
    mesh = (ball.vertices, ball.faces)
    occluders = [(ball.vertices * stretch, ball.faces) for stretch in (0.9, [1.4, 0.8, 0.9], 5.0)]
    sample = QuadSample(quads, seed=2**63 + 5)

    def everything(one):
        counted = one.quad_pixels(mesh, occluders, maps, image, sample)
        beside = one.overhang_pixels(mesh, occluders, maps, image)
        return [part.tobytes() for part in (*counted, *beside)]

    assert everything(other) == everything(PROCESSOR)


@pytest.mark.slow
@pytest.mark.parametrize("name", MESHES)
def test_every_device_shows_real_meshes_to_the_same_bit(other, name):
    mesh, maps = load(ASSETS / name), seen_from(6, 512)
    unit = BoundingSphere.of(mesh).to_unit(mesh.vertices)
    occluder, flat = (unit * 0.9, mesh.faces[::50]), maps[:, :2]
    large, sample = (unit * [1.1, 0.9, 1.0], mesh.faces[::50]), QuadSample(32_000, seed=1)

    def both(one):
        return (
            one.coverage_masks(unit, mesh.faces, flat, 512, 512).tobytes(),
            one.front_pixels((unit, mesh.faces), occluder, maps, 512, 0.02).tobytes(),
            *(
                part.tobytes()
                for part in (
                    *one.quad_pixels((unit, mesh.faces), [occluder], flat, 512, sample),
                    *one.overhang_pixels((unit, mesh.faces), [large], flat, 512),
                )
            ),
        )

    assert both(other) == both(PROCESSOR)


def test_far_corners_and_triangles_without_area(device):
    far = [[(-1e30, -1e30), (1e31, -1e30), (-1e30, 1e31)]]
    assert masks(device, far, 9, 130).all()
    flat = [[(0.5, 0.5), (5.5, 5.5), (9.5, 9.5)], [(0.5, 4.5), (5.5, 4.5), (9.5, 4.5)]]
    assert not masks(device, flat, 12, 12).any()
    nothing = device.coverage_masks(*NOTHING, FLAT, 3, 3)
    assert (nothing.shape, nothing.sum()) == ((1, 3, 1), 0)
    ball = sphere(1.0)
    assert len(device.coverage_masks(ball.vertices, ball.faces, FLAT[:0], 3, 3)) == 0


@pytest.mark.parametrize(
    ("vertices", "faces", "rows"),
    [
        (np.zeros((3, 2)), [[0, 1, 2]], 4),
        (np.zeros((3, 3)), [[0, 1, 3]], 4),
        (np.zeros((3, 3)), [[0, 1, 2]], 0),
        (np.full((3, 3), np.nan), [[0, 1, 2]], 4),
    ],
)
def test_refuses_what_it_cannot_draw(device, vertices, faces, rows):
    faces = np.array(faces, np.int32)
    with pytest.raises(ValueError):
        device.coverage_masks(vertices, faces, FLAT, rows, 4)
    with pytest.raises(ValueError):
        device.front_pixels((vertices, faces), NOTHING, np.eye(3, 4)[None], rows, 0.1)


def test_many_views_in_blocks_tell_their_share_and_end_when_told_to(device, monkeypatch):
    ball, maps = sphere(1.0), np.ascontiguousarray(seen_from(9, 32)[:, :2])
    whole = device.coverage_masks(ball.vertices, ball.faces, maps, 32, 32)
    monkeypatch.setattr(programs, "_MOST_BYTES", 2 * 32 * 8)
    shares = []
    parts = device.coverage_masks(ball.vertices, ball.faces, maps, 32, 32, shares.append)
    assert (parts == whole).all()
    assert shares == sorted(shares)
    assert shares[-1] == 1.0

    class EnoughError(Exception):
        pass

    def enough(share):
        raise EnoughError

    with pytest.raises(EnoughError):
        device.coverage_masks(ball.vertices, ball.faces, maps, 32, 32, enough)
    assert (device.coverage_masks(ball.vertices, ball.faces, maps, 32, 32) == whole).all()


def test_pictures_that_end_early_leave_nothing_on_the_card(other):
    ball, maps = sphere(1.0), np.ascontiguousarray(seen_from(9, 32)[:, :2])

    def draw(tell):
        other.coverage_masks(ball.vertices, ball.faces, maps, 32, 32, tell)

    def enough(share):
        assert len(other._card._mapped) == 1  # it was read, and is still there
        raise KeyError

    draw(lambda share: None)
    with pytest.raises(KeyError) as caught:
        draw(enough)
    assert caught.traceback  # which holds all that ran
    assert not other._card._mapped


@pytest.mark.parametrize("seed", range(3))
def test_candidates_score_as_one_by_one(device, seed):
    candidates = random_candidates(seed, 24)
    random = np.random.default_rng(seed)
    polygons = random.integers(0, len(candidates), 60).astype(np.int32)
    most = candidates.triangles[polygons]
    levels = np.where(random.random(60) < 0.5, most, random.integers(1, most + 1)).astype(np.int32)
    base = candidates.draw(3, int(candidates.triangles[3]))
    drawn = replace(candidates, device=device).scores(polygons, levels, base)
    assert drawn.dtype == np.int64
    for polygon, level, score in zip(polygons, levels, drawn, strict=True):
        union = base | candidates.draw(int(polygon), int(level))
        assert score == plain_score(union)


def plain_score(images):
    """Twice the measure: areas left by crosses and squares in turn, the first counted half."""
    total = 0
    for rows in images:
        image = np.pad(np.unpackbits(rows.astype("<u8").view(np.uint8), bitorder="little")
                       .reshape(64, 64).astype(bool), 1)  # fmt: skip
        total += int(image.sum())
        for step in (step % 5 for step in range(64)):
            if not image.any():
                break
            up, down = np.roll(image, 1, 0), np.roll(image, -1, 0)
            whole = image & up & down if step % 2 else image
            image = whole & np.roll(whole, 1, 1) & np.roll(whole, -1, 1) & up & down
            total += 2 * int(image.sum())
    return total


def test_threads_take_turns(device):
    ball, maps = sphere(1.0), np.ascontiguousarray(seen_from(6, 48)[:, :2])
    found = [b""] * 4

    def draw(index):
        drawn = device.coverage_masks(ball.vertices, ball.faces, maps, 48, 48)
        found[index] = drawn.tobytes()

    threads = [Thread(target=draw, args=(index,)) for index in range(len(found))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(set(found)) == 1
    assert found[0] == PROCESSOR.coverage_masks(ball.vertices, ball.faces, maps, 48, 48).tobytes()
