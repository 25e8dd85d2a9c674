"""Shapes at the extremes beside a cube: ``python -m bench.stability.shapes``.

Needles, sheets, holes of all widths, shells in shells, specks, sponges.  Writes
``bench/results/stability_shapes.csv`` and prints the table as Markdown.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from bench.record import Row
from bench.stability.produced import arguments_of, produced_row, record, words_of
from tests.extremes.shapes import SHAPES

_ALSO: tuple[tuple[str, dict[str, Any]], ...] = (
    ("hole of 3.0 voxels", {"smallest_hole": 2.0}),
    ("hole of 10.0 voxels", {"smallest_hole": 10.5}),
    ("Menger sponge", {"resolution": 27}),
    ("Menger sponge", {"smallest_hole": 3.1}),
    ("Menger sponge", {"fill": "flood"}),
    ("chessboard", {"overhang": 1.0}),
    ("10,000 specks", {"smallest_hole": 0.063}),
    ("10,000 specks", {"resolution": 512}),
    ("cube", {"conservative": True}),
    ("needle", {"conservative": True}),
    ("nested shells", {"conservative": True}),
    ("walls of 0.1 voxel", {"conservative": True}),
    ("Menger sponge", {"conservative": True}),
    ("checkerboard", {"conservative": True}),
)
"""Options that change what a shape is."""


def rows(views: int, only: str) -> Iterator[Row]:
    """A row a shape with the defaults, then with other options."""
    for name, options in (*((name, {}) for name in SHAPES), *_ALSO):
        if only in name:
            mesh = SHAPES[name]()
            case = {"shape": name, "of": len(mesh.faces), "options": words_of(options)}
            yield produced_row(mesh, case, views, options)


def main(arguments: Sequence[str] | None = None) -> None:
    """Parse the command line, measure, write and print."""
    parser = arguments_of("shapes")
    parser.add_argument("--only", default="", metavar="WORD", help="shapes with it in their name")
    given = parser.parse_args(arguments)
    record(rows(given.views, given.only), "shapes", given.out)


if __name__ == "__main__":
    main()
