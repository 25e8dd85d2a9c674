"""Sets of visible objects -> pictures: plans of some sets, a cull map, and all cells by size."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import ListedColormap, Normalize
from numpy.typing import NDArray
from scipy import ndimage

from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.pvs import Pvs
from simplifier.geometry.scene import axis_order
from simplifier.geometry.solid import BoolArray
from simplifier.visibility.checking.check import viewpoints
from simplifier.visibility.checking.exact_view import prisms_of, seen_from
from simplifier.visibility.cull_maps.cull_map import CullMaps, umbra_heights
from simplifier.visibility.pictures.framed_figure import INK, PIXELS, rgb
from simplifier.visibility.pictures.plan import Plan, RgbArray, hillshade
from simplifier.visibility.pictures.plan_figure import STREET, PlanFigure
from simplifier.wording import count, percent, picture_line

SEEN, OPEN, HIDDEN, CELL = "#0072b2", "#e69f00", "#cfcfca", "#b5004f"
"""Colours that the colour-blind tell apart, in plans of sets."""

OUT = "#f0a860"
"""In cull maps, of what reaches out of the umbra."""

_SEEN, _OPEN, _HIDDEN = 1, 2, 3
_VIEWS = 60  # viewpoints from which objects are looked for
_MARGIN = 0.06  # of the longer side, around what is shown
_LEAST = 8.0  # lengths of a cell along the shorter side
_SLIMMEST = 0.7  # shorter side of a plan for its longer one
_MAP = "viridis"
_MOST, _SCALE = 0.95, 2.5  # the share of roofs that a scale of heights goes up to, and above it
_STEEP = 0.1  # of the picture's longer side: how high the relief of a cull map is for its light


def set_pictures(
    upright: UprightScene, pvs: Pvs, maps: CullMaps | None, name: str, seed: int = 0
) -> dict[str, bytes]:
    """PNGs by the names of their files; ``seed`` of the viewpoints that show what is seen.

    ``largest.png``, ``median.png`` and ``smallest.png`` are plans of these sets, ``umbra.png`` is
    the cull map of the cell with the median one, where there are any, ``cells.png`` has all cells.
    """
    sizes = set_sizes(pvs)
    done = pvs.computed[np.argsort(sizes[pvs.computed], kind="stable")]
    chosen = {
        "largest": int(done[-1]), "median": int(done[len(done) // 2]), "smallest": int(done[0])
    }  # fmt: skip
    made = {
        f"{which}.png": set_picture(upright, pvs, cell, name, f"{which} set", seed)
        for which, cell in chosen.items()
    }
    if maps is not None:
        made["umbra.png"] = umbra_picture(upright, pvs, maps, chosen["median"], name)
    made["cells.png"] = cells_picture(pvs, name, upright)
    return made


def set_sizes(pvs: Pvs) -> NDArray[np.int64]:
    """(c,) objects in the set of each cell; -1 of one that is not computed."""
    sizes = np.full(len(pvs.cells), -1, dtype=np.int64)
    known: dict[int, int] = {}
    for cell in pvs.computed.tolist():
        row = int(pvs.row_of[cell])
        if row not in known:
            known[row] = int(pvs.rows.row(row, len(pvs.names)).sum())
        sizes[cell] = known[row]
    return sizes


def set_picture(
    upright: UprightScene, pvs: Pvs, cell: int, name: str, which: str, seed: int = 0
) -> bytes:
    """The plan around a cell: what is seen from it, what else is in its set, and what is hidden."""
    kinds = _kinds(upright, pvs, cell, seed)
    low, high = window_around(upright, pvs, cell, kinds != _HIDDEN)
    plan = Plan.of(upright, kinds, low, high, PIXELS)
    figure = PlanFigure(
        low, high, origin=upright.origin, letters=plan_letters(pvs),
        title=f"{picture_line(name)}: what may be seen from cell {cell} ({which})",
        lines=_set_words(kinds, _within(upright, low, high)),
    )  # fmt: skip
    figure.show(plan.picture(coloured(plan, (STREET, SEEN, OPEN, HIDDEN), 0.62)))
    figure.draw_cell(pvs.cells.outline(cell), CELL)
    figure.legend(
        [(CELL, "the cell"), (SEEN, "seen"), (OPEN, "open: in the set, not proven"),
         (HIDDEN, "hidden")]
    )  # fmt: skip
    return figure.png()


def _set_words(kinds: NDArray[np.uint8], shown: BoolArray) -> str:
    seen, open_, hidden = (int((kinds == kind).sum()) for kind in (_SEEN, _OPEN, _HIDDEN))
    whether = f"{seen:,} are certainly seen" + (f", {open_:,} are open" if open_ else "")
    words = (
        f"{seen + open_:,} of {count(len(kinds), 'object')} are in the set: {whether}.\n"
        f"{hidden:,} are hidden ({percent(hidden / len(kinds))})"
    )
    beyond = int((~shown).sum())
    return words + (f", {beyond:,} of them beyond this picture." if beyond else ".")


def _within(upright: UprightScene, low: FloatArray, high: FloatArray) -> BoolArray:
    """(n,) the objects that reach into a window of the plan."""
    boxes = upright.boxes[:, :, :2]
    return np.asarray(((boxes[:, 0] <= high) & (boxes[:, 1] >= low)).all(axis=1))


def umbra_picture(upright: UprightScene, pvs: Pvs, maps: CullMaps, cell: int, name: str) -> bytes:
    """The cull map of a cell as a relief, and the objects that reach out of it."""
    visible = pvs.visible(cell)
    field = maps.field
    low, high = window_around(upright, pvs, cell, visible)
    low = np.maximum(low, field.low)
    high = np.minimum(high, field.low + field.cell * np.array(field.shape))
    plan = Plan.of(upright, np.ones(len(visible), dtype=np.uint8), low, high, PIXELS)
    umbra = umbra_heights(maps, pvs.cells, cell)
    # A tower or two would leave all others one colour.
    top = max(_SCALE * float(np.quantile(upright.boxes[:, 1, 2], _MOST)), 1e-9)
    levels = np.clip(umbra, 0.0, top)
    steep = _STEEP * float((high - low).max()) / top
    light = _sampled(
        hillshade(ndimage.gaussian_filter(levels * steep, 1.0), field.cell), maps, plan
    )
    umbra, levels = _sampled(umbra, maps, plan), _sampled(levels, maps, plan)
    colours = 255.0 * _umbra_colours()(levels / top)[..., :3] * (0.7 + 0.45 * light)[..., None]
    colours[umbra <= 0.0] = rgb(STREET)
    out, steps = plan.heights > umbra, plan.steps
    colours[out] = rgb(OUT)
    colours[steps] *= np.where(out[steps], 0.5, 0.62)[:, None]
    figure = PlanFigure(
        low, high, origin=upright.origin, letters=plan_letters(pvs), bar=True,
        title=f"{picture_line(name)}: the umbra of cell {cell}",
        lines="What lies below the blue surface is hidden from all of the cell.\n"
        "Orange parts of objects reach out of it; outlines show those that do not.",
    )  # fmt: skip
    figure.show(plan.picture(np.clip(colours, 0.0, 255.0).astype(np.uint8)))
    figure.draw_cell(pvs.cells.outline(cell), CELL)
    figure.legend([(CELL, "the cell"), (OUT, "out of the umbra"), (STREET, "nothing is hidden")])
    mapping = ScalarMappable(Normalize(0.0, top), _umbra_colours())
    figure.colour_bar(mapping, "hidden up to,\nunits", extend="max")
    return figure.png()


def _umbra_colours() -> ListedColormap:
    """Deeper umbrae are darker, though not so dark that outlines are lost in them."""
    return ListedColormap(colormaps["YlGnBu"](np.linspace(0.2, 0.86, 256)))


def cells_picture(pvs: Pvs, name: str, upright: UprightScene | None = None) -> bytes:
    """All cells by the size of their sets, over the objects of the scene, if it is given."""
    sizes = set_sizes(pvs)
    low = pvs.cells.low[:, :2].min(axis=0)
    high = pvs.cells.high[:, :2].max(axis=0)
    if upright is not None:
        low = np.minimum(low, upright.boxes[:, 0, :2].min(axis=0))
        high = np.maximum(high, upright.boxes[:, 1, :2].max(axis=0))
    low, high = _with_margin(low, high, 0.02)
    done = sizes[sizes >= 0]
    figure = PlanFigure(
        low, high, origin=pvs.origin, letters=plan_letters(pvs), bar=True,
        title=f"{picture_line(name)}: how many objects each cell may see",
        lines=f"The sets of {len(done):,} of {count(len(sizes), 'cell')} hold"
        f" {int(done.min()):,} to {int(done.max()):,} of {count(len(pvs.names), 'object')},"
        f" {int(np.median(done)):,} in the median.",
    )  # fmt: skip
    if upright is not None:
        plan = Plan.of(upright, np.ones(len(upright.scene), np.uint8), low, high, PIXELS)
        figure.show(plan.picture(coloured(plan, (STREET, HIDDEN), 0.8)))
        figure.show_lines(plan.picture(np.repeat(255 * plan.steps[..., None], 3, 2).astype("u1")))
    least, most = float(done.min()), float(max(done.max(), done.min() + 1))
    mapping = ScalarMappable(Normalize(least, most), _MAP)
    order = np.argsort(sizes, kind="stable")  # of cells that overlap the larger set is on top
    figure.axes.add_collection(
        PolyCollection(
            [pvs.cells.outline(cell) for cell in order.tolist()],
            facecolors=[
                mapping.to_rgba(size) if size >= 0 else "none" for size in sizes[order].tolist()
            ],
            edgecolors=INK,
            linewidths=0.25, zorder=3,
        )
    )  # fmt: skip
    entries = [(HIDDEN, "objects")] if upright is not None else []
    if len(done) < len(sizes):
        entries.append((STREET, "without a colour: not computed, sees all"))
    figure.legend(entries)
    figure.colour_bar(mapping, "objects\nin the set")
    return figure.png()


def _kinds(upright: UprightScene, pvs: Pvs, cell: int, seed: int) -> NDArray[np.uint8]:
    """(n,) whether each object is certainly seen, in the set, or hidden."""
    visible = pvs.visible(cell)
    prisms = prisms_of(upright.scene, pvs.up)
    places = viewpoints(pvs.cells, cell, _VIEWS, np.random.default_rng(seed))
    found = seen_from(prisms, places + (pvs.origin - prisms.origin))
    proven = ~np.isnan(found).all(axis=0)
    return np.where(visible, np.where(proven, _SEEN, _OPEN), _HIDDEN).astype(np.uint8)


def window_around(
    upright: UprightScene, pvs: Pvs, cell: int, shown: NDArray[np.bool_]
) -> tuple[FloatArray, FloatArray]:
    """(2,) low and high corner of the plan around a cell and the objects that are shown."""
    outline = pvs.cells.outline(cell)
    low, high = outline.min(axis=0), outline.max(axis=0)
    least = _LEAST * (high - low).max()
    if shown.any():
        low = np.minimum(low, upright.boxes[shown, 0, :2].min(axis=0))
        high = np.maximum(high, upright.boxes[shown, 1, :2].max(axis=0))
    low, high = _with_margin(low, high, _MARGIN)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    half = np.maximum(half, max(0.5 * least, _SLIMMEST * half.max()))
    # Rather more of the scene than what lies beside it.
    outer = upright.boxes[:, :, :2].reshape(-1, 2)
    first, last = _with_margin(outer.min(axis=0), outer.max(axis=0), _MARGIN)
    room = np.maximum(0.5 * (last - first) - half, 0.0)
    middle = np.where(
        room > 0.0,
        np.clip(middle, 0.5 * (first + last) - room, 0.5 * (first + last) + room),
        middle,
    )
    return middle - half, middle + half


def _with_margin(low: FloatArray, high: FloatArray, share: float) -> tuple[FloatArray, FloatArray]:
    margin = share * (high - low).max()
    middle, half = 0.5 * (low + high), 0.5 * (high - low) + margin
    half = np.maximum(half, _SLIMMEST * half.max())
    return middle - half, middle + half


def _sampled(umbra: FloatArray, maps: CullMaps, plan: Plan) -> FloatArray:
    """Heights of a raster in the columns of a plan, minus infinite where it has none."""
    field = maps.field
    places = [
        np.floor(
            (plan.low[axis] + plan.cell * (np.arange(plan.heights.shape[axis]) + 0.5)
             - field.low[axis]) / field.cell
        ).astype(np.int64)
        for axis in (0, 1)
    ]  # fmt: skip
    padded = np.pad(umbra, 1, constant_values=-np.inf)
    x, y = (np.clip(one + 1, 0, padded.shape[axis] - 1) for axis, one in enumerate(places))
    return np.asarray(padded[np.ix_(x, y)])


def coloured(plan: Plan, colours: Sequence[str], outline: float) -> RgbArray:
    """(nx, ny, 3) by kind, darker by a factor where the outlines are."""
    shades = np.array([rgb(one) for one in colours])
    table = np.concatenate([shades, outline * shades]).astype(np.uint8)
    return np.asarray(table[plan.kinds + len(colours) * plan.steps.astype(np.uint8)])


def plan_letters(pvs: Pvs) -> str:
    """Those of the two axes of the plan."""
    order = axis_order(pvs.up)
    return "xyz"[order[0]] + "xyz"[order[1]]
