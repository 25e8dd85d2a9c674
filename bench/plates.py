"""Signs, plates and what is cut from sheets in few triangles: ``python -m bench.plates [NAME]``.

Six outlines, each without any thickness and with a hundredth, a thirtieth and a tenth of its width;
half of them turned against the axes.  The table is that of :mod:`bench.by_budget`; ``--presets
draft,balanced``, ``--budgets 8,16,32,64`` and ``--seeds 2`` say what is run; names after that,
which plates.  If none is named, each preset's rows go to ``bench/results/plates_PRESET.csv`` and to
``plates.md``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
import shapely
import trimesh.creation
from scipy.spatial.transform import Rotation

from bench.by_budget import Shapes, arguments, run
from bench.props import extruded
from bench.quality import RESULTS
from simplifier.geometry.mesh import FloatArray, TriangleMesh

BUDGETS = (8, 16, 32, 64)
THICK = {"flat": 0.0, "sheet": 0.01, "plate": 0.03, "slab": 0.1}
"""Shares of the width."""

_TURN = Rotation.from_rotvec([0.7, 0.4, 0.2])
_ALL_AROUND = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)


def _around(radius: FloatArray | float) -> shapely.Polygon:
    """What is so far from the middle in each direction, of a width of about 1."""
    far = np.broadcast_to(radius, _ALL_AROUND.shape) / 2.0
    return shapely.Polygon(np.stack([far * np.cos(_ALL_AROUND), far * np.sin(_ALL_AROUND)], axis=1))


def _perforated() -> shapely.Geometry:
    rows = (-0.25, 0.0, 0.25)
    holes = [shapely.Point(x, y).buffer(0.06) for x in rows for y in rows]
    return _around(1.0).difference(shapely.union_all(holes))


def _letter() -> shapely.Geometry:
    """An A, of straight lines alone."""
    outer = [(-0.5, -0.5), (-0.12, 0.5), (0.12, 0.5), (0.5, -0.5), (0.33, -0.5), (0.23, -0.22),
             (-0.23, -0.22), (-0.33, -0.5)]  # fmt: skip
    return shapely.Polygon(outer, [[(-0.17, -0.06), (0.17, -0.06), (0.0, 0.38)]])


OUTLINES: dict[str, Callable[[], shapely.Geometry]] = {
    "disc": lambda: _around(1.0),
    "flower": lambda: _around(0.77 * (1.0 + 0.3 * np.cos(7.0 * _ALL_AROUND))),
    "gear": lambda: _around(0.91 * (1.0 + 0.1 * np.sign(np.cos(24.0 * _ALL_AROUND)))),
    "ring": lambda: _around(1.0).difference(_around(0.6)),
    "perforated": _perforated,
    "letter": _letter,
}


def _of(outline: shapely.Geometry, thick: float) -> TriangleMesh:
    if thick > 0.0:
        return extruded(outline, thick)
    points, faces = trimesh.creation.triangulate_polygon(outline)
    return TriangleMesh.from_soup(np.pad(points, ((0, 0), (0, 1))), faces)


def plates() -> Iterator[tuple[str, TriangleMesh]]:
    for index, (name, outline) in enumerate(OUTLINES.items()):
        for kind, thick in THICK.items():
            mesh = _of(outline(), thick)
            if index % 2:
                points = _TURN.apply(np.array(mesh.vertices))
                mesh = TriangleMesh.from_soup(points, mesh.faces)
            yield f"{name}, {kind}", mesh


def kind_of(name: str) -> str:
    return f"{name.rpartition(', ')[2]}s".replace("flats", "flat ones")


def main(words: Sequence[str] | None = None) -> None:
    shapes = Shapes("plates", plates, kind_of, lambda name: {})
    run(shapes, arguments(__doc__, BUDGETS, words), RESULTS)


if __name__ == "__main__":
    main()
