"""Found -> the figures of ``occluder pvs --report``."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from simplifier.geometry.pvs import Pvs
from simplifier.visibility.find import Found


def culled_share(pvs: Pvs) -> float:
    """The share of objects that are in no set, a mean over the cells that are done."""
    done = pvs.row_of[pvs.computed]
    count = len(pvs.names)
    seen = {row: int(pvs.rows.row(row, count).sum()) for row in set(done.tolist())}
    return 1.0 - sum(seen[row] for row in done.tolist()) / (count * len(done))


def pvs_report(found: Found) -> dict[str, Any]:
    """What JSON can hold: counts, the method and why, shares, bytes, seconds and warnings."""
    pvs = found.pvs
    return {
        "objects": len(pvs.names),
        "cells": len(pvs.cells),
        "computed_now": found.made,
        "left": len(pvs.cells) - len(pvs.computed),
        "method": pvs.method,
        "methods": list(found.way),
        "reason": found.reason,
        "conservative": pvs.conservative,
        "culled_share": culled_share(pvs),
        "holes": [asdict(leak) for leak in found.leaks],
        "row_bytes": len(pvs.rows.data),
        "rows": len(pvs.rows),
        "seconds_a_cell": found.seconds,
        "cost": asdict(found.cost),
        "foretold": None if found.foretold is None else asdict(found.foretold),
        "warnings": list(found.warnings),
    }
