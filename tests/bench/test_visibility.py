"""The benchmark of view cells, in a small city: every table, and the picture."""

from __future__ import annotations

import pytest

from bench.visibility import cells_rows, check_rows, city_rows
from bench.visibility_cases import city
from bench.visibility_front import Front, front_rows
from bench.visibility_plot import plot_cells, plot_front


def test_a_small_city_is_judged():
    rows = list(city_rows(3, 6, (5.0,), 3))
    assert [row["method"] for row in rows] == ["cull-map", "auto"]
    for row in rows:
        assert row["leaks"] == 0
        assert row["cells"] == 6
        assert row["sets_to_seen"] >= 1.0
        assert 0.0 < row["culled"] < 1.0
        assert row["bytes_a_cell"] > 0.0


@pytest.mark.slow
def test_one_thing_at_a_time_is_varied_and_drawn(tmp_path):
    rows = list(cells_rows((3, 4), (4, 6), (5.0,), (5.0, 10.0)))
    assert [row["varied"] for row in rows] == [
        "cells", "cells", "objects", "objects", "epsilon", "cell_size", "cell_size",
    ]  # fmt: skip
    assert [row["cells"] for row in rows[:2]] == [4, 6]
    assert rows[2]["objects"] < rows[3]["objects"]
    plot_cells(tmp_path / "cells.png", rows, "a command")
    assert (tmp_path / "cells.png").read_bytes()[:4] == b"\x89PNG"


def test_methods_by_their_steps_are_a_front(tmp_path):
    front = Front(lambda: city(3, 6), {"cull-map": (10.0, 2.5), "strong": (None,)}, 6, 6)
    rows = list(front_rows({"town": front}))
    assert [(row["method"], row["step"]) for row in rows] == [
        ("cull-map", "10 m"), ("cull-map", "2.5 m"), ("strong", ""),
    ]  # fmt: skip
    assert rows[0]["sets_to_seen"] > rows[1]["sets_to_seen"] >= 1.0
    assert rows[0]["mean_set"] > rows[1]["mean_set"]
    assert all(row["leaks"] == 0 < row["processor_ms_a_cell"] for row in rows)
    plot_front(tmp_path / "front.png", rows, "a command")
    assert (tmp_path / "front.png").read_bytes()[:4] == b"\x89PNG"


def test_the_wide_check_looks_by_lines_and_by_pictures(capsys):
    lines, pictures = check_rows(3, 4, 8, 50, 1)
    assert (lines["by"], lines["viewpoints"], lines["leaks"]) == ("lines", 32, 0)
    assert (pictures["by"], pictures["viewpoints"], pictures["leaks"]) == ("pictures", 4, 0)

    assert "check: pictures, cells 2 of 4" in capsys.readouterr().out
