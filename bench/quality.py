"""How well occluders hide: ``python -m bench.quality [--all] [--seeds N] [--peers]``.

Precision, recall and overhang are those of :func:`simplifier.evaluate` with ``exact=True``: 256
views, all quads counted, the same for every method.  Seconds are those of one run from mesh in
memory to triangles, kernels warm (this library by default: the median of three); reading and
judging are left out.

    stand_ins  this library with default options, by other presets, without refinement, and with the
               paper's own cut and trim, then other simplifiers, at the budgets of its Table 1;
               beside them what that table prints.  Its terrain and machine are other meshes, its
               dragon and Buddha had more triangles.  ``floor`` is the recall that this release must
               reach by default on the statues, at 99 % precision.
    all        (--all) every readable asset at 64 triangles
    seeds      (--seeds N) the spread of the sampled figures over N seeds of views and quads; the
               occluders are the same
    peers      (--peers) every readable asset at 16, 64 and 256 triangles by the other simplifiers,
               by convex hulls and by inner boxes, 128 views; with --slow-peers by boxes around
               convex parts as well.  What the file holds from an earlier run is not measured
               again.  --asset NAME, which may be repeated, for some assets alone
    against_peers  (--peers, without --only-peers) this library on the same, default options, beside
               the best peer within the budget that is no less precise and has no more overhang

Every table goes to ``quality_NAME.csv``, and ``quality.md`` shows all that the folder holds.
"""

from __future__ import annotations

import argparse
import statistics
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import simplifier
from bench import comparison
from bench.meshes import ASSETS, STAND_INS, StandIn, load_stand_in, readable_assets
from bench.methods import OURS, Result, results, timed
from bench.record import Row, told, write_page, write_table
from bench.times import met, skipped
from simplifier.errors import OccluderError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.warmup import warm_up

RESULTS = Path("bench/results")

TABLES = ("stand_ins", "all", "seeds", "peers", "against_peers")
PRECISION_FLOOR = 0.99
_BUDGET = 64  # for assets that the paper has no budget for


def stand_in_rows(stand_ins: Sequence[StandIn] = STAND_INS, views: int = 256) -> Iterator[Row]:
    """Each stand-in by each method."""
    for stand_in in stand_ins:
        if stand_in.missing:
            yield skipped(stand_in.name, stand_in.missing)
            continue
        mesh = load_stand_in(stand_in)
        for result in results(mesh, stand_in.options):
            row = {"mesh": stand_in.name, "budget": stand_in.budget, "method": result.method}
            if result.occluder is None:
                yield {**row, "note": f"skipped: {result.reason}"}
            else:
                judged = _judged(mesh, result.occluder, views)
                yield {
                    **row,
                    **judged,
                    "seconds": result.seconds,
                    **_beside(judged, result, stand_in),
                }


def asset_rows(paths: Sequence[Path] | None = None, views: int = 256) -> Iterator[Row]:
    """Every readable asset at 64 triangles, default options."""
    for path, options in readable_assets(paths):
        row = {"mesh": path.stem, "budget": _BUDGET, "ground": options["ground"]}
        try:
            mesh = simplifier.load(path)
            occluder, seconds = timed(mesh, {"budget": _BUDGET, **options}, 1)
        except OccluderError as error:
            yield {**row, "note": f"refused: {error}"}
            continue
        judged = _judged(mesh, occluder, views)
        yield {**row, "input": len(mesh.faces), **judged, "seconds": seconds}


def seed_rows(
    seeds: int, stand_ins: Sequence[StandIn] = STAND_INS, **accuracy: Any
) -> Iterator[Row]:
    """The sampled figures of one occluder over seeds 0, 1, ...: mean, standard deviation, range."""
    for stand_in in stand_ins:
        if stand_in.missing:
            yield skipped(stand_in.name, stand_in.missing)
            continue
        mesh = load_stand_in(stand_in)
        occluder = simplifier.simplify(mesh, **stand_in.options).occluder
        reports = [
            simplifier.evaluate(mesh, occluder, seed=i, **accuracy).accuracy for i in range(seeds)
        ]
        for figure in ("precision", "recall"):
            values = [float(getattr(report, figure)) for report in reports]
            yield {
                "mesh": stand_in.name, "figure": figure, "seeds": seeds,
                "mean": statistics.mean(values), "standard_deviation": statistics.pstdev(values),
                "least": min(values), "most": max(values),
            }  # fmt: skip


