"""Single-sided occluders: seen from everywhere as the double-sided ones are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from trimesh.creation import icosphere

from simplifier.geometry.occluder import Occluder
from simplifier.io.written_faces import single_sided
from tests.solids import box


def occluder(*meshes) -> Occluder:
    """Of all triangles of some meshes; equal corners are one vertex."""
    corners = [np.asarray(mesh.vertices)[np.asarray(mesh.faces)] for mesh in meshes]
    return Occluder.of(np.concatenate(corners), 0.5, {})


def hit(one: Occluder, origin: np.ndarray, ray: np.ndarray, *, front: bool) -> bool:
    """Whether a ray meets a triangle, or a front face alone."""
    a, b, c = (one.vertices[one.faces[:, k]] for k in range(3))
    sides = [
        np.einsum("ij,ij->i", np.cross(p - origin, q - origin), np.broadcast_to(ray, p.shape))
        for p, q in ((a, b), (b, c), (c, a))
    ]
    towards = (np.array(sides) < 0.0).all(axis=0)
    away = (np.array(sides) > 0.0).all(axis=0)
    return bool(away.any() if front else (towards | away).any())


SHEET = Occluder(np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0.0]]), np.array([[0, 1, 2]], np.int32))


def test_a_sheet_gets_its_other_side() -> None:
    made = single_sided(SHEET)
    assert made.single_sided
    assert made.faces.tolist() == [[0, 1, 2], [2, 1, 0]]


def test_a_closed_part_stays_turned_outwards() -> None:
    closed = occluder(icosphere(subdivisions=1))
    assert len(single_sided(closed).faces) == len(closed.faces)
    inside_out = Occluder(closed.vertices, np.ascontiguousarray(closed.faces[:, ::-1]), 0.5)
    np.testing.assert_array_equal(single_sided(inside_out).faces, single_sided(closed).faces)
    volume = np.linalg.det(single_sided(closed).vertices[single_sided(closed).faces]).sum()
    assert volume > 0.0


def test_only_the_open_part_is_doubled() -> None:
    both = occluder(box(low=(5, 5, 5)), SHEET)
    made = single_sided(both)
    assert len(made.faces) == len(both.faces) + 1
    assert made.error_bound == both.error_bound


@pytest.mark.parametrize("scale", [1e-120, 1.0, 1e120])
def test_outwards_at_any_scale(scale: float) -> None:
    inside_out = occluder(box(low=(5, 5, 5)))
    turned = Occluder(inside_out.vertices * scale, inside_out.faces[:, ::-1].copy())
    assert single_sided(turned).faces.tolist() == single_sided(inside_out).faces.tolist()


def test_it_is_done_once_and_nothing_stays_nothing() -> None:
    made = single_sided(SHEET)
    assert single_sided(made).faces is made.faces
    nothing = Occluder(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32))
    assert len(single_sided(nothing).faces) == 0


@given(st.integers(0, 2**32 - 1), st.integers(1, 12))
def test_front_faces_cover_what_both_sides_did(seed: int, count: int) -> None:
    random = np.random.default_rng(seed)
    soup = Occluder(
        random.uniform(-1, 1, (3 * count, 3)), np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    )
    one = occluder(box((0.6, 0.7, 0.8), (-0.3, -0.3, -0.3)), soup)
    made = single_sided(one)
    for _ in range(40):
        ray = random.normal(size=3)
        origin = random.uniform(-0.8, 0.8, 3) - 10.0 * ray / np.linalg.norm(ray)
        assert hit(made, origin, ray, front=True) == hit(one, origin, ray, front=False)
