"""The scenes and tables of Cohen-Or et al. (1998), by strong occluders.

What the paper leaves open is assumed: where its three-box buildings are parted (strips along either
axis), how many there are (414, which with 2,496 buildings gives its 3,324 boxes), where its cells
lie (in five rows of five that fill the square of 400), that a segment which touches a box in a face
meets it, and the distance of its spheres (200).
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from bench.record import Row
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.view_cells import ViewCells
from simplifier.kernels.compiled.kernel import inner_kernel
from simplifier.kernels.hull_rays import ALL_PIECES, FIRST_PIECE, NO_PIECES, PIECE_RAYS, RAYS, meets
from simplifier.visibility.strong.convex_bodies import ConvexBodies
from simplifier.visibility.strong.strong_occluders import (
    Hidden,
    StrongOccluders,
    Tactics,
    cell_of,
    margin_of,
)

PITCH, BASE = 200.0, 100.0
ROWS = 50  # of buildings; four in the middle are gone
PARTED = 414  # buildings of three boxes
ROOFS = (200.0, 900.0)
REGION = 400.0
EYE = 50.0

SPHERES, SPACING, RADIUS = 30, 200.0, 50.0

PAPERS_WAY = Tactics(hull=False, cache=0, dilute=False, group=1, pieces=NO_PIECES)
"""Its optimization 1 alone: candidates one after the other along a leading ray."""

PAPER_BOXES = {10: 3116, 20: 3088, 30: 3052, 40: 2994, 50: 2918, 60: 2778, 70: 2521, 80: 2120,
               90: 1456, 100: 337, 125: 100, 150: 39, 200: 11}  # fmt: skip
PAPER_BUILDINGS = {10: 3126, 20: 3102, 30: 3067, 40: 3019, 50: 2947, 60: 2829, 70: 2623, 80: 2329,
                   90: 1806, 100: 974, 125: 438, 150: 241, 200: 89}  # fmt: skip
PAPER_TESTS = {10: 211715, 20: 212943, 30: 215838, 40: 218785, 50: 222611, 60: 227892,
               70: 234380, 80: 245076, 90: 255315, 100: 273029, 125: 208280, 150: 171463,
               200: 132703}  # fmt: skip
PAPER_POLYGONS = {10: 1447, 20: 1615, 30: 1833, 40: 2115, 50: 2540, 60: 3128, 70: 4090, 80: 5464,
                  90: 7745, 100: 11338, 125: 16995, 150: 20470, 200: 24534}  # fmt: skip
PAPER_PIECE_TESTS = {10: 48002, 20: 55621, 30: 64846, 40: 85313, 50: 109210, 60: 159599,
                     70: 259442, 80: 425117, 90: 707462, 100: 1204630, 125: 1385075,
                     150: 1346399, 200: 1175813}  # fmt: skip
PAPER_SECONDS = {20: 13, 30: 14, 40: 15, 50: 16, 60: 18, 70: 25, 80: 33, 90: 47}
PAPER_SPHERES = {5: 9169, 10: 7481, 20: 4611, 30: 2334, 40: 811, 50: 119}
PAPER_SPHERE_TESTS = {5: 1052048, 10: 971410, 20: 819622, 30: 678895, 40: 558874, 50: 463204}
PAPER_RANKS = {20: (2345, 504, 160, 45, 19, 5, 5, 2, 2, 1, 0),
               30: (2045, 630, 231, 86, 32, 10, 7, 4, 4, 2, 1),
               50: (1470, 635, 377, 185, 111, 68, 32, 15, 11, 1, 13),
               70: (829, 571, 359, 284, 184, 103, 78, 37, 22, 14, 40),
               100: (32, 30, 46, 51, 51, 44, 29, 23, 15, 6, 10),
               150: (0, 0, 2, 1, 1, 3, 6, 5, 3, 5, 13),
               200: (0, 0, 1, 0, 0, 0, 1, 2, 1, 2, 5)}  # fmt: skip


def paper_city(seed: int = 0) -> FloatArray:
    """(3324, 2, 3) boxes; the removed buildings' square is around the origin."""
    generator = np.random.default_rng(seed)
    along = (np.arange(ROWS) - 0.5 * (ROWS - 1)) * PITCH
    places = np.stack(np.meshgrid(along, along, indexing="ij"), axis=-1).reshape(-1, 2)
    places = places[np.abs(places).max(axis=1) > PITCH]
    counts = np.ones(len(places), dtype=np.int64)
    counts[generator.choice(len(places), PARTED, replace=False)] = 3
    buildings: list[FloatArray] = []
    for place, count in zip(places, counts.tolist(), strict=True):
        axis = int(generator.integers(2))
        boxes = np.empty((count, 2, 3))
        boxes[:, 0, :2], boxes[:, 1, :2] = place - 0.5 * BASE, place + 0.5 * BASE
        cuts = place[axis] + BASE * (np.arange(count + 1) / count - 0.5)
        boxes[:, 0, axis], boxes[:, 1, axis] = cuts[:-1], cuts[1:]
        boxes[:, 0, 2], boxes[:, 1, 2] = 0.0, generator.uniform(*ROOFS, count)
        buildings.append(boxes)
    return np.concatenate(buildings)


