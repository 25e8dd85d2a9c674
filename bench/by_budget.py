"""Shapes in several numbers of triangles, by preset: what tables of shapes have in common.

Of each in each number of triangles, means over the seeds: recall, overhang in the mean and in the
worst view, all in percent of 256 views that no search has seen, and milliseconds from the mesh in
memory to its triangles, kernels warm.
"""

from __future__ import annotations

import argparse
import shlex
import statistics
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import simplifier
from bench.record import Row, told, write_page, write_table
from bench.times import skipped
from simplifier.geometry.mesh import TriangleMesh

PRESETS = ("draft", "balanced")
_FIGURES = {"recall": 1, "overhang": 2, "worst overhang": 1, "milliseconds": 0}
"""And the digits that are told of each."""


@dataclass(frozen=True)
class Shapes:
    """What a table is of.

    ``page``      its name, as of ``bench.PAGE`` and ``bench/results/PAGE.md``.
    ``each``      gives each shape by its name; None where an asset is not there.
    ``kind_of``   of a name: kinds have means of their own.
    ``standing``  options of a name.
    """

    page: str
    each: Callable[[], Iterable[tuple[str, TriangleMesh | None]]]
    kind_of: Callable[[str], str]
    standing: Callable[[str], dict[str, Any]]

    @property
    def one(self) -> str:
        """What a shape is called."""
        return self.page.removesuffix("s")


@dataclass(frozen=True)
class Arguments:
    """What is run; ``words`` are those that say so."""

    names: list[str]
    presets: list[str]
    budgets: list[int]
    seeds: int
    words: list[str]


def arguments(
    described: str | None, budgets: Sequence[int], words: Sequence[str] | None
) -> Arguments:
    parser = argparse.ArgumentParser(description=(described or "").partition("\n")[0])
    parser.add_argument("names", nargs="*", help="of shapes; all without")
    parser.add_argument("--presets", default=",".join(PRESETS))
    parser.add_argument("--budgets", default=",".join(map(str, budgets)))
    parser.add_argument("--seeds", type=int, default=2)
    given = parser.parse_args(words)
    return Arguments(
        given.names, given.presets.split(","), [int(one) for one in given.budgets.split(",")],
        given.seeds, list(sys.argv[1:] if words is None else words),
    )  # fmt: skip


def run(shapes: Shapes, given: Arguments, results: Path, missing: str = "") -> None:
    """Tell each row and, if no names were given, keep a table a preset, and the page of them.

    ``missing``  why a shape is not there.
    """
    simplifier.warm_up()
    for preset in given.presets:
        rows: list[Row] = []
        for name, mesh in shapes.each():
            if given.names and name not in given.names:
                continue
            if mesh is None:
                rows.append(skipped(name, missing))
                continue
            for budget in given.budgets:
                rows.append(_measured(shapes, mesh, name, preset, budget, given.seeds))
                print(preset, told(rows[-1]), flush=True)
        last = means(shapes, rows)
        for row in last:
            print(preset, told(row), flush=True)
        if not given.names:
            command = shlex.join(["python", "-m", f"bench.{shapes.page}", *given.words])
            write_table(results / f"{shapes.page}_{preset}.csv", [*rows, *last], command)
    if not given.names:
        write_page(results, shapes.page, (*PRESETS, "best"))


def _measured(
    shapes: Shapes, mesh: TriangleMesh, name: str, preset: str, budget: int, seeds: int
) -> Row:
    """Means over the seeds."""
    found, asked = [], shapes.standing(name)
    for seed in range(seeds):
        begin = time.perf_counter()
        made = simplifier.simplify(mesh, preset=preset, budget=budget, seed=seed, **asked)
        seconds = time.perf_counter() - begin
        report = simplifier.evaluate(mesh, made.occluder, exact=True, **asked)
        over = report.overhang
        found.append((100 * report.recall, 100 * over.mean, 100 * over.worst, 1000 * seconds))
    figures = dict(zip(_FIGURES, map(statistics.fmean, zip(*found, strict=True)), strict=True))
    return {shapes.one: name, "budget": budget, **_as_told(figures)}


def means(shapes: Shapes, rows: Sequence[Row]) -> list[Row]:
    """Over all numbers of triangles: of each kind, and of all where there are several."""
    known = [row for row in rows if "recall" in row]
    by_kind: dict[str, list[Row]] = {}
    for row in known:
        by_kind.setdefault(f"mean of {shapes.kind_of(str(row[shapes.one]))}", []).append(row)
    if len(by_kind) > 1:
        by_kind["mean"] = known
    return [
        {shapes.one: kind}
        | _as_told({name: statistics.fmean(float(str(row[name])) for row in some)
                    for name in _FIGURES})
        for kind, some in by_kind.items()
    ]  # fmt: skip


def _as_told(figures: dict[str, float]) -> Row:
    return {name: f"{figures[name]:.{digits}f}" for name, digits in _FIGURES.items()}
