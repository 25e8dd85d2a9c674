"""The original and its occluder in one file: nothing of the original lost, nothing twice."""

from __future__ import annotations

import json
import math
from functools import reduce
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from simplifier.errors import OutputError, UnreadableMeshError
from simplifier.io.glb_embed import check_place, embed_occluder, save_with_original
from simplifier.io.gltf_container import pack_glb
from simplifier.io.load import load
from simplifier.options.simplify import Style
from tests.io.builders import (
    TETRAHEDRON_FACES,
    TETRAHEDRON_POINTS,
    GltfBuilder,
    tetrahedron,
    tetrahedron_gltf,
    valid_files,
)
from tests.io.test_glb_writer import take_apart

HOWS = ["godot", "lod"]


def original(tmp_path: Path, name: str = "glb") -> Path:
    suffix, data = valid_files()[name]
    path = tmp_path / f"rock{suffix}"
    path.write_bytes(data)
    return path


def rich(tmp_path: Path) -> Path:
    """Two roots, a picture, an animation, names and extras, levels of its own."""
    builder = GltfBuilder()
    first = builder.node(mesh=builder.mesh(TETRAHEDRON_POINTS, TETRAHEDRON_FACES), name="a")
    second = builder.node(mesh=0, translation=[5.0, 0.0, 0.0], extras={"kept": [1, None]})
    builder.root |= {
        "scenes": [{"nodes": [first, second], "name": "yard"}], "scene": 0,
        "images": [{"uri": "data:image/png;base64,AAAA"}], "textures": [{"source": 0}],
        "animations": [{"channels": [], "samplers": [], "name": "still"}],
        "extensionsUsed": ["KHR_materials_unlit"],
    }  # fmt: skip
    path = tmp_path / "yard.glb"
    path.write_bytes(builder.glb())
    return path


@pytest.mark.parametrize("how", HOWS)
@pytest.mark.parametrize("name", [name for name in valid_files() if name != "occ"])
def test_any_original_loads_as_before(tmp_path: Path, name: str, how: str) -> None:
    path = original(tmp_path, name)
    mesh = load(path)
    output = tmp_path / "both.glb"
    occluder = tetrahedron(0.5)
    save_with_original(path, mesh, occluder, output, how)
    document, _ = take_apart(output.read_bytes())
    node = document["nodes"][-1]
    assert node["extras"]["error_bound"] == 0.5
    assert node["name"] == ("rock-occonly" if how == "godot" else "rock_lod")
    roots = document["scenes"][document["scene"]]["nodes"]
    assert ((len(document["nodes"]) - 1) in roots) == (how == "godot")
    if how == "lod":
        (root,) = roots
        levels = document["nodes"][root]["extensions"]["MSFT_lod"]["ids"]
        assert levels == [len(document["nodes"]) - 1]
        again = load(output)  # coarser levels are no geometry of the finest
        np.testing.assert_allclose(again.vertices[again.faces], mesh.vertices[mesh.faces])


@pytest.mark.parametrize("how", HOWS)
@pytest.mark.parametrize("scenes", [{}, {"scenes": [{"name": "empty"}], "scene": 0}])
@pytest.mark.parametrize("count", [1, 2])
def test_meshes_without_nodes_get_some_and_lose_them_again(
    tmp_path: Path, how: str, scenes: dict, count: int
) -> None:
    builder = GltfBuilder()
    for _ in range(count):
        builder.mesh(TETRAHEDRON_POINTS, TETRAHEDRON_FACES)
    builder.root |= scenes
    path = tmp_path / "library.glb"
    path.write_bytes(builder.glb())
    mesh = load(path)
    both = tmp_path / "both" / "library.glb"
    both.parent.mkdir()
    both.write_bytes(embed_occluder(path, mesh, tetrahedron(), how))
    again = load(both)
    assert again.vertices.tobytes() == mesh.vertices.tobytes()
    assert again.faces.tobytes() == mesh.faces.tobytes()
    second = embed_occluder(both, again, tetrahedron(), how)
    assert take_apart(second) == take_apart(both.read_bytes())


@pytest.mark.parametrize("how", HOWS)
def test_all_of_the_original_is_there(tmp_path: Path, how: str) -> None:
    path = rich(tmp_path)
    before, binary = take_apart(path.read_bytes())
    after, longer = take_apart(embed_occluder(path, load(path), tetrahedron(), how))
    assert longer.startswith(binary)
    for key in ("images", "textures", "animations", "asset"):
        assert after[key] == before[key]
    for key in ("meshes", "accessors", "bufferViews"):
        assert after[key][: len(before[key])] == before[key]
    kept = after["nodes"][: len(before["nodes"])]
    assert kept == before["nodes"]
    assert set(before["extensionsUsed"]) <= set(after["extensionsUsed"])


