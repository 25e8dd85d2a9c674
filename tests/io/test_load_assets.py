"""Real meshes: everything that their manifest says must be found in them."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

from simplifier.io.load import load
from tests.conftest import ASSETS

MANIFEST = ASSETS / "MANIFEST.csv"
ROWS = list(csv.DictReader(MANIFEST.open(encoding="utf-8"))) if MANIFEST.exists() else []
MESHES = {row["file"]: row for row in ROWS if not row["file"].endswith(".npy")}


def test_the_manifest_is_used() -> None:
    if not ROWS:
        pytest.skip("no real meshes here (set OCCLUDER_ASSETS to their folder)")
    assert len(MESHES) >= 20


@pytest.mark.parametrize("name", MESHES)
def test_triangles_and_bounds_of_the_manifest(asset: Callable[[str], Path], name: str) -> None:
    mesh = load(asset(name))
    row = MESHES[name]
    assert len(mesh.faces) + mesh.dropped.total == int(row["triangles"])
    extent = [float(value) for value in row["bbox_extent"].split(" x ")]
    if mesh.dropped.far_away:  # what the manifest's box holds, and the mesh no more
        assert mesh.extent.max() < 1e-20 * max(extent)
    else:
        np.testing.assert_allclose(mesh.extent, extent, rtol=1e-4)
    lowest = [float(value) for value in row["bbox_min"].split()]
    np.testing.assert_allclose(mesh.bounds[0], lowest, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("name", ["bunny_4968.ply", "sponza_dabrovic.glb"])
def test_same_corners_as_trimesh(asset: Callable[[str], Path], name: str) -> None:
    mesh = load(asset(name))
    other = trimesh.load(asset(name), process=False, force="mesh")
    ours = mesh.vertices[mesh.faces].reshape(len(mesh.faces), 9)
    theirs = np.asarray(other.vertices)[other.faces].reshape(len(other.faces), 9)
    known = {row.tobytes() for row in np.round(theirs, 9) + 0.0}
    assert all(row.tobytes() in known for row in np.round(ours, 9) + 0.0)


def test_city_keeps_float64_under_its_map_offset(asset: Callable[[str], Path]) -> None:
    """float32 would move walls at 5,176,000 m (the source was rounded to half metres already)."""
    mesh = load(asset("city_lyon_buildings.glb"))
    local = mesh.vertices - [1842000.0, 5176000.0, 0.0]
    # The file holds float32 around the offset: taking it off must give back such numbers.
    assert np.abs(local - local.astype(np.float32)).max() < 2e-9
    assert np.abs(mesh.vertices - mesh.vertices.astype(np.float32)).max() > 1e-4
