"""Manifests: what they come to, and the line of what is wrong in them."""

from __future__ import annotations

import pytest

from simplifier.builds.asset_plan import plan_assets
from simplifier.builds.manifest import read_manifest
from simplifier.builds.outputs import Output, outputs_of
from simplifier.errors import ManifestError
from simplifier.io.formats import suffixes_with_quads
from simplifier.io.suffixes import OCCLUDER_SUFFIXES
from tests.builds.quick import TRIANGLE, write

CASCADE = """
[defaults]
budget = 32
resolution = 48
require = { min_recall = 0.5, max_triangles = 40 }

[[asset]]
files = ["props/**/*.obj", "trees/*.obj"]
exclude = "props/old/*"
ground = true

[[asset]]
files = "trees/*.obj"
error_bound = 0.25
output = "made/{name}.tres"
[asset.require]
min_recall = 0.1

[[asset]]
files = "trees/oak.obj"
lods = 3
output = ["{folder}/{name}_{suffix}.glb", "made/{folder}/{name}.obj"]
"""


def planned(folder, text, made=(), **meshes):
    return {
        one.name: one for one in plan_assets(read_manifest(write(folder, text, **meshes)), made)
    }


def test_later_blocks_count_over_earlier_ones_setting_by_setting(tmp_path):
    assets = planned(
        tmp_path, CASCADE, props__crate=TRIANGLE, props__old__crate=TRIANGLE, trees__fir=TRIANGLE,
        trees__oak=TRIANGLE, other__rock=TRIANGLE,
    )  # fmt: skip
    assert sorted(assets) == ["props/crate.obj", "trees/fir.obj", "trees/oak.obj"]
    crate, fir, oak = (assets[name] for name in sorted(assets))
    assert (crate.options.budget, crate.options.resolution, crate.options.ground) == (32, 48, True)
    assert crate.files == ("props/crate_occluder.glb",)
    assert crate.requirements.min_recall == 0.5
    assert (fir.options.resolution, fir.options.error_bound) == (None, 0.25)  # of two, the later
    assert (fir.requirements.min_recall, fir.requirements.max_triangles) == (0.1, 40)
    assert fir.files == ("made/fir.tres",)
    assert (oak.options.lods, oak.options.error_bound, oak.options.ground) == (3, 0.25, True)
    assert oak.files == ("trees/oak_obj.glb", "made/trees/oak.obj")


def test_an_output_says_how_it_is_written(tmp_path):
    text = """
[[asset]]
files = "*.obj"
output = ["{name}.tres", { file = "{name}.ply", sides = "single", as_quads = true },
          { file = "whole/{name}.glb", with_original = "godot" }]
"""
    plain, quads, whole = planned(tmp_path, text, a=TRIANGLE)["a.obj"].outputs
    assert plain == Output("a.tres")
    assert quads == Output("a.ply", "single", True, None)
    assert whole == Output("whole/a.glb", with_original="godot")
    assert [one.written for one in (plain, quads, whole)] == [
        {}, {"sides": "single", "as_quads": True}, {"with_original": "godot"}
    ]  # fmt: skip


def test_formats_with_quads_are_those_of_the_codecs():
    def taken(suffix):
        try:
            outputs_of("a.obj", [Output(f"b{suffix}", as_quads=True)], "here")
        except ManifestError:
            return False
        return True

    assert {one for one in OCCLUDER_SUFFIXES if taken(one)} == set(suffixes_with_quads())


