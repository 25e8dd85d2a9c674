"""The table of the peers: kept from run to run, and the verdict beside it."""

from __future__ import annotations

import time
from importlib.util import find_spec

import numpy as np
import pytest
import trimesh

import simplifier
from bench import boxes, comparison, methods, quality, record
from bench.boxes import boxes_of, convex_boxes
from bench.failure import PeerFailedError
from bench.peers import prepared
from tests.solids import box, joined, sphere


@pytest.fixture
def assets(tmp_path):
    """A solid, and a file that is refused."""
    ball = sphere(1.0, rings=6)
    simplifier.save(simplifier.Occluder(ball.vertices, ball.faces), tmp_path / "ball.ply")
    (tmp_path / "broken.obj").write_text("v 0 0 0\n")
    (tmp_path / "notes.txt").write_text("no mesh")
    return sorted(tmp_path.iterdir())


def judge(mesh, occluder):
    return quality._judged(mesh, occluder, 2)


@pytest.fixture
def fakes(monkeypatch):
    """Peers that return the first triangles of the mesh, and count how often they are asked."""
    asked = []

    def first(name, share):
        def peer(points, faces, budget):
            asked.append((name, budget))
            if share == 0:
                raise PeerFailedError("took longer than 1 s")
            return points, faces[: int(share * budget)]

        return peer

    made = {"small": first("small", 0.5), "large": first("large", 2), "slow": first("slow", 0)}
    for module in (comparison, methods):
        monkeypatch.setattr(module, "PEERS", made)
    monkeypatch.setattr(methods, "missing", lambda name: "")
    monkeypatch.setattr(comparison, "SLOW_PEERS", ("slow",))
    return asked


def test_rows_are_measured_once_and_slow_peers_only_when_asked(assets, fakes, tmp_path):
    (ball, broken) = comparison.peer_rows(judge, {}, slow=False, paths=assets)
    assert [(row["budget"], row["method"]) for row in ball] == [
        (budget, name) for budget in comparison.BUDGETS for name in ("small", "large")
    ]
    assert next(row["note"] for row in ball if row["method"] == "large") == "over budget"
    assert str(broken[0]["note"]).startswith("refused: ")
    path = tmp_path / "quality_peers.csv"
    record.write_table(path, [*ball, *broken], "me")
    known = comparison.known_rows(path)
    fakes.clear()
    again = list(comparison.peer_rows(judge, known, slow=False, paths=assets[:1]))
    assert not fakes
    assert [row["recall"] for row in again[0]] == [known[key]["recall"] for key in known][:6]
    (slow,) = comparison.peer_rows(judge, known, slow=True, paths=assets[:1])
    assert fakes == [("slow", 16)]  # too much for it at 16, so not tried at 64 and 256
    notes = [row["note"] for row in slow if row["method"] == "slow"]
    assert notes == 3 * ["skipped: took longer than 1 s"]


def test_no_rows_of_a_file_that_is_not_there(tmp_path):
    assert comparison.known_rows(tmp_path / "absent.csv") == {}


def test_rows_without_overhang_are_measured_again(assets, fakes, tmp_path):
    path = tmp_path / "quality_peers.csv"
    place = {"mesh": "ball", "method": "small", "precision": 1.0, "recall": 0.5}
    old = [{**place, "budget": 16, "triangles": 8}, {**place, "budget": 64, "triangles": ""}]
    record.write_table(path, old, "me")
    known = comparison.known_rows(path)
    assert list(known) == [("ball", "64", "small")]
    (rows,) = comparison.peer_rows(judge, known, slow=False, paths=assets[:1])
    assert fakes.count(("small", 16)) == 1
    assert ("small", 64) not in fakes
    assert all("overhang" in row for row in rows if row["budget"] == 16)


def row_of(method, triangles, precision, recall, overhang=0.005):
    cells = {
        "method": method, "triangles": triangles, "precision": precision, "recall": recall,
        "overhang": overhang,
    }  # fmt: skip
    return {name: str(cell) for name, cell in cells.items()}


def test_only_peers_within_the_budget_as_precise_and_as_narrow_are_rivals():
    ours = {"precision": 0.99504, "recall": 0.5, "overhang": 0.005}
    peers = [
        row_of("too many", 17, 1.0, 0.9), row_of("imprecise", 16, 0.9949, 0.9),
        row_of("too wide", 16, 1.0, 0.9, 0.006),
        row_of("rival", 16, 0.995, 0.6), row_of("weak", 3, 1.0, 0.1), row_of("skipped", "", "", ""),
    ]  # fmt: skip
    found = comparison._beside(ours, peers, 16)
    assert (found["best_peer"], found["verdict"]) == ("rival", "not met")
    found = comparison._beside({**ours, "recall": 0.59999}, peers, 16)
    assert found["verdict"] == "met"
    assert comparison._beside(ours, peers[:3], 16)["best_peer"] == "none"


