"""The page of all figures of stability says what its tables hold."""

from __future__ import annotations

import shutil

from bench.stability.__main__ import TABLES, write_stability_page
from bench.stability.produced import RESULTS


def test_the_page_of_stability_is_current(tmp_path):
    for name in TABLES:
        shutil.copy(RESULTS / f"stability_{name}.csv", tmp_path)
    page = write_stability_page(tmp_path)
    kept = (RESULTS / "stability.md").read_text(encoding="utf-8")
    assert page.read_text(encoding="utf-8") == kept, "run python -m bench.stability"
