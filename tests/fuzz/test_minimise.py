"""Failing inputs become small, and go on failing."""

from __future__ import annotations

import json

from hypothesis import given, settings
from hypothesis import strategies as st

from tests.fuzz.cases import read_case, soup_of, write_case
from tests.fuzz.minimise import minimised_bytes, minimised_case, without
from tests.hierarchy.scenes import street
from tests.solids import table


def test_what_does_not_matter_is_left_out() -> None:
    data = b"a long file with a\xffb somewhere and more behind it"
    assert minimised_bytes(data, lambda tried: b"\xff" in tried) == b"\xff"
    assert minimised_bytes(data, lambda tried: tried.count(b"w") >= 2) == b"ww"


@settings(max_examples=50)
@given(st.sets(st.integers(0, 60), min_size=1))
def test_just_the_guilty_items_are_left(guilty: set[int]) -> None:
    assert without(list(range(61)), lambda some: guilty <= set(some)) == sorted(guilty)


def test_a_case_is_left_with_the_triangle_and_the_option_that_matter() -> None:
    soup = soup_of(table())
    mark = soup["vertices"][soup["faces"][17][0]]

    def fails(data: bytes) -> bool:
        case = read_case(data)
        points, faces = case["mesh"]["vertices"], case["mesh"]["faces"]
        there = any(points[corner] == mark for face in faces for corner in face)
        return there and case["options"].get("ground") is True

    data = write_case({"mesh": soup, "options": {"ground": True, "seed": 3, "budget": 9}})
    small = read_case(minimised_case(data, fails))
    assert small["options"] == {"ground": True}
    assert len(small["mesh"]["faces"]) == 1
    assert len(small["mesh"]["vertices"]) <= 3
    assert mark in small["mesh"]["vertices"]


def test_a_scene_is_left_with_one_object() -> None:
    scene = street(6)
    case = {
        "meshes": [soup_of(mesh) for mesh in scene.meshes],
        "mesh_of": scene.mesh_of.tolist(),
        "transforms": scene.transforms.tolist(),
        "options": {"budget": 3},
        "cameras": [{"position": [0, 0, 0]}],
    }
    small = read_case(minimised_case(write_case(case), lambda data: b"mesh_of" in data))
    assert len(small["mesh_of"]) == len(small["transforms"]) == 1
    assert (small["cameras"], small["options"]) == ([], {})
    assert json.loads(json.dumps(small)) == small