@pytest.mark.slow
def test_command_writes_both_tables(assets, fakes, tmp_path, monkeypatch):
    monkeypatch.setattr(quality, "warm_up", lambda: None)
    monkeypatch.setattr(comparison, "readable_assets", lambda paths: iter([(assets[0], {})]))
    monkeypatch.setattr(comparison, "VIEWS", 2)
    monkeypatch.setattr(comparison, "BUDGETS", (16,))
    out = tmp_path / "out"
    quality.main(["--peers", "--only-peers", "-o", str(out)])
    assert not (out / "quality_against_peers.csv").exists()
    quality.main(["--peers", "-o", str(out)])
    table = record.read_table(out / "quality_against_peers.csv")
    assert table.remarks[0] == "command: python -m bench.quality --peers"
    assert dict(zip(table.columns, table.rows[0], strict=True))["verdict"] in ("met", "not met")
    assert len(fakes) == 2
    assert "## against peers" in (out / "quality.md").read_text()


def test_command_for_one_asset_alone(assets, fakes, tmp_path, monkeypatch):
    monkeypatch.setattr(quality, "warm_up", lambda: None)
    monkeypatch.setattr(quality, "ASSETS", tmp_path)
    monkeypatch.setattr(comparison, "VIEWS", 2)
    monkeypatch.setattr(comparison, "BUDGETS", (16,))
    out = tmp_path / "out"
    quality.main(["--peers", "--only-peers", "--asset", "ball.ply", "-o", str(out)])
    table = record.read_table(out / "quality_peers.csv")
    assert table.remarks[0].endswith("--peers --only-peers --asset ball.ply")
    assert {row[0] for row in table.rows} == {"ball"}
    assert "overhang" in table.columns


def test_boxes_hold_their_parts_and_the_largest_are_kept():
    turned = trimesh.transformations.rotation_matrix(0.5, [1, 2, 3])[:3, :3]
    places = (
        ((1.0, 1.0, 1.0), (0, 0, 0)), ((4.0, 2.0, 1.0), (5, 0, 0)), ((2.0, 1.0, 1.0), (0, 5, 0)),
    )  # fmt: skip
    parts = [box(edge, low).vertices @ turned.T for edge, low in places]
    points, faces = boxes_of(parts, 2)
    assert faces.shape == (24, 3)
    volumes = [trimesh.Trimesh(points, faces[k : k + 12], process=False).volume for k in (0, 12)]
    assert volumes == pytest.approx([8.0, 2.0])


def test_box_of_a_flat_part():
    flat = np.array([[0, 0, 0], [1, 0, 0], [1, 2, 0], [0, 2, 0]], dtype=np.float64)
    points, faces = boxes_of([flat], 5)
    assert faces.shape == (12, 3)
    assert np.ptp(points, axis=0).tolist() == pytest.approx([1.0, 2.0, 0.0], abs=1e-6)


def test_no_box_for_less_than_twelve_triangles():
    assert convex_boxes(np.zeros((3, 3)), np.zeros((1, 3), np.int64), 11)[1].shape == (0, 3)


def test_slow_decomposition_is_ended(tmp_path, monkeypatch):
    sleeper = tmp_path / "bench"
    sleeper.mkdir()
    (sleeper / "boxes.py").write_text("import time\ntime.sleep(60)\n")
    monkeypatch.setattr(boxes, "ROOT", tmp_path)
    begin = time.perf_counter()
    with pytest.raises(PeerFailedError, match=r"longer than 0\.5 s"):
        convex_boxes(np.zeros((3, 3)), np.array([[0, 1, 2]]), 12, 0.5)
    assert time.perf_counter() - begin < 10.0
    (sleeper / "boxes.py").write_text("raise SystemExit(3)\n")
    with pytest.raises(PeerFailedError, match="status 3"):
        convex_boxes(np.zeros((3, 3)), np.array([[0, 1, 2]]), 12, 30.0)


@pytest.mark.skipif(not find_spec("coacd"), reason="coacd is not installed (extra bench)")
def test_two_boxes_apart_are_two_boxes():
    pair = prepared(joined(box(), box((1.0, 1.0, 1.0), (3.0, 0.0, 0.0))))
    points, faces = convex_boxes(pair.vertices.copy(), pair.faces.astype(np.int64), 120)
    assert len(faces) == 24
    assert np.ptp(points, axis=0).tolist() == pytest.approx([1.0, 0.25, 0.25], rel=0.1)
