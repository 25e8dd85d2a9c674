"""The table of fills, on a box without its lid."""

from __future__ import annotations

import bench.fill
from tests.solids import box


def test_a_cell_of_each_table():
    mesh = box(without=[5])
    recall, _, precision = bench.fill.worth(mesh, 0.1).partition(" at ")
    assert 95.0 < float(recall) <= 100.0
    assert 99.0 < float(precision) <= 100.0
    assert min(bench.fill.seconds(mesh, 32)) > 0.0
