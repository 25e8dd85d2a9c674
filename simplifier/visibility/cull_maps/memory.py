"""What finding sets will need of memory, before it is taken.

P pixels of the raster, T pairs of a pixel and an object that touches it.
"""

from __future__ import annotations

import numpy as np

from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.view_cells import ViewCells
from simplifier.memory.limit import check_need
from simplifier.memory.need import MIB, MemoryNeed, MeshSize
from simplifier.visibility.solid.height_field import raster_over

_LIBRARIES = 60 * MIB  # scipy.ndimage, shapely and the kernels, beside what any run has
_RASTER_PIXEL = 48  # bytes of P: heights as float64 twice, masks, counts and starts
_RASTER_TOUCH = 57  # of T: heights and masks of each object's window, pixels, their order, copies
_TERRAIN_PIXEL, _TERRAIN_TOUCH = 34, 20  # heights as float64, starts, roundings; tops twice
# Of P: the field; three erosions, each in two orders: two for edges along x and along y, and one
# for the close look; and what the last one is made of.
_MAPS_PIXEL = 76
_MAPS_TOUCH = 8  # of T: objects and how high they are
_CELL = 200  # bytes of a cell beside its set
_COARSER = 2.0**0.125  # steps in which a fitting epsilon is looked for
_STEPS = 200


def need_of_sets(
    upright: UprightScene, cells: ViewCells, pixel: float, terrain: bool = False
) -> MemoryNeed:
    """Of finding sets over a raster of so large pixels."""
    plan = np.array([cells.low[:, :2].min(axis=0), cells.high[:, :2].max(axis=0)])
    _, (nx, ny) = raster_over(upright, pixel, plan)
    pixels, touches = nx * ny, _touches(upright.boxes, pixel)
    meshes = upright.scene.meshes
    held = sum(MeshSize(len(mesh.vertices), len(mesh.faces)).held for mesh in meshes)
    sets = len(cells) * (len(upright.scene) + _CELL)
    raster = _RASTER_PIXEL * pixels + _RASTER_TOUCH * touches
    if terrain:
        raster = _TERRAIN_PIXEL * pixels + _TERRAIN_TOUCH * touches
    maps = _MAPS_PIXEL * pixels + _MAPS_TOUCH * touches + sets
    return MemoryNeed({"raster": raster, "maps": maps}).beside(_LIBRARIES + held)


def check_memory(
    upright: UprightScene,
    cells: ViewCells,
    pixel: float,
    fine: float,
    memory_limit: float | None,
    terrain: bool = False,
) -> None:
    """Raise :class:`~simplifier.errors.MemoryLimitError` where a raster of so large pixels needs
    more than ``memory_limit`` GiB, None for half of the machine's.

    ``fine``  a pixel's share of an epsilon: the message names an epsilon that fits.
    """

    def advise(limit: float) -> str:
        factor = _COARSER
        for _ in range(_STEPS):
            if need_of_sets(upright, cells, factor * pixel, terrain).gib <= limit:
                return f"choose an epsilon of at least {_above(factor * pixel / fine):g}"
            factor *= _COARSER
        return "choose larger cells"

    need = need_of_sets(upright, cells, pixel, terrain)
    check_need(need, memory_limit, where="epsilon", advise=advise)


def _touches(boxes: FloatArray, pixel: float) -> int:
    """At most so many pairs of a pixel and an object, by the objects' boxes (n, 2, 3)."""
    across = np.ceil((boxes[:, 1, :2] - boxes[:, 0, :2]) / pixel) + 3.0
    return int(across.prod(axis=1).sum())


def _above(value: float) -> float:
    """Three digits, not less."""
    digits = 10.0 ** (np.floor(np.log10(value)) - 2)
    return float(f"{np.ceil(value / digits) * digits:.3g}")
