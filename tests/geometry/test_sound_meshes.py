"""Small meshes checked together, against each checked by itself."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.errors import MeshError
from simplifier.geometry.mesh import FURTHEST, TriangleMesh
from simplifier.geometry.sound_meshes import sound_meshes


def soup(triangles: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Some triangles of which each vertex is used."""
    rng, count = np.random.default_rng(seed), triangles + 2
    first = rng.integers(count, size=triangles)
    second = rng.integers(1, count, size=triangles)  # so many vertices further
    third = 1 + (second + rng.integers(count - 2, size=triangles)) % (count - 1)
    faces = np.column_stack([first, first + second, first + third]) % count
    used, faces = np.unique(faces, return_inverse=True)
    return rng.normal(size=(len(used), 3)), faces.reshape(-1, 3)


def with_vertex(vertices, faces, values):
    changed = vertices.copy()
    changed[faces[0, 0]] = values
    return changed, faces


def with_corner(vertices, faces, corner):
    changed = faces.copy()
    changed[-1, 0] = corner(changed[-1], len(vertices))
    return vertices, changed


def flat(vertices, faces):
    changed = vertices.copy()
    a, b, c = faces[0]
    changed[c] = 0.5 * (changed[a] + changed[b])
    changed[[a, b, c], 1:] = 0.0
    return changed, faces


FAULTS = {
    "not a number": lambda v, f: with_vertex(v, f, np.nan),
    "infinite": lambda v, f: with_vertex(v, f, np.inf),
    "volumes overflow": lambda v, f: with_vertex(v, f, 1e101),
    "far away": lambda v, f: with_vertex(v, f, 4.0 * FURTHEST),
    "a corner twice": lambda v, f: with_corner(v, f, lambda face, _: face[1]),
    "no such vertex": lambda v, f: with_corner(v, f, lambda _, count: count),
    "below 0": lambda v, f: with_corner(v, f, lambda *_: -1),
    "without area": flat,
    "an unused vertex": lambda v, f: (np.append(v, [[1.0, 2.0, 3.0]], axis=0), f),
    "no triangle": lambda v, f: (v, f[:0]),
    "no vertex": lambda v, f: (v[:0], f),
    "quads": lambda v, f: (v, np.column_stack([f, f[:, 0]])),
    "float32": lambda v, f: (v.astype(np.float32), f),
    "not an array": lambda v, f: (v.tolist(), f.tolist()),
    "masked": lambda v, f: (np.ma.masked_greater(v, v.max() - 1e-9), f),
}


def alone(vertices, faces) -> TriangleMesh | None:
    try:
        return TriangleMesh.from_soup(vertices, faces)
    except MeshError:
        return None


def check(soups) -> list[TriangleMesh | None]:
    """Those that are sound are to the bit what each by itself gives."""
    found = sound_meshes(soups)
    assert len(found) == len(soups)
    for mesh, one in zip(found, soups, strict=True):
        if mesh is None:
            continue
        expected = alone(*one)
        assert expected is not None
        assert mesh.vertices.tobytes() == expected.vertices.tobytes()
        assert mesh.faces.tobytes() == expected.faces.tobytes()
        assert mesh.dropped == expected.dropped
        assert mesh.dropped.total == 0
        assert mesh.usual_reach == expected.usual_reach
        assert not mesh.vertices.flags.writeable
        assert not mesh.faces.flags.writeable
        assert not np.shares_memory(mesh.vertices, one[0])
    return found


def test_all_of_some_good_ones_are_sound():
    assert None not in check([soup(count, count) for count in range(1, 60)])


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("place", [0, 1, 2])
def test_one_with_a_fault_is_left_alone_and_no_other(fault, place):
    soups = [soup(9, seed) for seed in (1, 2)]
    soups.insert(place, FAULTS[fault](*soup(12, 3)))
    found = check(soups)
    assert [mesh is None for mesh in found] == [index == place for index in range(3)]


def test_large_ones_are_left_alone():
    found = check([soup(3000), soup(5)])
    assert found[0] is None
    assert found[1] is not None


def test_more_than_are_checked_at_once():
    assert None not in check([soup(2000, seed) for seed in range(40)])


def test_a_span_of_the_usual_reach_is_no_stray():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1000, 0, 0], [1001, 0, 0], [1000, 1, 0]])
    faces = np.arange(6).reshape(2, 3)
    assert check([(vertices.astype(np.float64), faces)]) != [None]


@given(
    st.lists(
        st.tuples(
            st.integers(1, 12), st.integers(0, 99), st.sampled_from([None, *FAULTS]),
            st.floats(-90.0, 90.0),
        ),
        max_size=8,
    )
)  # fmt: skip
def test_any_are_as_each_by_itself(drawn):
    soups = []
    for count, seed, fault, power in drawn:
        vertices, faces = soup(count, seed)
        made = (vertices * 10.0**power, faces)
        soups.append(made if fault is None else FAULTS[fault](*made))
    found = check(soups)
    for mesh, (_, _, fault, _) in zip(found, drawn, strict=True):
        assert mesh is not None or fault is not None
