"""The table of media types, both ways."""

from __future__ import annotations

import pytest

from service.jobs.media_types import media_type_of, suffix_of
from simplifier.io.formats import readable_suffixes, writable_suffixes

MESHES = (".glb", ".gltf", ".obj", ".off", ".ply", ".stl")


@pytest.mark.parametrize("suffix", [*readable_suffixes(), *writable_suffixes()])
def test_every_format_of_the_library_has_a_media_type_that_leads_back(suffix):
    assert suffix_of(media_type_of(f"mesh{suffix}"), readable_suffixes()) == suffix


@pytest.mark.parametrize(
    ("media_type", "suffix"),
    [
        ("MODEL/STL", ".stl"),
        ("application/sla", ".stl"),
        (" model/obj ; charset=utf-8", ".obj"),
        ("application/ply", ".ply"),
        ("application/zip", None),  # known, but no mesh
        ("text/plain", None),
        ("", None),
    ],
)
def test_others_say_it_in_their_ways(media_type, suffix):
    assert suffix_of(media_type, MESHES) == suffix


@pytest.mark.parametrize("name", ["report.JSON", "pictures/a.json"])
def test_a_name_is_known_by_its_suffix(name):
    assert media_type_of(name) == "application/json"


@pytest.mark.parametrize("name", ["", "glb", ".glb", "a.b/c", "x.exe"])
def test_what_is_not_known_is_bytes(name):
    assert media_type_of(name) == "application/octet-stream"
