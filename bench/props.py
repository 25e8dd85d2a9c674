"""Props and parts of machines in few triangles: ``python -m bench.props [NAME ...]``.

Closed shapes of up to ten thousand triangles, round ones and flat ones, as games and machines have
them.  The table is that of :mod:`bench.by_budget`; ``--presets draft,balanced``, ``--budgets
16,32,64`` and ``--seeds 2`` say what is run; names after that, which props.  If none is named, each
preset's rows go to ``bench/results/props_PRESET.csv`` and to ``props.md``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
import shapely
import shapely.affinity
import trimesh.creation

from bench.by_budget import Shapes, arguments, run
from bench.quality import RESULTS
from simplifier.geometry.mesh import FloatArray, TriangleMesh
from tests.solids import blob, box, joined, moved, rounded_box, sphere, torus

BUDGETS = (16, 32, 64, 128, 256)


def _of(mesh: trimesh.Trimesh) -> TriangleMesh:
    return TriangleMesh.from_soup(mesh.vertices, mesh.faces)


def _cut_finely(mesh: TriangleMesh, edge: float) -> TriangleMesh:
    """With no edge longer than that, as editors cut what is to be lit by vertex."""
    found = trimesh.remesh.subdivide_to_size(np.array(mesh.vertices), np.array(mesh.faces), edge)
    return TriangleMesh.from_soup(found[0], found[1])


def _circle(x: float, y: float, radius: float) -> shapely.Polygon:
    return shapely.Point(x, y).buffer(radius, quad_segs=12)


def extruded(outline: shapely.Polygon, height: float) -> TriangleMesh:
    return _of(trimesh.creation.extrude_polygon(outline, height))


def _plate() -> TriangleMesh:
    holes = [_circle(x, y, 0.12) for x in (0.3, 0.9, 1.5, 2.1, 2.7) for y in (0.3, 0.8, 1.3)]
    return extruded(shapely.box(0.0, 0.0, 3.0, 1.6).difference(shapely.union_all(holes)), 0.15)


def _gear() -> TriangleMesh:
    tooth = shapely.Polygon([(0.8, -0.12), (1.1, -0.06), (1.1, 0.06), (0.8, 0.12)])
    turned = [shapely.affinity.rotate(tooth, 360.0 * i / 20, origin=(0.0, 0.0)) for i in range(20)]
    wheel = shapely.union_all([_circle(0.0, 0.0, 0.9), *turned])
    return extruded(wheel.difference(_circle(0.0, 0.0, 0.3)), 0.35)


def _bracket() -> TriangleMesh:
    corner = [(0, 0), (2, 0), (2, 0.3), (0.5, 0.3), (0.3, 0.5), (0.3, 2), (0, 2)]
    return extruded(shapely.Polygon(corner), 1.0)


def _stairs() -> TriangleMesh:
    steps = [point for i in range(8) for point in ((i, i), (i, i + 1))]
    return extruded(shapely.Polygon([*steps, (8, 8), (8, 0)]), 3.0)


def _turned(profile: FloatArray) -> TriangleMesh:
    """Around the z axis: radii and heights (n, 2)."""
    return _of(trimesh.creation.revolve(profile, sections=48))


def _bottle() -> TriangleMesh:
    profile = [(0, 0), (0.5, 0), (0.55, 0.1), (0.55, 1.2), (0.45, 1.45), (0.2, 1.7), (0.17, 2.1),
               (0.2, 2.15), (0, 2.15)]  # fmt: skip
    return _turned(np.array(profile))


def _goblet() -> TriangleMesh:
    heights = np.linspace(0.0, 1.0, 24)
    outer = np.column_stack([0.08 + 0.45 * (heights - 0.35) ** 2 * 4.0, heights])
    inner = outer[:9:-1] * [0.9, 1.0] + [0.0, 0.01]
    return _turned(np.concatenate([[[0.0, 0.0]], outer, inner, [[0.0, inner[-1, 1]]]]))


def _knot() -> TriangleMesh:
    turn = np.linspace(0.0, 2.0 * np.pi, 161)
    path = np.column_stack([
        np.sin(turn) + 2.0 * np.sin(2.0 * turn), np.cos(turn) - 2.0 * np.cos(2.0 * turn),
        -np.sin(3.0 * turn),
    ])  # fmt: skip
    return _of(trimesh.creation.sweep_polygon(_circle(0.0, 0.0, 0.45), path))


def _crate() -> TriangleMesh:
    bars = [box(low=(0.0, 0.0, 0.0), extent=(1.0, 0.12, 0.12))]
    bars += [
        moved(bars[0], offset=[0.0, y, z]) for y, z in ((0.88, 0.0), (0.0, 0.88), (0.88, 0.88))
    ]
    turned = [
        TriangleMesh.from_soup(bar.vertices[:, list(order)], bar.faces)
        for bar in bars
        for order in ((1, 2, 0), (2, 0, 1))
    ]
    inside = box(low=(0.06, 0.06, 0.06), extent=(0.88, 0.88, 0.88))
    return _cut_finely(joined(*bars, *turned, inside), 0.2)


PROPS: dict[str, Callable[[], TriangleMesh]] = {
    "ball": lambda: sphere(rings=40),
    "capsule": lambda: _of(trimesh.creation.capsule(height=1.5, radius=0.5, count=[48, 48])),
    "cylinder": lambda: _of(trimesh.creation.cylinder(0.5, 1.6, sections=96)),
    "cone": lambda: _of(trimesh.creation.cone(0.6, 1.4, sections=96)),
    "pipe": lambda: _of(trimesh.creation.annulus(0.45, 0.5, 2.0, sections=96)),
    "ring": lambda: torus(around=64, across=32),
    "rock": lambda: blob(rings=40),
    "bottle": _bottle,
    "goblet": _goblet,
    "knot": _knot,
    "rounded box": rounded_box,
    "plate": _plate,
    "gear": _gear,
    "bracket": lambda: _cut_finely(_bracket(), 0.2),
    "stairs": lambda: _cut_finely(_stairs(), 1.0),
    "crate": _crate,
}
_ROUND = ("ball", "capsule", "cylinder", "cone", "pipe", "ring", "rock", "bottle", "goblet", "knot")


def props() -> Iterator[tuple[str, TriangleMesh]]:
    for name, make in PROPS.items():
        yield name, make()


def kind_of(name: str) -> str:
    return "round ones" if name in _ROUND else "flat ones"


def main(words: Sequence[str] | None = None) -> None:
    shapes = Shapes("props", props, kind_of, lambda name: {})
    run(shapes, arguments(__doc__, BUDGETS, words), RESULTS)


if __name__ == "__main__":
    main()