def paper_cells(size: float, rows: int = 5, region: float = REGION) -> ViewCells:
    """``rows`` x ``rows`` cells that fill the square evenly, from the ground to the eyes."""
    along = np.linspace(-0.5 * region, 0.5 * region - size, rows)
    low = np.stack(np.meshgrid(along, along, indexing="ij"), axis=-1).reshape(-1, 2)
    low = np.column_stack([low, np.zeros(len(low))])
    return ViewCells.boxes(low, low + np.array([size, size, EYE]))


def city_occluders(boxes: FloatArray, closed: bool) -> StrongOccluders:
    """The city's boxes, and as pieces the ten triangles of each that one can see.

    ``closed``  segments that touch a box in a face count as met; if not, it is solid below the
                ground in return, as ``occluder pvs`` has it.
    """
    margin = margin_of(boxes)
    bodies = boxes.copy()
    if not closed:
        bodies[:, 0, 2] -= 1.0
    made = ConvexBodies.of_boxes(bodies, -margin if closed else margin)
    corners = np.empty((len(boxes), 8, 3))
    number = np.arange(8)
    for axis, bit in enumerate((2, 1, 0)):
        corners[:, :, axis] = boxes[:, (number >> bit) & 1, axis]
    quads = np.array([[4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 1, 3, 2], [1, 5, 7, 3]])
    triangles = corners[:, quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)]
    highest = np.argsort(-triangles[0, :, :, 2].mean(axis=1), kind="stable")
    triangles = np.ascontiguousarray(triangles[:, highest])  # as ``occluder pvs`` has them
    count = len(boxes)
    return StrongOccluders(
        made, boxes, np.arange(count + 1), 10 * np.arange(count + 1), triangles.reshape(-1, 3, 3)
    )


def city_rows(sizes: Sequence[int] = tuple(PAPER_BOXES), rows: int = 5) -> Iterator[Row]:
    """Tables 1 and 2: means over the cells of a size, the paper's beside them.

    ``boxes`` are as the paper finds them, ``tests`` as it counts them: one candidate after the
    other along a leading ray, 64 segments for each.  ``by_pieces_too`` adds boxes of which each
    triangle is hidden, the paper's strongly occluded buildings.  ``strict_boxes``, ``our_tests``,
    ``our_piece_tests`` and the times are of what ``occluder pvs`` does; the paper has times of some
    sizes alone.
    """
    boxes = paper_city()
    papers, ours = city_occluders(boxes, closed=True), city_occluders(boxes, closed=False)
    way = replace(PAPERS_WAY, pieces=ALL_PIECES)
    ours.hide(paper_cells(sizes[0], 1))  # compiles
    for size in sizes:
        cells = paper_cells(size, rows)
        found = papers.hide(cells, way)
        whole = found.by >= 0
        pieces = (found.pieces | np.repeat(whole, 10, axis=1)).sum(axis=1)
        strict, seconds, worked = _timed(ours, cells)
        yield {
            "cell": size,
            "boxes": float(whole.sum(axis=1).mean()),
            "paper_boxes": PAPER_BOXES[size],
            "strict_boxes": float((strict.by >= 0).sum(axis=1).mean()),
            "by_pieces_too": float(found.hidden.sum(axis=1).mean()),
            "paper_by_pieces_too": PAPER_BUILDINGS[size],
            "polygons": float(10 * len(boxes) - pieces.mean()),
            "paper_polygons": PAPER_POLYGONS[size],
            "tests": float(found.work[:, RAYS].mean()),
            "paper_tests": PAPER_TESTS[size],
            "piece_tests": float(found.work[:, PIECE_RAYS].mean()),
            "paper_piece_tests": PAPER_PIECE_TESTS[size],
            "our_tests": float(strict.work[:, RAYS].mean()),
            "our_piece_tests": float(strict.work[:, PIECE_RAYS].mean()),
            "ms": 1e3 * seconds / len(cells),
            "processor_ms": 1e3 * worked / len(cells),
            "paper_seconds": PAPER_SECONDS.get(size),
        }