@pytest.mark.parametrize("first", HOWS)
@pytest.mark.parametrize("second", HOWS)
@pytest.mark.parametrize("name", ["rich", "glb", "gltf"])
def test_an_earlier_occluder_is_replaced(
    tmp_path: Path, name: str, first: str, second: str
) -> None:
    path = rich(tmp_path) if name == "rich" else original(tmp_path, name)
    mesh = load(path)
    once = path.with_suffix(".glb")
    fresh = embed_occluder(path, mesh, tetrahedron(0.25), second)
    once.write_bytes(embed_occluder(path, mesh, tetrahedron(0.5), first))
    assert embed_occluder(once, mesh, tetrahedron(0.25), second) == fresh


def test_a_viewer_sees_both(tmp_path: Path) -> None:
    path = rich(tmp_path)
    (tmp_path / "both.glb").write_bytes(embed_occluder(path, load(path), tetrahedron(), "godot"))
    scene = trimesh.load(tmp_path / "both.glb")
    assert "yard-occonly" in scene.graph.nodes
    transform, name = scene.graph["yard-occonly"]
    shown = trimesh.transform_points(scene.geometry[name].vertices, transform)
    np.testing.assert_allclose(np.unique(shown, axis=0), np.unique(TETRAHEDRON_POINTS, axis=0))


def test_single_sided_in_the_original(tmp_path: Path) -> None:
    path = original(tmp_path)
    output = tmp_path / "both.glb"
    save_with_original(path, load(path), tetrahedron(), output, "godot", Style("single"))
    document, _ = take_apart(output.read_bytes())
    assert document["materials"][-1]["doubleSided"] is False


def test_files_beside_the_original_have_to_stay_beside_it(tmp_path: Path) -> None:
    suffix, data = valid_files()["gltf"]
    document = json.loads(data)
    document["buffers"][0]["uri"] = "rock.bin"
    path = tmp_path / f"rock{suffix}"
    path.write_text(json.dumps(document))
    check_place(path, tmp_path / "both.glb")
    (tmp_path / "other").mkdir()
    with pytest.raises(OutputError, match=r"refers to 'rock\.bin'"):
        check_place(path, tmp_path / "other" / "both.glb")
    with pytest.raises(OutputError, match=r"only \.glb"):
        check_place(path, tmp_path / "both.obj")


def rock(tmp_path: Path, **changed: Any) -> Path:
    """A GLB of a tetrahedron, members of its JSON changed."""
    builder = tetrahedron_gltf()
    builder.root |= changed
    path = tmp_path / "rock.glb"
    path.write_bytes(builder.glb())
    return path


DAMAGES: dict[str, dict[str, Any]] = {
    "a scene that is none": {"scenes": 7},
    "a node that is not there": {"scenes": [{"nodes": [2]}]},
    "no array of nodes": {"scenes": [{"nodes": 5}]},
    "no array of materials": {"materials": "none"},
    "an array of nothing": {"materials": None},
    "extensions by number": {"extensionsUsed": 3},
    "NaN": {"extras": math.nan},
    "lists in lists": {"extras": reduce(lambda inner, _: [inner], range(700), [])},
}


@pytest.mark.parametrize("name", DAMAGES)
def test_an_original_that_is_read_and_cannot_be_added_to(tmp_path: Path, name: str) -> None:
    """Reading passes over what it does not need; adding to it was a traceback."""
    path = rock(tmp_path, **DAMAGES[name])
    with pytest.raises(UnreadableMeshError, match="nothing can be added; export it again"):
        embed_occluder(path, load(path), tetrahedron(), "lod")


def test_a_coverage_that_is_no_list_stays(tmp_path: Path) -> None:
    extras = {"MSFT_screencoverage": 0.5}
    path = rock(tmp_path, nodes=[{"mesh": 0, "extras": extras}])
    document, _ = take_apart(embed_occluder(path, load(path), tetrahedron(), "lod"))
    assert document["nodes"][0]["extras"] == extras


@pytest.mark.parametrize("change", [{"nodes": "many"}, {"root": [0]}], ids=str)
def test_what_another_program_changed_is_refused(tmp_path: Path, change: dict[str, Any]) -> None:
    path = original(tmp_path)
    mesh = load(path)
    document, binary = take_apart(embed_occluder(path, mesh, tetrahedron(), "godot"))
    document["nodes"][-1]["extras"]["before"] |= change
    path.write_bytes(pack_glb(document, binary))
    with pytest.raises(UnreadableMeshError, match="changed by another program"):
        embed_occluder(path, mesh, tetrahedron(), "godot")