def _judged(mesh: TriangleMesh, occluder: Occluder, views: int) -> dict[str, float | int]:
    found = simplifier.evaluate(mesh, occluder, views=views, exact=True)
    return {
        "triangles": len(occluder.faces), "precision": found.precision, "recall": found.recall,
        "worst_view_recall": float(found.accuracy.recall_by_view.min()),
        "overhang": found.overhang.mean, "worst_overhang": found.overhang.worst,
    }  # fmt: skip


def _beside(judged: dict[str, float | int], result: Result, stand_in: StandIn) -> Row:
    """The paper's figures, this release's floor, and a note where the budget was not kept."""
    over = judged["triangles"] > stand_in.budget
    row: dict[str, object] = {
        "paper_precision": stand_in.printed[0], "paper_recall": stand_in.printed[1],
    }  # fmt: skip
    if result.method == OURS and stand_in.figure is not None:
        reached = judged["recall"] >= stand_in.figure and judged["precision"] >= PRECISION_FLOOR
        row |= {"floor": stand_in.figure, "floor_is": met(reached and not over)}
    return {**row, "note": "over budget" if over else ""}


def compare(given: argparse.Namespace) -> None:
    """Write the table of the peers, then ours beside it unless they alone were asked for."""
    path = given.output / "quality_peers.csv"

    def judge(mesh: TriangleMesh, occluder: Occluder) -> Row:
        return _judged(mesh, occluder, comparison.VIEWS)

    found: list[Row] = []
    known = comparison.known_rows(path)
    paths = [ASSETS / name for name in sorted(given.asset)] if given.asset else None
    for rows in comparison.peer_rows(judge, known, slow=given.slow_peers, paths=paths):
        for row in rows:
            print(f"peers: {told(row)}", flush=True)
        found += rows
        # After each mesh, with what is known of the others: a run that is cut short counts.
        done = {row["mesh"] for row in found}
        rest = [row for row in known.values() if row["mesh"] not in done]
        write_table(path, [*found, *rest], _command(given))
    if not given.only_peers:
        peers = comparison.known_rows(path).values()
        _write("against_peers", comparison.verdict_rows(judge, peers, paths), given)


def _write(name: str, rows: Iterator[Row], given: argparse.Namespace) -> None:
    found = []
    for row in rows:
        found.append(row)
        print(f"{name}: {told(row)}", flush=True)
    write_table(given.output / f"quality_{name}.csv", found, _command(given))


def _command(given: argparse.Namespace) -> str:
    flags = ("all", "seeds", "peers", "slow_peers", "only_peers")
    words = [f"--{flag.replace('_', '-')}" for flag in flags if getattr(given, flag)]
    words += [f"--asset {name}" for name in given.asset or ()]
    if given.seeds:
        words.insert(words.index("--seeds") + 1, str(given.seeds))
    return " ".join(["python -m bench.quality", *words])


def main(arguments: Sequence[str] | None = None) -> None:
    """Parse the command line and write the tables."""
    parser = argparse.ArgumentParser(prog="python -m bench.quality", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--all", action="store_true", help="every asset at 64 triangles, too")
    parser.add_argument("--seeds", type=int, default=0, help="seeds of the accuracy sample, too")
    parser.add_argument("--peers", action="store_true", help="only every asset beside the peers")
    parser.add_argument("--slow-peers", action="store_true", help="with --peers: CoACD, too")
    parser.add_argument("--asset", action="append", help="with --peers: a file name; repeatable")
    parser.add_argument("--only-peers", action="store_true", help="with --peers: ours another time")
    parser.add_argument("-o", "--output", type=Path, default=RESULTS, help="folder of the results")
    given = parser.parse_args(arguments)
    warm_up()
    if given.peers:
        compare(given)
    else:
        _write("stand_ins", stand_in_rows(), given)
        if given.all:
            _write("all", asset_rows(), given)
        if given.seeds > 0:
            _write("seeds", seed_rows(given.seeds), given)
    print(write_page(given.output, "quality", TABLES))


if __name__ == "__main__":
    main()