def _timed(occluders: StrongOccluders, cells: ViewCells) -> tuple[Hidden, float, float]:
    """What ``occluder pvs`` finds, and the least seconds of three, and of all processors."""
    walls, works = [], []
    for _ in range(3):
        begin, worked = time.perf_counter(), time.process_time()
        found = occluders.hide(cells)
        walls.append(time.perf_counter() - begin)
        works.append(time.process_time() - worked)
    return found, min(walls), min(works)


def rank_rows(sizes: Sequence[int] = tuple(PAPER_RANKS), rows: int = 2) -> Iterator[Row]:
    """Table 3: strong occluders by how many candidates are nearer.

    ``candidates``  "leading" are the bodies that the line between two corners meets, "any" those
                    that any of the 64 lines between corners does.  The paper says "at least one of
                    the rays", and has numbers as along a leading one, by which it searches.
    """
    boxes = paper_city()
    occluders = city_occluders(boxes, closed=True)
    for size in sizes:
        cells = paper_cells(size, rows)
        for candidates in ("leading", "any"):
            totals = np.zeros(11)
            for cell in range(len(cells)):
                totals += _ranks(occluders, cells, cell, candidates == "leading")
            row: dict[str, object] = {"cell": size, "candidates": candidates}
            for rank, mean in enumerate((totals / len(cells)).tolist()):
                name = f"{rank + 1}" if rank < 10 else "more"
                row[name], row[f"paper_{name}"] = mean, PAPER_RANKS[size][rank]
            yield row


def _ranks(occluders: StrongOccluders, cells: ViewCells, cell: int, leading: bool) -> FloatArray:
    """(11,) how many targets have their nearest strong occluder at each rank."""
    boxes = occluders.targets
    middle = 0.5 * (cells.low[cell] + cells.high[cell])
    gaps = np.maximum(np.maximum(boxes[:, 0] - middle, middle - boxes[:, 1]), 0.0)
    order = np.argsort((gaps**2).sum(axis=1), kind="stable")
    bodies = occluders.bodies
    ranks = np.full(len(boxes), -1, dtype=np.int64)
    corners = cell_of(cells, cell, 0.0)[0]
    rank_occluders(corners, bodies.planes, bodies.boxes.reshape(-1, 6), order, leading, ranks)
    return np.bincount(np.minimum(ranks[ranks >= 0], 10), minlength=11).astype(np.float64)


@inner_kernel
def rank_occluders(corners, planes, boxes, order, leading, ranks):  # type: ignore[no-untyped-def]
    """``ranks`` (n,) int64: of boxes (n, 6) that any of 64 segments meets, or the first of them
    where it is ``leading``, by ``order`` from near to far, how many come before the one that all
    meet; -1 without one."""
    points, low, high = np.empty((8, 3)), np.empty(3), np.empty(3)
    for target in range(len(boxes)):
        for k in range(8):
            points[k, 0] = boxes[target, 3 * (k >> 2)]
            points[k, 1] = boxes[target, 1 + 3 * ((k >> 1) & 1)]
            points[k, 2] = boxes[target, 2 + 3 * (k & 1)]
        for axis in range(3):
            low[axis] = min(boxes[target, axis], corners[:, axis].min())
            high[axis] = max(boxes[target, 3 + axis], corners[:, axis].max())
        rank = 0
        for place in range(len(order)):
            body = order[place]
            if body == target:
                continue
            if (boxes[body, :3] > high).any() or (boxes[body, 3:] < low).any():
                continue
            met = 0
            for i in range(len(corners)):
                for j in range(8):
                    met += meets(0, planes, 6 * body, 6 * body + 6, corners[i], points[j], 0.0)
                    if leading and met == 0:
                        break
                if leading and met == 0:
                    break
            if met == 64:
                ranks[target] = rank
                break
            if met > 0:
                rank += 1


