"""The device of a report draws once what is asked for twice, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.device import remembering as module
from simplifier.device.device import PROCESSOR, Processor
from simplifier.device.remembering import remembering, rest
from simplifier.kernels import contours, front
from tests import solids
from tests.kernels.test_front_contours import HALF, looks

VIEWS = looks(96, 40)
FLAT = np.ascontiguousarray(VIEWS[:, :2])
RING = solids.torus()


@pytest.fixture
def made(monkeypatch):
    """How often edges were found, and silhouettes drawn by them."""
    made = {"edge_table": 0, "draw_by_contours": 0}
    monkeypatch.setattr(front, "LEAST_FACES", 0)

    def count(name, work):
        def counted(*arguments):
            made[name] += 1
            return work(*arguments)

        monkeypatch.setattr(contours, name, counted)

    for name in made:
        count(name, getattr(contours, name))
    return made


def silhouettes(device, mesh, views=FLAT, image=40):
    return device.coverage_masks(mesh.vertices, mesh.faces, views, image, image)


def fronts(device, mesh, views=VIEWS, image=40):
    arrays = [(one.vertices, one.faces) for one in (mesh, HALF)]
    return device.front_pixels(*arrays, views, image, 0.02)


def test_a_report_finds_the_edges_and_draws_each_picture_once(made):
    device = remembering(PROCESSOR)
    first = silhouettes(device, RING)
    silhouettes(device, solids.box())
    larger = silhouettes(device, RING, FLAT * 2.0, 80)
    shown = fronts(device, RING)
    assert made == {"edge_table": 1, "draw_by_contours": 2}
    np.testing.assert_array_equal(first, silhouettes(PROCESSOR, RING))
    np.testing.assert_array_equal(larger, silhouettes(PROCESSOR, RING, FLAT * 2.0, 80))
    np.testing.assert_array_equal(shown, fronts(PROCESSOR, RING))


@pytest.mark.parametrize(
    ("mesh", "views", "image"),
    [
        (solids.moved(RING, 0.9), VIEWS, 40),
        (solids.TriangleMesh(RING.vertices, RING.faces[::-1]), VIEWS, 40),
        (RING, VIEWS[::-1], 40),
        (RING, VIEWS, 41),
    ],
)
def test_what_is_not_quite_the_same_is_drawn(mesh, views, image):
    device = remembering(PROCESSOR)
    silhouettes(device, RING)
    found = fronts(device, mesh, views, image)
    np.testing.assert_array_equal(found, fronts(PROCESSOR, mesh, views, image))


def test_the_largest_mesh_is_remembered(made):
    device, fine = remembering(PROCESSOR), solids.sphere(rings=24)
    silhouettes(device, RING)
    silhouettes(device, fine)
    silhouettes(device, RING)
    fronts(device, fine)
    assert made == {"edge_table": 3, "draw_by_contours": 3}


@pytest.mark.parametrize("first", [RING, solids.sphere(rings=24)])
def test_a_mesh_that_another_thread_draws_meanwhile_takes_its_place_as_a_whole(first, monkeypatch):
    device, edge_table = remembering(PROCESSOR), contours.edge_table
    meshes = [RING, solids.sphere(rings=24)]
    waiting = [one for one in meshes if len(one.faces) != len(first.faces)]

    def interrupted(vertices, faces):
        table = edge_table(vertices, faces)
        if waiting:
            silhouettes(device, waiting.pop())
        return table

    monkeypatch.setattr(contours, "edge_table", interrupted)
    silhouettes(device, first)
    assert not waiting
    for mesh in meshes:
        np.testing.assert_array_equal(silhouettes(device, mesh), silhouettes(PROCESSOR, mesh))
        np.testing.assert_array_equal(fronts(device, mesh), fronts(PROCESSOR, mesh))


@pytest.fixture
def drawn(monkeypatch):
    """Triangles of what was drawn, not remembered."""
    drawn, draw = [], module.coverage_masks

    def counted(vertices, faces, *arguments):
        drawn.append(len(faces))
        return draw(vertices, faces, *arguments)

    monkeypatch.setattr(module, "coverage_masks", counted)
    return drawn


def test_a_picture_is_drawn_once_also_without_edges(drawn):
    device, few = remembering(PROCESSOR), FLAT[:2]
    silhouettes(device, RING, few)
    silhouettes(device, solids.box(), few)
    np.testing.assert_array_equal(silhouettes(device, RING, few), silhouettes(PROCESSOR, RING, few))
    assert drawn == [len(RING.faces), len(solids.box().faces)]
    assert device.known._mesh.table is None


def test_who_rests_keeps_pictures_alone(made, drawn):
    device = remembering(PROCESSOR)
    first = silhouettes(device, RING)
    rest(device)
    assert device.known._mesh.table is None
    np.testing.assert_array_equal(first, silhouettes(device, RING))
    assert (made["edge_table"], len(drawn)) == (1, 1)
    np.testing.assert_array_equal(
        silhouettes(device, RING, FLAT * 2.0, 80), silhouettes(PROCESSOR, RING, FLAT * 2.0, 80)
    )
    silhouettes(device, RING, FLAT * 1.5, 60)
    assert (made["edge_table"], len(drawn)) == (3, 3)  # one of them for who remembers nothing
    rest(PROCESSOR)  # which has nothing to let go of


def test_pictures_of_the_latest_sizes_are_kept(drawn):
    device = remembering(PROCESSOR)
    for image in (40, 41, 42, 43):
        silhouettes(device, RING, FLAT, image)
    for image in (43, 42, 41):
        silhouettes(device, RING, FLAT, image)
    assert len(drawn) == 4
    silhouettes(device, RING, FLAT, 40)
    assert len(drawn) == 5


def test_large_pictures_are_not_kept(made, monkeypatch):
    monkeypatch.setattr(module, "_MOST_BYTES", 1000)
    device = remembering(PROCESSOR)
    silhouettes(device, RING)
    fronts(device, RING)
    assert made == {"edge_table": 1, "draw_by_contours": 2}


def test_other_devices_stay_what_they_are():
    class Other:
        pass

    other = Other()
    assert remembering(other) is other
    device = remembering(Processor(("slow",)))
    assert (device.remarks, device.name) == (("slow",), "cpu")
