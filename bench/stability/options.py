"""Options at the ends of their ranges: ``python -m bench.stability.options``.

One solid, a bumpy sphere of 20,000 triangles, with one option changed in each row.  Writes
``bench/results/stability_options.csv`` and prints the table as Markdown.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

from bench.meshes import bumpy_sphere
from bench.record import Row
from bench.stability.produced import arguments_of, produced_row, record, words_of


def cases(longest: float) -> tuple[dict[str, Any], ...]:
    """Lengths by the ``longest`` edge of the mesh."""
    return (
        {},
        *({"resolution": count} for count in (1, 2, 3, 16, 128, 256, 512, 1025)),
        *({"budget": count} for count in (1, 2, 3, 1_000, 10_000, 20_000)),
        *({"alpha": share} for share in (0.0, 1.0)),
        *({"error_bound": share * longest} for share in (1e9, 1.0, 1e-12)),
        {"error_bound": 5e-324},
        *({"time_limit": seconds} for seconds in (0.0, 1e-9, 0.1, 1.0, math.inf)),
        *({"min_precision": share} for share in (0.0, 1.0)),
        *({"overhang": share} for share in (0.0, 1.0)),
        *({"moves": count} for count in (0, 1)),
        *({"smallest_hole": share * longest} for share in (1e-300, 1.0, 1.01)),
        *({"shrink": share * longest} for share in (1e-300, 0.02, 1.0, 1e300)),
        {"conservative": True},
        {"conservative": True, "resolution": 1},
        {"lods": 16},
        {"slicer": "gl"},
    )


def rows(triangles: int, views: int) -> Iterator[Row]:
    """A row a case."""
    mesh = bumpy_sphere(triangles)
    for options in cases(float(mesh.extent.max())):
        yield produced_row(mesh, {"options": words_of(options) or "defaults"}, views, options)


def main(arguments: Sequence[str] | None = None) -> None:
    """Parse the command line, measure, write and print."""
    parser = arguments_of("options")
    parser.add_argument("--triangles", type=int, default=20_000, help="of the solid")
    given = parser.parse_args(arguments)
    record(rows(given.triangles, given.views), "options", given.out)


if __name__ == "__main__":
    main()
