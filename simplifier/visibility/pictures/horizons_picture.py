"""The horizons of a column of a terrain -> a picture: how high one must rise to see each tile."""

from __future__ import annotations

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.pvs import NEVER, Pvs
from simplifier.visibility.pictures.framed_figure import PIXELS, rgb
from simplifier.visibility.pictures.pictures import CELL, HIDDEN, set_sizes
from simplifier.visibility.pictures.plan import Plan, hillshade
from simplifier.visibility.pictures.plan_figure import STREET, PlanFigure
from simplifier.wording import count, picture_line

_SHADES = 200  # of altitudes, between what is seen from the ground and what is not seen
_SOFTEST, _LIGHT = 0.75, 0.4  # how dark slopes in the shade are, and how much light others add
_STEEP = 0.1  # of the picture's longer side: how high the relief is for its light


def horizons_picture(upright: UprightScene, pvs: Pvs, name: str) -> bytes:
    """A plan of all tiles, from the column with the median set, by the altitude over its lowest
    ground from which they are seen.  ``pvs`` has altitudes.
    """
    assert pvs.altitudes is not None
    sizes = set_sizes(pvs)
    done = pvs.computed[np.argsort(sizes[pvs.computed], kind="stable")]
    cell = int(done[len(done) // 2])
    numbers = pvs.altitudes.values[cell].astype(np.float64)
    ground = float(pvs.cells.low[cell, 2])
    climb = np.where(numbers == 0, 0.0, pvs.altitudes.low + pvs.altitudes.step * numbers - ground)
    high = float(upright.boxes[:, 1, 2].max()) - ground
    never = (climb >= high) | (numbers == NEVER)
    from_ground = climb <= 0.0
    shade = 2 + np.clip(_SHADES * climb / high, 0, _SHADES - 1)
    kinds = np.where(from_ground, 1, np.where(never, 2 + _SHADES, shade)).astype(np.int64)
    low, end = upright.boxes[:, 0, :2].min(axis=0), upright.boxes[:, 1, :2].max(axis=0)
    plan = Plan.of(upright, np.ones(len(kinds), np.uint8), low, end, PIXELS)
    shown = np.zeros(plan.kinds.shape, dtype=np.int64)
    places = np.rint((upright.boxes[:, :, :2] - low) / plan.cell).astype(np.int64)
    for kind, ((x0, y0), (x1, y1)) in zip(kinds.tolist(), places.tolist(), strict=True):
        shown[x0:x1, y0:y1] = kind
    shown[plan.kinds == 0] = 0
    mapping = ScalarMappable(Normalize(0.0, high), colormaps["viridis_r"])
    table = np.zeros((3 + _SHADES, 3))
    table[0] = table[1] = rgb(STREET)
    table[2:-1] = 255.0 * mapping.to_rgba((np.arange(_SHADES) + 0.5) * high / _SHADES)[:, :3]
    table[-1] = 0.55 * rgb(HIDDEN)
    levels = np.where(np.isfinite(plan.heights), plan.heights, 0.0)
    light = hillshade(levels * (_STEEP * float((end - low).max()) / max(high, 1e-9)), plan.cell)
    colours = table[shown] * (_SOFTEST + _LIGHT * light)[..., None]
    figure = PlanFigure(
        low, end, origin=upright.origin, letters="xy", bar=True,
        title=f"{picture_line(name)}: horizons of column {cell}",
        lines=f"Of {count(len(climb), 'tile')} {int(from_ground.sum()):,} are seen from its lowest"
        f" ground, {int((~from_ground & ~never).sum()):,} from higher up,\n"
        f"and {int(never.sum()):,} from no altitude up to the terrain's top.",
    )  # fmt: skip
    figure.show(plan.picture(np.clip(colours, 0.0, 255.0).astype(np.uint8)))
    figure.draw_cell(pvs.cells.outline(cell), CELL)
    figure.legend(
        [(CELL, "the column"), (STREET, "seen from its ground"),
         (_hex(table[-1]), "not seen up to the terrain's top")]
    )  # fmt: skip
    figure.colour_bar(mapping, "seen from\nso high up,\nunits")
    return figure.png()


def _hex(colour: FloatArray) -> str:
    return "#" + "".join(f"{int(value):02x}" for value in colour)
