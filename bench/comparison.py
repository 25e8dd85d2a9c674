"""Every asset at three budgets: what the peers make of it, and whether this library hides as much.

The peers' rows do not depend on this library, and some take minutes: those that the CSV file holds
already, with all figures, are taken from it, so that only ours are measured again.  Delete the file
to measure all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import simplifier
from bench.meshes import readable_assets
from bench.methods import peer_results, timed
from bench.peers import PEERS, SLOW_PEERS, prepared
from bench.record import Row, read_table
from bench.times import met
from simplifier.errors import OccluderError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder

BUDGETS = (16, 64, 256)
VIEWS = 128

Place = tuple[str, str, str]  # mesh, budget, method
Judge = Callable[[TriangleMesh, Occluder], Row]


def known_rows(path: Path) -> dict[Place, dict[str, str]]:
    """The peers' rows of an earlier run; none where the file is not there.

    Those of occluders whose overhang was not measured yet are left out.
    """
    if not path.exists():
        return {}
    table = read_table(path)
    rows = [dict(zip(table.columns, row, strict=True)) for row in table.rows]
    return {
        (row["mesh"], row["budget"], row["method"]): row
        for row in rows
        if not row["triangles"] or row.get("overhang")
    }


def peer_rows(
    judge: Judge, known: Mapping[Place, Row], *, slow: bool, paths: Sequence[Path] | None = None
) -> Iterator[list[Row]]:
    """The rows of one asset after the other, by budget and peer.

    What is ``known`` is not measured again.  Peers that take minutes run only when ``slow``, and
    not again on a mesh that was too much for them at a smaller budget.
    """
    for path, _ in readable_assets(paths):
        names = [
            (budget, name)
            for budget in BUDGETS
            for name in PEERS
            if slow or name not in SLOW_PEERS or (path.stem, str(budget), name) in known
        ]
        if all((path.stem, str(budget), name) in known for budget, name in names):
            yield [known[path.stem, str(budget), name] for budget, name in names]
            continue
        yield list(_measured(path, names, judge, known))


def _measured(
    path: Path, names: Sequence[tuple[int, str]], judge: Judge, known: Mapping[Place, Row]
) -> Iterator[Row]:
    try:
        mesh = simplifier.load(path)
    except OccluderError as error:
        yield {"mesh": path.stem, "budget": "", "method": "", "note": f"refused: {error}"}
        return
    ready, given_up = prepared(mesh), dict[str, str]()
    for budget, name in names:
        row: Row = {"mesh": path.stem, "budget": budget, "method": name}
        if (path.stem, str(budget), name) in known:
            row = known[path.stem, str(budget), name]
        elif name in given_up:
            row = {**row, "note": given_up[name]}
        else:
            (result,) = peer_results(mesh, ready, budget, (name,))
            if result.occluder is None:
                row = {**row, "note": f"skipped: {result.reason}"}
            else:
                row = {**row, **judge(mesh, result.occluder), "seconds": result.seconds}
                row = {**row, "note": _over(row, budget)}
        if name in SLOW_PEERS and str(row.get("note", "")).startswith("skipped: "):
            given_up[name] = str(row["note"])
        yield row


def _over(row: Row, budget: int) -> str:
    return "over budget" if int(str(row["triangles"])) > budget else ""


def verdict_rows(
    judge: Judge, peers: Iterable[Mapping[str, str]], paths: Sequence[Path] | None = None
) -> Iterator[Row]:
    """Ours with default options beside the best peer, for each asset and budget.

    The best peer is the one of highest recall among those that kept the budget with no less
    precision than ours and no more overhang; the verdict is ``met`` where our recall is no less
    than its.  All figures are compared as the tables show them, to four digits.
    """
    by_place: dict[tuple[str, str], list[Mapping[str, str]]] = {}
    for row in peers:
        by_place.setdefault((row["mesh"], row["budget"]), []).append(row)
    for path, options in readable_assets(paths):
        try:
            mesh = simplifier.load(path)
        except OccluderError as error:
            yield {"mesh": path.stem, "note": f"refused: {error}"}
            continue
        for budget in BUDGETS:
            occluder, seconds = timed(mesh, {"budget": budget, **options}, 1)
            judged = judge(mesh, occluder)
            ours = {"mesh": path.stem, "budget": budget, **judged, "seconds": seconds}
            yield {**ours, **_beside(judged, by_place.get((path.stem, str(budget)), []), budget)}


def _beside(judged: Row, peers: Sequence[Mapping[str, str]], budget: int) -> Row:
    recall, precision, overhang = (
        float(f"{judged[name]:.4g}") for name in ("recall", "precision", "overhang")
    )
    rivals = [
        row
        for row in peers
        if row["recall"]
        and int(row["triangles"]) <= budget
        and float(row["precision"]) >= precision
        and float(row["overhang"]) <= overhang
    ]
    if not rivals:
        return {"best_peer": "none", "verdict": met(True)}
    best = max(rivals, key=lambda row: float(row["recall"]))
    return {
        "best_peer": best["method"], "its_triangles": best["triangles"],
        "its_precision": best["precision"], "its_recall": best["recall"],
        "verdict": met(recall >= float(best["recall"])),
    }  # fmt: skip
