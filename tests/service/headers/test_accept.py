from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.headers import best_of

OFFERED = ["application/json", "model/gltf-binary", "model/obj", "text/html"]


@pytest.mark.parametrize(
    ("accept", "best"),
    [
        ("", "application/json"),
        ("*/*", "application/json"),
        ("model/*", "model/gltf-binary"),
        ("model/obj", "model/obj"),
        ("Model/OBJ ; Q=0.5", "model/obj"),
        ("model/obj;q=0.5, model/gltf-binary;q=0.6", "model/gltf-binary"),
        ("model/*;q=0.9, model/gltf-binary;q=0", "model/obj"),
        ("text/html,application/xhtml+xml,*/*;q=0.8", "text/html"),
        ("*/*, application/json;q=0", "model/gltf-binary"),
        ("image/png", None),
        ("*/*;q=0", None),
        ("model/obj;q=2", None),
        ("model/obj;q=", None),
        (",,;q=1,", None),
    ],
)
def test_the_best_liked_is_chosen(accept, best):
    assert best_of(accept, OFFERED) == best


@given(st.text())
def test_any_header_has_an_answer(accept):
    assert best_of(accept, OFFERED) in (*OFFERED, None)