BAD = {
    "an unknown table": ("[default]\nbudget = 3", 1, "'default' is not known; did you mean 'defa"),
    "no asset": ("[defaults]\nbudget = 3", 1, "there is no [[asset]]"),
    "one asset for many": ("[asset]\nfiles = 'a.obj'", 1, "there is no [[asset]]"),
    "no files": ("\n[[asset]]\nbudget = 3", 2, "names no files"),
    "a slip of the keyboard": ("[[asset]]\nfiles = '*.obj'\nbudgte = 3", 3, "mean 'budget'?"),
    "a hyphen": ("[[asset]]\nfiles = '*.obj'\nerror-bound = 3", 3, "mean 'error_bound'?"),
    "nothing like it": ("[[asset]]\nfiles = '*.obj'\nxyz = 3", 3, "choose from files, exclude"),
    "a value out of range": ("[[asset]]\nfiles='*.obj'\n\nbudget = 0", 4, "budget: 0 is out of"),
    "a value of another kind": (
        "[defaults]\nground = 1\n", 2, "ground: 1 is neither true nor false"
    ),
    "a requirement": (
        "[[asset]]\nfiles='*.obj'\n[asset.require]\nmin_recal = 1", 4, "mean 'min_recall'?"
    ),
    "a requirement's value": ("[defaults]\nrequire = { min_recall = 2 }", 2, "out of range"),
    "a requirement without a name": ("[defaults]\nrequire = 3", 2, "'require' is not a table"),
    "options that cannot go together": (
        "[[asset]]\nfiles='*.obj'\nmoves = 100\ntime_limit=8", 4, "together with moves"
    ),
    "options of several blocks that cannot go together": (
        "[defaults]\nfov = 50\n[[asset]]\nfiles='*.obj'", 2, "only levels of detail have one"
    ),
    "a glob that names nothing": (
        "[[asset]]\nfiles = [\n'*.obj',\n'*.glb']", 2, "'*.glb' names no mesh"
    ),
    "a file that is no mesh": ("[[asset]]\nfiles='occluders.toml'", 2, "names no mesh; correct"),
    "a pattern that leads out": ("[[asset]]\nfiles='../*.obj'", 2, "is not a path below"),
    "files that are no text": ("[[asset]]\nfiles=[3]", 2, "neither a text nor a list"),
    "an output that is shared": (
        "[[asset]]\nfiles='*.obj'\noutput='one.glb'", 3, "what both 'a.obj' and 'b.obj' become"
    ),
    "an output twice": (
        "[[asset]]\nfiles='a.obj'\noutput=['a.glb', './a.glb']", 3, "an output of 'a.obj' twice"
    ),
    "outputs that differ by case": (
        "[[asset]]\nfiles='a.obj'\noutput='x.glb'\n[[asset]]\nfiles='b.obj'\noutput='X.glb'", 6,
        "become"
    ),
    "an output that is a level of another": (
        "[[asset]]\nfiles='a.obj'\nlods=2\noutput='x.glb'\n"
        "[[asset]]\nfiles='b.obj'\noutput='x_lod1.glb'", 7, "become"
    ),
    "the mesh itself": ("[[asset]]\nfiles='*.obj'\noutput='{name}.obj'", 3, "is the mesh itself"),
    "another mesh": (
        "[[asset]]\nfiles=['a.obj', 'b.obj']\noutput='b.obj'", 2, "what another mesh becomes"
    ),
    "an output outside": ("[[asset]]\nfiles='a.obj'\noutput='../x.glb'", 3, "leads out of"),
    "an output with a NUL": ("[[asset]]\nfiles='a.obj'\noutput=\"\\u0000.glb\"", 3, "a NUL"),
    "an output of no format": ("[[asset]]\nfiles='a.obj'\noutput='x.png'", 3, "does not end as"),
    "an output without a name": ("[[asset]]\nfiles='a.obj'\noutput='x/.glb'", 3, "does not end as"),
    "an unknown field": ("[[asset]]\nfiles='a.obj'\noutput='{nam}.glb'", 3, "has no {nam}"),
    "an output that is no text": ("[defaults]\noutput=3", 2, "neither a text, a table"),
    "no output": ("[defaults]\noutput=[]", 2, "neither a text, a table"),
    "an output without a file": ("[defaults]\noutput={ sides='single' }", 2, "a table with a file"),
    "an unknown way to write": (
        "[[asset]]\nfiles='a.obj'\noutput=[\n'a.glb',\n{ file='a.ply', quads=true }]", 3,
        "'quads' is not known; did you mean 'as_quads'?"
    ),
    "a way to write of another kind": (
        "[defaults]\noutput={ file='a.ply', sides='both' }", 2, "sides: 'both' is"
    ),
    "a way to write that is said of no output": (
        "[[asset]]\nfiles='*.obj'\n\nas-quads = true", 4, "is said of an output; write as in: outp"
    ),
    "quads in a format without": (
        "[[asset]]\nfiles='a.obj'\noutput={ file='a.glb', as_quads=true }", 3, "without quads; end"
    ),
    "the original in a format without": (
        "[[asset]]\nfiles='a.obj'\noutput={ file='a.ply', with_original='lod' }", 3, "cannot hold"
    ),
    "levels with the original": (
        "[defaults]\nlods=2\noutput={ file='{name}.glb', with_original='lod' }\n"
        "[[asset]]\nfiles='a.obj'", 3, "levels of detail are not written with the original"
    ),
    "no TOML": ("[[asset]]\nfiles = '*.obj\n", 2, "is no TOML"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_what_is_wrong_is_said_with_its_line(tmp_path, case):
    text, line, words = BAD[case]
    with pytest.raises(ManifestError) as refused:
        planned(tmp_path, text, a=TRIANGLE, b=TRIANGLE)
    assert str(refused.value).startswith(f"{tmp_path / 'occluders.toml'}:{line}: ")
    assert words in str(refused.value)
    assert refused.value.remedy


def test_a_missing_manifest_is_refused(tmp_path):
    with pytest.raises(ManifestError, match="there is no such file"):
        read_manifest(tmp_path / "occluders.toml")


def test_outputs_that_a_glob_names_are_no_meshes(tmp_path):
    text = "[[asset]]\nfiles='**/*'\noutput='{folder}/{name}_occluder.obj'"
    meshes = dict.fromkeys(["a", "a_occluder"], TRIANGLE)
    assert list(planned(tmp_path, text, **meshes)) == ["a.obj"]


def test_levels_that_a_glob_names_are_no_meshes(tmp_path):
    text = "[[asset]]\nfiles='*'\nlods=2\noutput='{folder}/{name}_occluder.obj'"
    meshes = dict.fromkeys(["a", "a_occluder_lod0", "a_occluder_lod1", "b_lod0"], TRIANGLE)
    assert list(planned(tmp_path, text, **meshes)) == ["a.obj", "b_lod0.obj"]


def test_what_was_made_of_a_mesh_that_is_gone_is_no_mesh(tmp_path):
    meshes = dict.fromkeys(["a", "gone_occluder"], TRIANGLE)
    text = "[[asset]]\nfiles='*.obj'"
    assert list(planned(tmp_path, text, ["gone_occluder.obj"], **meshes)) == ["a.obj"]


def test_outputs_in_a_circle_are_refused(tmp_path):
    text = "[[asset]]\nfiles='*a.obj'\noutput='b.obj'\n[[asset]]\nfiles='*b.obj'\noutput='a.obj'"
    with pytest.raises(ManifestError):
        planned(tmp_path, text, a=TRIANGLE, b=TRIANGLE)
