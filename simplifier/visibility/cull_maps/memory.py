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
from simplifier.visibility.cull_maps.cull_map import count_windows
from simplifier.visibility.solid.height_field import raster_over

_LIBRARIES = 60 * MIB  # scipy.ndimage, shapely and the kernels, beside what any run has
# Bytes of P: heights, the lowest roofs of what joins, and masks of it, or starts in place of these.
_RASTER_PIXEL = 12
_RASTER_TOUCH = 18  # of T: heights and masks of each object's window; objects and how high they are
# Of a terrain: heights as float64, starts, and what rounding takes, of the pixels or of the tops.
_TERRAIN_PIXELS = ((12, 25), (25, 8))
_MAPS_PIXEL = 10  # of P: heights, starts, and codes of the tops
_MAPS_WINDOW = 2  # of P for each window that occluders are shrunk by: their codes
_MAPS_TOUCH = 10  # of T: objects, how high they are, and the codes of that
_STRIP = 8192  # of a row of pixels: what is coded at once, as float64 and in copies
_CELL = 200  # bytes of a cell beside its set
_COARSER = 2.0**0.125  # steps in which a fitting epsilon is looked for
_STEPS = 200


def need_of_sets(
    upright: UprightScene, cells: ViewCells, pixel: float, fine: float, terrain: bool = False
) -> MemoryNeed:
    """Of finding sets over a raster of so large pixels, which are ``fine`` of an epsilon."""
    plan = np.array([cells.low[:, :2].min(axis=0), cells.high[:, :2].max(axis=0)])
    _, (nx, ny) = raster_over(upright, pixel, plan)
    pixels, touches = nx * ny, _touches(upright.boxes, pixel)
    meshes = upright.scene.meshes
    held = sum(MeshSize(len(mesh.vertices), len(mesh.faces)).held for mesh in meshes)
    sets = len(cells) * (len(upright.scene) + _CELL)
    raster = _RASTER_PIXEL * pixels + _RASTER_TOUCH * touches
    if terrain:
        raster = max(one * pixels + two * touches for one, two in _TERRAIN_PIXELS)
    windows = sum(count_windows(cells, pixel, half) for half in (1.0 / fine, 1.0))
    maps = (_MAPS_PIXEL + _MAPS_WINDOW * windows) * pixels + _MAPS_TOUCH * touches
    maps += _STRIP * ny + sets
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
            if need_of_sets(upright, cells, factor * pixel, fine, terrain).gib <= limit:
                return f"choose an epsilon of at least {_above(factor * pixel / fine):g}"
            factor *= _COARSER
        return "choose larger cells"

    need = need_of_sets(upright, cells, pixel, fine, terrain)
    check_need(need, memory_limit, where="epsilon", advise=advise)


def _touches(boxes: FloatArray, pixel: float) -> int:
    """At most so many pairs of a pixel and an object, by the objects' boxes (n, 2, 3)."""
    across = np.ceil((boxes[:, 1, :2] - boxes[:, 0, :2]) / pixel) + 3.0
    return int(across.prod(axis=1).sum())


def _above(value: float) -> float:
    """Three digits, not less."""
    digits = 10.0 ** (np.floor(np.log10(value)) - 2)
    return float(f"{np.ceil(value / digits) * digits:.3g}")
