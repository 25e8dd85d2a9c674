"""Levels of detail through the real command line."""

from __future__ import annotations

import json

import pytest

import simplifier
from simplifier.wording import length
from tests.schema import check_report
from tests.solids import blob, box

QUICK = (
    "--resolution", "32", "--preset", "draft", "--moves", "300", "--budget", "32",
    "--overhang", "0.05", "--front", "0.02",
)  # fmt: skip
FEW_VIEWS = ("--views", "8", "--image", "32", "--exact")


@pytest.fixture
def mesh(tmp_path):
    folder = tmp_path / "in"
    folder.mkdir()
    shape = blob()
    simplifier.save(simplifier.Occluder(shape.vertices, shape.faces), folder / "blob.ply")
    return folder / "blob.ply"


@pytest.fixture
def out(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    return folder


def check_levels(report, count):
    """Rows in order, each as good as it says, and the top describes the finest."""
    check_report(report)
    rows = report["levels"]
    assert len(rows) + len(report["left_out"]) == count
    assert [row["level"] for row in rows] == list(range(len(rows)))
    for key in ("error_bound", "switch_distance"):
        values = [row[key] for row in rows]
        assert values == sorted(set(values))
    assert [row["triangles"] for row in rows] == sorted(
        (row["triangles"] for row in rows), reverse=True
    )
    assert all(row["deviation"] <= row["error_bound"] for row in rows)
    for key in ("triangles", "error_bound", "deviation", "precision", "recall"):
        assert report[key] == rows[0][key], key


def test_levels_by_number(here, mesh, out, tmp_path):
    done = here(
        "simplify", mesh, "-o", out / "blob.glb", "--lods", "3", *QUICK, *FEW_VIEWS,
        "--report", tmp_path / "report.json", "--pictures", tmp_path / "pictures",
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    report = json.loads((tmp_path / "report.json").read_text(), parse_constant=pytest.fail)
    check_levels(report, 3)
    assert len(report["levels"]) >= 2
    assert report["options"]["lods"] == {
        "lods": 3, "error_bounds": None, "pixel_error": 1.0, "screen_height": 1080, "fov": 60.0,
    }  # fmt: skip
    assert "levels of detail" in done.stdout
    # In full where no terminal is: "3.6..." tells no error bound.
    assert "error bound" in done.stdout
    assert all(length(row["error_bound"]) in done.stdout for row in report["levels"])
    assert f"0 to {length(report['levels'][1]['switch_distance'])}" in done.stdout
    page = (tmp_path / "pictures" / "report.html").read_text()
    assert "Levels of detail" in page
    chain = simplifier.load_lods(out / "blob.glb")
    assert {path.name for path in out.iterdir()} == {
        "blob.glb", *(row["file"] for row in report["levels"])
    }  # fmt: skip
    for index, (row, level) in enumerate(zip(report["levels"], chain.levels, strict=True)):
        assert row["file"] == f"blob_lod{index}.glb"
        assert row["triangles"] == level.triangles
        assert row["triangles"] == len(simplifier.load(out / row["file"]).faces)
        assert row["error_bound"] == level.error_bound
        assert row["switch_distance"] == chain.switch_distance(index)
    assert len(simplifier.load(out / "blob.glb").faces) == report["triangles"]


def test_a_level_is_judged_as_its_report_says(command, mesh, out, tmp_path):
    words = ("--report", tmp_path / "report.json", *FEW_VIEWS)
    run = ("simplify", mesh, "-o", out / "blob.glb", "--lods", "2", *QUICK, *words)
    status, shown, _ = command(*run)
    assert status == 0
    rows = json.loads((tmp_path / "report.json").read_text())["levels"]
    begin = length(rows[1]["switch_distance"])
    assert f"level 0: use from 0 to {begin} units; beyond, level 1\n" in shown
    for row in rows:
        size = ("--resolution", str(row["resolution"]))
        assert command("evaluate", mesh, out / row["file"], *size, *words)[0] == 0
        judged = json.loads((tmp_path / "report.json").read_text())
        assert judged["recall"] == pytest.approx(row["recall"], abs=1e-3)
        assert judged["precision"] == pytest.approx(row["precision"], abs=1e-3)
        assert judged["error_bound"] == row["error_bound"]
        assert judged["deviation"] <= row["error_bound"]
        assert judged["levels"] == []


@pytest.mark.slow
def test_levels_by_bounds_in_any_order(command, mesh, out, tmp_path):
    files = []
    for number, bounds in enumerate(("0.3,1.2,0.6", "1.2,0.6,0.3")):
        report = tmp_path / f"{number}.json"
        status, _, errors = command(
            "simplify", mesh, "-o", out / f"{number}.glb", "--error-bounds", bounds,
            *QUICK[2:], *FEW_VIEWS, "--report", report, "--pixel-error", "4",
            "--screen-height", "720", "--fov", "90",
        )  # fmt: skip
        assert (status, errors) == (0, "")
        made = json.loads(report.read_text())
        check_levels(made, 3)
        assert made["options"]["lods"]["error_bounds"] == [0.3, 0.6, 1.2]
        for row in made["levels"]:
            assert any(row["error_bound"] <= bound for bound in (0.3, 0.6, 1.2))
            assert row["switch_distance"] == pytest.approx(row["error_bound"] * 360 / 4)
        files.append((out / f"{number}.glb").read_bytes())
    assert files[0] == files[1]


def test_a_box_needs_no_further_levels(command, out, tmp_path):
    solid = box()
    simplifier.save(simplifier.Occluder(solid.vertices, solid.faces), tmp_path / "box.ply")
    status, output, errors = command(
        "simplify", tmp_path / "box.ply", "-o", out / "box.glb", "--lods", "3", *FEW_VIEWS,
        "--report", tmp_path / "report.json",
    )  # fmt: skip
    assert (status, errors) == (0, "")
    report = json.loads((tmp_path / "report.json").read_text())
    check_levels(report, 3)
    assert [one["resolution"] for one in report["left_out"]] == [32, 16]
    assert output.count("left out: ") == 2
    assert {path.name for path in out.iterdir()} == {"box.glb", "box_lod0.glb"}


def test_other_formats_and_stale_levels(command, mesh, out):
    (out / "blob_lod7.obj").write_text("stale")
    (out / "blob_lod7.ply").write_text("of another format")
    status, _, errors = command(
        "simplify", mesh, "-o", out / "blob.obj", "--lods", "2", *QUICK, *FEW_VIEWS
    )
    assert (status, errors) == (0, "")
    names = {path.name for path in out.iterdir()}
    assert names <= {"blob_lod0.obj", "blob_lod1.obj", "blob_lod7.ply"}
    assert "blob_lod0.obj" in names
    assert "blob_lod7.ply" in names


def test_the_same_bytes_on_any_number_of_threads(mesh, out, here, monkeypatch):
    contents = []
    for threads in ("1", "4"):
        monkeypatch.setenv("OCCLUDER_THREADS", threads)
        done = here("simplify", mesh, "-o", out / "blob.glb", "--lods", "3", *QUICK, *FEW_VIEWS)
        assert done.returncode == 0
        contents.append({path.name: path.read_bytes() for path in out.iterdir()})
    assert contents[0] == contents[1]


WRONG = {
    "both": ("--lods", "2", "--error-bounds", "1,2"),
    "bounds and resolution": ("--error-bounds", "1,2", "--resolution", "9"),
    "bounds and bound": ("--error-bounds", "1,2", "--error-bound", "1"),
    "none": ("--lods", "0"),
    "too many": ("--lods", "17"),
    "no number": ("--lods", "few"),
    "no lengths": ("--error-bounds", "near,far"),
    "no length": ("--error-bounds", ""),
    "length 0": ("--error-bounds", "0,1"),
    "length below 0": ("--error-bounds", "1,-1"),
    "length NaN": ("--error-bounds", "nan,1"),
    "length infinite": ("--error-bounds", "inf,1"),
    "the same twice": ("--error-bounds", "1,2,1.0"),
    "too many lengths": ("--error-bounds", ",".join(map(str, range(1, 18)))),
    "bound too fine": ("--error-bounds", "1e-9,1"),
    "pixels": ("--lods", "2", "--pixel-error", "0"),
    "pixels NaN": ("--lods", "2", "--pixel-error", "nan"),
    "screen": ("--lods", "2", "--screen-height", "0"),
    "field of view": ("--lods", "2", "--fov", "180"),
    "pixels for nothing": ("--pixel-error", "2"),
    "screen for nothing": ("--screen-height", "720"),
    "field of view for nothing": ("--fov", "60"),
    "wholly inside": ("--lods", "2", "--conservative"),
    "shrunk": ("--lods", "2", "--shrink", "0.1"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_usage(command, mesh, out, name):
    status, output, errors = command("simplify", mesh, "-o", out / "blob.glb", *WRONG[name])
    assert (status, output) == (2, "")
    assert errors.startswith("error: ")
    assert errors.count("\n") == 1
    assert "; " in errors
    assert list(out.iterdir()) == []


@pytest.mark.parametrize("name", ["castle_lod0.ply", "castle_lod9.ply"])
def test_a_mesh_that_a_level_would_replace(command, tmp_path, name):
    shape = box()
    simplifier.save(simplifier.Occluder(shape.vertices, shape.faces), tmp_path / name)
    before = (tmp_path / name).read_bytes()
    status, _, errors = command(
        "simplify", tmp_path / name, "-o", tmp_path / "castle.ply", "--lods", "2"
    )
    assert status == 1
    assert "would replace or remove the mesh itself" in errors
    assert (tmp_path / name).read_bytes() == before
