"""What is drawn of a scene, and beside it what of it may hide anything."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from simplifier.errors import EmptyMeshError
from simplifier.geometry.scene import NOTHING, WHOLE, opaque_places
from simplifier.io import scene_layers
from simplifier.io.scene import load_scene
from simplifier.io.scene_layers import load_layers, whole_scene
from tests.io.glazed import glazed
from tests.solids import box

STONE, PANE = box(), box((1.0, 1.0, 1.0), (5.0, 0.0, 0.0))


@pytest.fixture
def file(tmp_path):
    """Writes a scene and gives its path."""

    def write(**nodes):
        path = tmp_path / "scene.glb"
        path.write_bytes(glazed(nodes))
        return path

    return write


def test_glass_is_drawn_and_is_not_opaque(file):
    path = file(house=(STONE, PANE), shed=(STONE, None), pane=(None, PANE))
    whole, opaque = load_layers(path)
    assert whole.names == ("house", "shed", "pane")
    assert whole.triangle_counts.tolist() == [24, 12, 12]
    assert opaque.names == ("house", "shed")
    assert opaque.triangle_counts.tolist() == [12, 12]
    assert opaque_places(whole, opaque).tolist() == [0, WHOLE, NOTHING]
    assert whole.warnings == (
        "what one can see through may be seen, and hides nothing: all of 1 object and parts of"
        " 1 object",
    )


def test_kept_glass_hides_as_well(file):
    whole, opaque = load_layers(file(house=(STONE, PANE), pane=(None, PANE)), transparent="keep")
    assert whole is opaque
    assert opaque_places(whole, opaque).tolist() == [WHOLE, WHOLE]
    assert whole.triangle_counts.tolist() == [24, 12]
    assert whole.warnings == ()


def test_without_glass_the_file_is_read_once(file, monkeypatch):
    read = []
    monkeypatch.setattr(
        scene_layers,
        "load_scene",
        lambda *given, **more: read.append(1) or load_scene(*given, **more),
    )
    path = file(house=(STONE, None))
    whole, opaque = load_layers(path)
    assert (whole is opaque, len(read)) == (True, 1)
    assert whole_scene(path, opaque) is opaque
    load_layers(file(house=(STONE, PANE)))
    assert len(read) == 3


def test_all_of_glass(file):
    path = file(pane=(None, PANE))
    whole, opaque = load_layers(path)
    assert (whole.names, opaque.names, opaque.bounds().shape) == (("pane",), (), (0, 2, 3))
    assert opaque_places(whole, opaque).tolist() == [NOTHING]


@pytest.mark.parametrize("transparent", ["leave-out", "keep"])
def test_nothing_at_all_is_refused(file, transparent):
    point = SimpleNamespace(vertices=np.zeros((3, 3)), faces=np.array([[0, 1, 2]]))
    with pytest.raises(EmptyMeshError):
        load_layers(file(point=(point, None)), transparent=transparent)