def level_rows(rows: int = 20) -> Iterator[Row]:
    """Table 4: cells of 20 at once, and by those of 80 around them."""
    boxes = paper_city()
    for name, tactics in (("paper", replace(PAPERS_WAY, pieces=FIRST_PIECE)), ("ours", Tactics())):
        occluders = city_occluders(boxes, closed=name == "paper")
        fine, coarse = paper_cells(20.0, rows), paper_cells(80.0, 5)
        single = occluders.hide(fine, tactics)
        above = tactics if name == "paper" else replace(tactics, pieces=NO_PIECES)
        parents = occluders.hide(coarse, above)
        middles = 0.5 * (fine.low + fine.high)[:, :2]
        owner = np.array([coarse.containing(np.array([*one, 1.0]))[0] for one in middles])
        double = occluders.hide(fine, tactics, parents.hidden[owner])
        one, two, large = (each.work[:, RAYS].mean() for each in (single, double, parents))
        yield {
            "way": name,
            "tests_20": one,
            "paper_20": PAPER_TESTS[20],
            "tests_80": large,
            "paper_80": PAPER_TESTS[80],
            "tests_20_in_80": two,
            "paper_20_in_80": 57207,
            "ratio": (two + large / 16) / one,
            "paper_ratio": 29.0 / 85.2,
            "same_sets": bool(np.array_equal(single.hidden, double.hidden)),
        }


def sphere_rows(sizes: Sequence[int] = tuple(PAPER_SPHERES), seeds: int = 4) -> Iterator[Row]:
    """Table 5: boxes around 27,000 spheres, which hide each other, from a cube amid them.

    Means over some scenes, with the least and the most.
    """
    scenes = [_spheres(seed) for seed in range(seeds)]
    for size in sizes:
        cell = ViewCells.boxes(np.full((1, 3), -0.5 * size), np.full((1, 3), 0.5 * size))
        found = [scene.hide(cell, PAPERS_WAY) for scene in scenes]
        ours = [scene.hide(cell, Tactics(pieces=NO_PIECES)) for scene in scenes]
        counts = [int(one.hidden.sum()) for one in found]
        yield {
            "cell": size,
            "spheres": float(np.mean(counts)),
            "least": min(counts),
            "most": max(counts),
            "paper_spheres": PAPER_SPHERES[size],
            "tests": float(np.mean([one.work[0, RAYS] for one in found])),
            "paper_tests": PAPER_SPHERE_TESTS[size],
            "our_tests": float(np.mean([one.work[0, RAYS] for one in ours])),
        }


def _spheres(seed: int) -> StrongOccluders:
    """The spheres, each somewhere within its cube, around the place of one that is gone."""
    generator = np.random.default_rng(seed)
    along = (np.arange(SPHERES) - 0.5 * SPHERES + 0.5) * SPACING
    grid = np.stack(np.meshgrid(along, along, along, indexing="ij"), axis=-1).reshape(-1, 3)
    slack = 0.5 * SPACING - RADIUS
    centres = grid + generator.uniform(-slack, slack, grid.shape)
    gone = int(np.argmin(np.linalg.norm(grid - 0.5 * SPACING, axis=1)))
    centres = np.delete(centres, gone, axis=0) - grid[gone]
    boxes = np.stack([centres - RADIUS, centres + RADIUS], axis=1)
    bodies = ConvexBodies.of_spheres(centres, RADIUS, margin_of(boxes))
    starts = np.arange(len(boxes) + 1)
    return StrongOccluders(bodies, boxes, starts, np.zeros_like(starts), np.empty((0, 3, 3)))
