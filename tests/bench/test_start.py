"""Starts as whole processes: what is counted, and what the table tells of it."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from bench import meshes, start
from bench.start import Start


def test_a_start_counts_its_machine_code_and_its_processes(tmp_path):
    cache = tmp_path / "kernels"
    cache.mkdir()
    busy = "import time\nwhile time.process_time() < 0.2: pass"
    code = (
        f"import os, subprocess, sys; open({str(cache / 'a.o')!r}, 'w').close()\n"
        f"subprocess.run([sys.executable, '-c', {busy!r}], check=True)"
    )
    variables = {"NUMBA_CACHE_DIR": str(cache)}
    row = start.measured(Start("one", (sys.executable, "-c", code)), variables, 1)
    assert row["compiled"] == 1
    assert row["cpu_s"] > 0.2
    assert row["peak_mib"] > 1.0
    alone = start.measured(Start("none", (sys.executable, "-c", "pass")), variables, 2)
    assert (alone["compiled"], alone["repeats"], alone["work_s"]) == (0, 2, None)


def test_cold_starts_get_an_empty_cache_and_the_rest_a_warm_one(tmp_path, monkeypatch):
    monkeypatch.setattr(meshes, "ASSETS", tmp_path)  # so the bunny is a generated solid
    monkeypatch.setattr(start, "_installed_wheel", lambda folder: folder / "site")
    caches, wheels = {}, set()

    def measured(one, variables, repeats):
        cache = Path(variables["NUMBA_CACHE_DIR"])
        caches[one.title] = cache.exists()
        if "PYTHONPATH" in variables:
            wheels.add(one.title)
        cache.mkdir(exist_ok=True)
        return {"start": one.title, "repeats": repeats}

    monkeypatch.setattr(start, "measured", measured)
    rows = list(start.start_rows(3))
    assert wheels == {
        "first occluder simplify of a wheel, bumpy-4968", "first occluder warmup of a wheel",
    }  # fmt: skip
    cold = {*wheels, "first occluder simplify, bumpy-4968", "occluder warmup from nothing"}
    assert {title for title, warm in caches.items() if not warm} == cold
    once = {row["start"] for row in rows if row["repeats"] == 1}
    assert once == {*cold, "occluder simplify, 100 small meshes in 100 calls"}


@pytest.mark.slow
def test_the_work_of_a_start_is_less_than_all_of_it(tmp_path):
    (row,) = start.start_rows(1, "48 triangles")
    assert 0.0 < row["work_s"] < row["cpu_s"]
    assert row["compiled"] == 0
