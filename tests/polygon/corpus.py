"""Polygons that polygon code must survive: named shapes, and one for every bug that was met.

:data:`POLYGONS` are valid; :data:`PINCHED` visit a corner more than once, as loops of pixels do.
:func:`variants` turns, mirrors and clutters one.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.ndimage import gaussian_filter

from simplifier.geometry.section import Plane, Polygon, Section
from simplifier.polygon.simplify import simplify_polygon
from simplifier.slicing.loops import edge_loops

PLANE = Plane(np.eye(3), 0.0)


def picture(*rows: str) -> np.ndarray:
    return np.array([[c == "#" for c in row] for row in rows])


def pieces(mask: np.ndarray) -> list[Polygon]:
    return edge_loops(Section(PLANE, mask, np.zeros(2), 1.0))


def largest(*rows: str) -> Polygon:
    return max(pieces(picture(*rows)), key=lambda p: p.area)


def loop(*points: tuple[float, float]) -> np.ndarray:
    return np.array(points, dtype=np.float64)


def square(x: float, y: float, size: float) -> np.ndarray:
    """Clockwise, as holes are."""
    return loop((x, y), (x, y + size), (x + size, y + size), (x + size, y))


def box(width: float, height: float) -> np.ndarray:
    return loop((0, 0), (width, 0), (width, height), (0, height))


def star(points: int, inner: float, outer: float) -> np.ndarray:
    angle = np.arange(2 * points) * np.pi / points
    radius = np.where(np.arange(2 * points) % 2, inner, outer)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


def comb(teeth: int) -> np.ndarray:
    points = [(0.0, 0.0), (2.0 * teeth - 1.0, 0.0)]
    for tooth in reversed(range(teeth)):
        x = 2.0 * tooth
        points += [(x + 1, 8), (x, 8), (x, 1), (x - 1, 1)]
    return loop(*points[:-2])


def spiral(turns: float, count: int) -> np.ndarray:
    angle = np.linspace(0.5, turns * 2.0 * np.pi, count)
    direction = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    inner, outer = direction * angle[:, None], direction * (angle[:, None] + 3.0)
    return np.concatenate([outer, inner[::-1]])


def random_star(seed: int, count: int, holes: int) -> Polygon:
    """A star-shaped loop of ``count`` random radii with small squares near its centre."""
    rng = np.random.default_rng(seed)
    angle = (np.arange(count) + rng.uniform(0.1, 0.9, count)) * 2.0 * np.pi / count
    radius = rng.uniform(6.0, 20.0, count)
    outer = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    # Within 3 of the centre, which chords of loops of nine or more points at 6 leave free.
    cells = rng.permutation(16)[:holes]
    return Polygon(
        outer,
        tuple(
            square(cell % 4 - 2 + rng.uniform(0.05, 0.3), cell // 4 - 2 + 0.1, 0.5)
            for cell in cells
        ),
    )


def blobs(seed: int, size: int = 32) -> np.ndarray:
    """A mask of smoothed or raw noise."""
    rng = np.random.default_rng(seed)
    blur = rng.choice([0.0, 0.6, 1.0, 2.0])
    noise = rng.normal(size=rng.integers(3, size, 2))
    field = gaussian_filter(noise, blur) if blur else noise
    return np.asarray(field > np.quantile(field, rng.uniform(0.15, 0.85)))


def simplified_blobs(seed: int, tolerance: float) -> Iterator[Polygon]:
    """The polygons of a random mask, as far as simplification leaves them."""
    for piece in pieces(blobs(seed, 24)):
        polygon = simplify_polygon(piece, tolerance)
        if polygon is not None:
            yield polygon


def maze(seed: int, cells: int) -> np.ndarray:
    """Corridors of a random spanning tree of a square grid: one piece, no hole, many turns."""
    rng = np.random.default_rng(seed)
    mask = np.zeros((2 * cells + 1, 2 * cells + 1), dtype=bool)
    stack = [(0, 0)]
    mask[1, 1] = True
    while stack:
        r, c = stack[-1]
        ways = [
            (r + dr, c + dc)
            for dr, dc in ((0, 1), (1, 0), (0, -1), (-1, 0))
            if 0 <= r + dr < cells
            and 0 <= c + dc < cells
            and not mask[2 * (r + dr) + 1, 2 * (c + dc) + 1]
        ]
        if not ways:
            stack.pop()
            continue
        nr, nc = ways[rng.integers(len(ways))]
        mask[r + nr + 1, c + nc + 1] = mask[2 * nr + 1, 2 * nc + 1] = True
        stack.append((nr, nc))
    return mask


POLYGONS: dict[str, Polygon] = {
    "triangle": Polygon(loop((0, 0), (4, 0), (1, 3))),
    "square": Polygon(box(5, 5)),
    "star": Polygon(star(7, 2.0, 9.0)),
    "comb": Polygon(comb(6)),
    "spiral": Polygon(spiral(2.0, 40)),
    "square_with_three_holes": Polygon(
        box(12, 12), (square(1, 1, 3), square(7, 2, 2), square(4, 7, 3))
    ),
    "holes_in_a_row": Polygon(box(20, 5), tuple(square(2 + 4 * i, 2, 1) for i in range(4))),
    "holes_in_a_column": Polygon(box(5, 20), tuple(square(2, 2 + 4 * i, 1) for i in range(4))),
    "hole_near_the_wall": Polygon(box(10, 10), (square(10 - 1e-3 - 4, 1e-3, 4),)),
    "hole_as_wide_as_the_box": Polygon(box(10, 10), (square(1e-3, 1e-3, 10 - 2e-3),)),
    "long_slit": Polygon(loop((0, 0), (30, 0), (30, 5), (2, 5.01), (30, 5.02), (30, 10), (0, 10))),
    "diamond_hole_on_a_vertex_ray": Polygon(
        loop((0, 0), (8, 0), (6, 3), (8, 6), (0, 6)), (loop((1, 3), (2, 4), (3, 3), (2, 2)),)
    ),
    # Straight points on one side of a bridge went first; those across then hid every ear.
    "straight_points_across_a_bridge": largest(
        "##.###", "#####.", "#.####", "#.####", "#.##.#", "######"
    ),
    # At a tolerance of 2 the chords of the shaft and of the hook cross.
    "hook_that_crosses_itself": largest("#.#.", "##.#", "##.#", ".###", "#..#"),
    "maze": pieces(maze(1, 6))[0],
}

PINCHED: dict[str, Polygon] = {
    "pinched_figure_eight": largest("###.", "#.##", "##..", "####"),
    "pinched_ring": largest("###", "#.#", "##."),
    "pinched_hole": largest("#####", "#.###", "##.##", "###.#", "#####"),
    "pinched_all_over": largest("#######", "#.#.#.#", "##.#.##", "#.#.#.#", "#######"),
}


def _turned(points: np.ndarray) -> np.ndarray:
    c, s = np.cos(0.7), np.sin(0.7)
    return points @ np.array([[c, s], [-s, c]]) + [3.1, -7.3]


def _mirrored(points: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(points[::-1] * [-1.0, 1.0])


def _halved(points: np.ndarray) -> np.ndarray:
    """With the middle of every edge."""
    middles = (points + np.roll(points, -1, axis=0)) / 2.0
    return np.stack([points, middles], axis=1).reshape(-1, 2)


def _doubled(points: np.ndarray) -> np.ndarray:
    return np.repeat(points, 2, axis=0)


def variants(polygon: Polygon, *, cluttered: bool = True) -> Iterator[tuple[str, Polygon]]:
    """The polygon itself, turned, mirrored, with straight and with repeated points."""
    changes = {"plain": np.array, "turned": _turned, "mirrored": _mirrored, "halved": _halved}
    if cluttered:
        changes["doubled"] = _doubled
    for name, change in changes.items():
        yield name, Polygon(change(polygon.outer), tuple(change(h) for h in polygon.holes))
        if name == "halved":
            yield (
                "halved and turned",
                Polygon(
                    _turned(change(polygon.outer)),
                    tuple(_turned(change(h)) for h in polygon.holes),
                ),
            )
