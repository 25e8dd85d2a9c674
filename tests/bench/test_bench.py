"""Tiny runs of the benchmarks: files are well formed, generated meshes are what they say."""

from __future__ import annotations

import subprocess
from dataclasses import replace

import numpy as np
import pytest
import trimesh

import simplifier
from bench import (
    choices,
    decimated,
    growth,
    kernels,
    libraries,
    lods,
    meshes,
    methods,
    point,
    quality,
    rates,
    record,
    scene,
    speed,
    times,
    tradeoff,
)
from bench.methods import OURS
from bench.peers import PEERS, SLOW_PEERS, missing, occluder_from, prepared
from simplifier.options.stages import PRESETS

HEADER = ("command: ", "machine: ", "versions: ", "on: ")


@pytest.fixture
def tiny_stand_in(tmp_path, monkeypatch):
    """A generated solid in place of the bunny; the other four stand-ins are absent."""
    monkeypatch.setattr(meshes, "ASSETS", tmp_path)
    solid = meshes.bumpy_sphere(200)
    bunny = meshes.STAND_INS[0]
    simplifier.save(simplifier.Occluder(solid.vertices, solid.faces), tmp_path / bunny.file)
    return bunny


@pytest.fixture
def few_moves(monkeypatch):
    """Presets that are done soon."""
    for name, effort in PRESETS.items():
        monkeypatch.setitem(PRESETS, name, replace(effort, moves=effort.moves // 100))


def check_table(path, command):
    table = record.read_table(path)
    assert [line.split(" ")[0] + " " for line in table.remarks[:4]] == list(HEADER)
    assert table.remarks[0] == f"command: {command}"
    assert len(set(table.columns)) == len(table.columns)
    assert table.rows
    assert all(len(row) == len(table.columns) for row in table.rows)
    return [dict(zip(table.columns, row, strict=True)) for row in table.rows]


@pytest.mark.parametrize("make", [meshes.bumpy_sphere, meshes.cube])
@pytest.mark.parametrize("triangles", [48, 50, 106, 1000, 3002])
def test_generated_solids_are_closed_and_have_the_count(make, triangles):
    mesh = make(triangles)
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert len(mesh.faces) == triangles
    assert solid.is_watertight
    assert solid.is_winding_consistent
    assert solid.volume > 3.0
    assert mesh.dropped.total == 0


def test_cube_is_the_cube():
    mesh = meshes.cube(1000)
    assert np.array_equal(mesh.bounds, [[-1.0] * 3, [1.0] * 3])
    assert trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).volume == pytest.approx(8.0)


@pytest.mark.parametrize("triangles", [46, 49, 0])
def test_counts_that_cannot_be_are_refused(triangles):
    with pytest.raises(ValueError, match="even number of 48"):
        meshes.bumpy_sphere(triangles)


@pytest.mark.parametrize("name", ["bumpy", "bumpy-", "cube-x", "sphere-48", ""])
def test_unknown_meshes_are_refused(name):
    with pytest.raises(ValueError, match="no mesh"):
        meshes.mesh_named(name)


def test_meshes_by_name():
    assert len(meshes.mesh_named("bumpy-100").faces) == 100
    assert len(meshes.mesh_named("castle").faces) > 10_000
    assert all(meshes.stand_in_named(item.name) is item for item in meshes.STAND_INS)


def test_table_goes_there_and_back(tmp_path):
    rows = [{"a": 1.23456, "b": "x, y"}, {"a": 123456.7, "c": None, "b": "# no remark"}]
    record.write_table(tmp_path / "new" / "x_y.csv", rows, "me", "a remark")
    table = record.read_table(tmp_path / "new" / "x_y.csv")
    assert table.columns == ("a", "b", "c")
    assert table.rows == (("1.235", "x, y", ""), ("123457", "# no remark", ""))
    assert table.remarks[-1] == "a remark"
    page = record.write_page(tmp_path / "new", "x", ("absent", "y")).read_text()
    assert "## y\n" in page
    assert "absent" not in page
    assert "| 1.235 | x, y |  |" in page


@pytest.mark.slow
def test_point_measures_its_own_process_only():
    simplifier.warm_up()  # a process that compiles kernels takes twice the memory
    ballast = np.ones(60_000_000)  # 460 MiB that must not count
    measured = point.measure("simplify", "bumpy-100", 2, budget=4, resolution=8, preset="draft")
    assert ballast.nbytes / 2**20 > 400
    assert measured.triangles == 100
    assert len(measured.seconds) == 2
    assert 0.0 < sum(measured.stages.values()) <= measured.summary["max_s"]
    # So little work may need less than what went before it; pages of that are given back.
    assert 20.0 < measured.before_mib < measured.work_mib + 1.0
    assert measured.work_mib <= measured.process_mib < 400.0


def test_point_in_this_process_tells_the_accuracy_too():
    options = {"simplify": {"budget": 4, "resolution": 8}, "views": 2, "image": 16, "exact": True}
    measured = point.measured_here("evaluate", "bumpy-100", 1, options)
    assert measured.stages == {}
    assert measured.summary["min_s"] == measured.summary["median_s"] > 0.0


def test_failed_command_is_no_measurement(tmp_path):
    with pytest.raises(subprocess.CalledProcessError):
        point.measure_command("simplify", str(tmp_path / "absent.ply"), "-o", "x.obj")


def test_growth_writes_slopes_and_a_picture(tmp_path, monkeypatch):
    seconds = {100: 1.0, 400: 4.0, 1600: 64.0}

    def measured(work, mesh, repeats, **options):
        count = int(mesh.removeprefix("bumpy-"))
        took = [seconds[count]] * repeats
        return point.Measurement(count, took, {"cut": 0.5 * took[0]}, 10.0, 20.0, 30.0)

    monkeypatch.setattr(growth, "measure", measured)
    monkeypatch.setattr(speed, "reference_seconds", lambda: 0.5)
    tiny = growth.Growth("triangles", tuple(seconds), ("bumpy",))
    monkeypatch.setitem(speed.GROWTHS, "growth_triangles", tiny)
    path = speed.run_part("growth_triangles", tiny.rows, 2, tmp_path, "me")
    rows = check_table(path, "me")
    assert [row["slope"] for row in rows] == ["", "1", "2"]
    assert [row["extra_mib"] for row in rows] == ["10", "10", "10"]
    assert [row["ratio"] for row in rows] == ["2", "8", "128"]
    assert path.with_suffix(".png").read_bytes()[:4] == b"\x89PNG"
    assert any("time grows as triangles to the power of 1.50" in line for line in
               record.read_table(path).remarks)  # fmt: skip


def test_fitted_slope_of_a_power():
    rows = [{"mesh": "m", "budget": n, "median_s": 3.0 * n**1.5} for n in (8, 16, 64)]
    assert growth.fitted_slopes(rows, "budget", "median_s")["m"] == pytest.approx(1.5)


@pytest.mark.slow
@pytest.mark.usefixtures("few_moves")
def test_occluder_times_skip_what_is_absent(tiny_stand_in, tmp_path, monkeypatch):
    def measured(work, mesh, repeats, **options):
        return point.measured_here(work, mesh, repeats, {**options, "resolution": 8})

    monkeypatch.setattr(times, "measure", measured)
    rows = check_table(speed.run_part("stand_ins", times.occluder_times, 1, tmp_path, "me"), "me")
    assert [row["preset"] for row in rows] == ["draft", "balanced", "best", *4 * [""]]
    assert rows[0]["target"] in ("met", "not met")
    assert float(rows[0]["cut_s"]) > 0.0
    assert all(row["note"].startswith("skipped: ") for row in rows[3:])


@pytest.mark.slow
@pytest.mark.usefixtures("few_moves")
def test_limits_tell_time_and_recall(tiny_stand_in, tmp_path, monkeypatch):
    monkeypatch.setattr(times, "LIMITS", (0.001, 0.1))
    rows = check_table(speed.run_part("limits", times.limit_times, 1, tmp_path, "me"), "me")
    assert [row["limit_s"] for row in rows[:2]] == ["0.001", "0.1"]
    assert rows[0]["limit"] == "met"  # by what it took itself
    assert all(float(row["allowed_s"]) >= float(row["limit_s"]) for row in rows[:2])
    assert all(0.0 < float(row["recall"]) <= 1.0 for row in rows[:2])
    assert all(row["note"].startswith("skipped: ") for row in rows[3:])


def test_kernel_row_is_well_formed(monkeypatch):
    monkeypatch.setattr(rates, "_TIMINGS", 1)
    (row,) = kernels._slicing()
    assert row["units"] > 0
    assert row["times_floor"] == pytest.approx(row["ns"] / row["floor_ns"])


@pytest.mark.slow
@pytest.mark.usefixtures("few_moves")
def test_quality_rows(tiny_stand_in, tmp_path, monkeypatch):
    quick = {OURS: {"preset": "draft"}, "area": {"preset": "draft", "moves": 0, "trim": "area"}}
    monkeypatch.setattr(methods, "_VARIANTS", quick)
    rows = list(quality.stand_in_rows((tiny_stand_in,), views=4))
    record.write_table(tmp_path / "quality_x.csv", rows, "me")
    read = check_table(tmp_path / "quality_x.csv", "me")
    ours = next(row for row in read if row["method"] == OURS)
    assert ours["floor_is"] in ("met", "not met")
    assert int(ours["triangles"]) <= tiny_stand_in.budget
    assert all(0.0 <= float(row["recall"] or 0.0) <= 1.0 for row in read)
    assert {row["method"] for row in read} == {*quick, *PEERS}


@pytest.mark.slow
@pytest.mark.usefixtures("few_moves")
def test_quality_over_seeds_and_assets(tiny_stand_in, tmp_path):
    rows = list(quality.seed_rows(2, (tiny_stand_in,), views=4, image=32, quads=100))
    assert [row["figure"] for row in rows] == ["precision", "recall"]
    assert all(row["least"] <= row["mean"] <= row["most"] for row in rows)
    (tmp_path / "broken.obj").write_text("v 0 0 0\n")
    (tmp_path / "notes.txt").write_text("no mesh")
    found = {row["mesh"]: row for row in quality.asset_rows(sorted(tmp_path.iterdir()), views=4)}
    assert found.keys() == {"broken", "bunny_4968"}
    assert found["broken"]["note"].startswith("refused: ")


@pytest.mark.slow
@pytest.mark.usefixtures("few_moves")
def test_tradeoff_replaces_what_was_measured_and_nothing_else(tiny_stand_in, tmp_path, monkeypatch):
    docs, results = tmp_path / "docs", tmp_path / "results"
    (docs / "images").mkdir(parents=True)
    results.mkdir()
    monkeypatch.setattr(tradeoff, "DOCS", docs)
    monkeypatch.setattr(tradeoff, "RESULTS", results)
    page = docs / "tradeoff.md"
    page.write_text(f"before\n{tradeoff.BEGIN}\nold\n{tradeoff.END}\nafter\n")
    base = tradeoff.TradeoffOptions(
        resolutions=(8,), directions=(4,), budgets=(8,), times=(0.05,), repeats=1
    )
    tradeoff.measure([tiny_stand_in], base, "me")
    text = page.read_text()
    assert text.startswith(f"before\n{tradeoff.BEGIN}\n\n- command: me\n- machine: ")
    assert text.endswith(f"\n\n{tradeoff.END}\nafter\n")
    assert "old" not in text
    assert "| resolution 8 | " in text
    assert (docs / "images" / "tradeoff_bunny_4968.png").read_bytes()[:4] == b"\x89PNG"
    assert (results / "tradeoff_bunny_4968.csv").read_text().count("\n") == 7


@pytest.mark.parametrize("name", PEERS)
def test_peers_keep_the_place_and_size_of_the_mesh(name):
    if missing(name):
        pytest.skip(missing(name))
    ball = meshes.bumpy_sphere(2000)
    mesh = replace(ball, vertices=ball.vertices * 30.0 + 1000.0)
    ready = prepared(mesh)
    budget = 12 if name in SLOW_PEERS else 100
    made = PEERS[name](ready.vertices.copy(), ready.faces.astype(np.int64), budget)
    occluder = occluder_from(made, mesh)
    assert 0 < len(occluder.faces) <= budget
    assert np.allclose(occluder.vertices.mean(axis=0), mesh.vertices.mean(axis=0), atol=10.0)
    turned = 0.7 if "boxes" in name else 0.3  # the box of a ball may stand on a corner
    assert np.ptp(occluder.vertices, axis=0) == pytest.approx(mesh.extent, rel=turned)


@pytest.mark.slow
@pytest.mark.usefixtures("few_moves")
def test_scene(tiny_stand_in, monkeypatch, capsys):
    small = {"resolution": 12, "preset": "draft"}
    names = ("conservative, exact outlines", "shrink by a fiftieth")
    variants = {name: {**scene.VARIANTS[name], **small} for name in names}
    monkeypatch.setattr(scene, "VARIANTS", variants)
    scene.main(resolutions=(8,))
    recalls, times = capsys.readouterr().out.strip().split("\n\n")
    assert [row.count("at 100.00%") for row in recalls.splitlines()] == [0, 0, 2, 2]
    assert recalls.splitlines()[0] == "| variant | bumpy sphere | bunny_4968 |"
    assert times.splitlines()[-1].startswith("| 8 | ")


@pytest.mark.parametrize("name", choices.VARIANTS)
def test_each_choice_is_one_of_the_search(name):
    """One that was renamed there used to end the table with a traceback."""
    mesh, changes = meshes.bumpy_sphere(48), choices.VARIANTS[name]
    plain, varied = (choices.varied(mesh, {"budget": 8}, one) for one in ({}, changes))
    constants = choices.CONSTANTS.keys() & changes
    assert varied != plain or constants or name == "refined, balanced"
    for constant in constants:
        assert getattr(choices.CONSTANTS[constant], constant) != changes[constant]


@pytest.mark.slow
@pytest.mark.usefixtures("few_moves")
def test_decimated_starts_of_a_tiny_stand_in(tiny_stand_in, monkeypatch, capsys):
    monkeypatch.setattr(decimated, "BUDGETS", (4,))
    monkeypatch.setattr(decimated, "MOVES", (60,))
    options = {"up": "y", "ground": True}
    scenes = [decimated.Scene.load(tiny_stand_in.path, options)]
    decimated.decimators(scenes)
    decimated.starts(scenes)
    lines = capsys.readouterr().out.splitlines()
    rows = [line.split(" | ") for line in lines if line.startswith("| bunny_4968")]
    assert [row[1] for row in rows[:2]] == ["enclosed", "sheet"]
    assert [row[2] for row in rows[2:]] == ["sections", "enclosed", "sheet"]


@pytest.mark.slow
@pytest.mark.usefixtures("few_moves")
def test_levels_of_a_tiny_stand_in(tiny_stand_in, capsys):
    words = ["--lods", "2", "--resolution", "8", "--budget", "8", "--views", "4"]
    lods.main([str(tiny_stand_in.path), *words])
    header, rule, *rows = capsys.readouterr().out.splitlines()
    assert len(rows) == 2
    assert rows[0].startswith("| bunny_4968, ")
    assert all(row.count("|") == header.count("|") == rule.count("|") for row in rows)
    kept = [row.split(" | ") for row in rows if row.endswith(" |  |")]
    assert kept
    assert all(float(row[3]) >= float(row[4]) >= 0.0 for row in kept)


def test_inner_boxes_of_an_open_ball_hide_nothing_wrongly():
    ball = meshes.bumpy_sphere(2000)
    open_ball = replace(ball, faces=ball.faces[:-6])
    recalls = []
    for budget in (12, 256):
        points, faces = PEERS["inner boxes"](open_ball.vertices, open_ball.faces, budget)
        assert len(faces) <= budget
        occluder = simplifier.Occluder(points, faces.astype(np.int32))
        found = simplifier.evaluate(ball, occluder, views=16, image=128, exact=True)
        assert (found.precision, found.overhang.mean) == (1.0, 0.0)
        recalls.append(found.recall)
    assert 0.1 < recalls[0] < recalls[1]


@pytest.fixture(scope="module")
def small_dragon(tmp_path_factory):
    """A folder with a generated solid in place of the dragon."""
    folder = tmp_path_factory.mktemp("libraries")
    solid = meshes.bumpy_sphere(400)
    trimesh.Trimesh(solid.vertices, solid.faces, process=False).export(folder / "dragon.ply")
    return folder


@pytest.mark.parametrize(
    ("what", "name"),
    [(what, name) for what, cases in libraries.CASES.items() for name in cases],
)
def test_libraries_do_what_they_are_compared_in(small_dragon, monkeypatch, what, name):
    pytest.importorskip("skimage" if name == "scikit-image" else "trimesh")
    monkeypatch.setattr(libraries, "DRAGON", small_dragon / "dragon.ply")
    found = libraries.CASES[what][name](libraries.INPUTS[what](small_dragon))
    assert int(found.split()[0]) > 0, found
