"""Slices of houses that are no prisms, held against pictures in which hidden parts are objects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.visibility_shrinking import gabled
from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.checking.check import viewpoints
from simplifier.visibility.checking.hidden_parts import hidden_boxes
from simplifier.visibility.checking.panorama import Panorama
from simplifier.visibility.find import find_pvs
from tests.visibility.test_find import city_and_cells


def finer(mesh, times):
    """Each triangle in four, as often as is asked for."""
    corners = mesh.vertices[mesh.faces]
    for _ in range(times):
        a, b, c = corners.transpose(1, 0, 2)
        ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        corners = np.concatenate([np.stack(part, axis=1) for part in parts])
    vertices, faces = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    return TriangleMesh.from_soup(vertices, faces.reshape(-1, 3))


def parted(scene, pvs, cell):
    """The scene with what slices hide as objects of their own, at the end; how many these are."""
    objects = np.flatnonzero(pvs.visible(cell))
    values = pvs.slices.of(cell)
    bounds = scene.bounds()
    meshes, mesh_of = list(scene.meshes), scene.mesh_of.copy()
    names, transforms, count = list(scene.names), list(scene.transforms), 0
    for index, box in zip(objects.tolist(), hidden_boxes(bounds[objects], values), strict=True):
        if np.isnan(box).any():
            continue
        mesh, place = scene.meshes[scene.mesh_of[index]], scene.transforms[index]
        corners = (mesh.vertices @ place[:3, :3].T + place[:3, 3])[mesh.faces]
        hair = 1e-9 * np.ptp(bounds)
        hidden = ((corners >= box[0] - hair) & (corners <= box[1] + hair)).all(axis=(1, 2))
        if not hidden.any() or hidden.all():
            continue
        meshes += [TriangleMesh.from_soup(mesh.vertices, mesh.faces[some])
                   for some in (~hidden, hidden)]  # fmt: skip
        mesh_of[index] = len(meshes) - 2
        mesh_of = np.append(mesh_of, np.int32(len(meshes) - 1))
        names.append(f"{names[index]} hidden")
        transforms.append(place)
        count += 1
    return Scene(tuple(meshes), tuple(names), mesh_of, np.array(transforms)), count


@pytest.mark.sweep(2)
@pytest.mark.parametrize("more", [False, True])
def test_pictures_show_nothing_of_what_slices_hide_of_gabled_houses(more):
    upright, cells = city_and_cells(3, 3, seed=1)
    scene = gabled(upright.scene)
    scene = replace(scene, meshes=(finer(scene.meshes[0], 2),))
    upright = UprightScene.of(scene, "z")
    pvs = find_pvs(upright, cells, PvsOptions(up="z", epsilon=2.5, slices=True)).pvs
    if more:  # were three more slices hidden, these would be seen
        values = pvs.slices.values.copy()
        low, high, tall = (values[:, :2] > 1), (values[:, :2] < 0), values[:, 2] > 0
        values[:, :2][low] = np.maximum(values[:, :2][low] - 3, 1)
        values[:, :2][high] = np.maximum(values[:, :2][high] - 3, -7)
        values[tall, 2] = np.minimum(values[tall, 2] + 3, 8)
        pvs = replace(pvs, slices=replace(pvs.slices, values=values))
    random, shown, total = np.random.default_rng(0), 0, 0
    for cell in range(len(cells)):
        split, count = parted(scene, pvs, cell)
        panorama = Panorama(split, "z", 200)
        places = viewpoints(cells, cell, 4, random)
        middle = 0.5 * (cells.low[cell] + cells.high[cell])
        for place in places + 1e-3 * (middle - places):
            seen = ~np.isnan(panorama.seen_from(place + pvs.origin)[:, 0])
            shown += int(seen[len(scene) :].sum())
        total += count
    assert total > 20
    assert shown > 10 if more else shown == 0
