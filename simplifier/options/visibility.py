"""What ``occluder pvs`` can be told."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from simplifier.options.fields import OptionSet, option, shared
from simplifier.options.simplify import EYE_HEIGHT, Axis, SimplifyOptions, Transparent

SEE_THROUGH_HELP = (
    "Transparent surfaces can be seen, but must not occlude: leave-out makes sure of that, keep"
    " treats them as solid."
)

Method = Literal["auto", "cull-map", "slice-wise", "voxel-column", "strong"]
Placing = Literal["walkable", "grid", "triangles", "floors"]
Fill = Literal["outside", "viewers"]
Backend = Literal["cpu", "opengl"]


@dataclass(frozen=True)
class PvsOptions(OptionSet):
    """How what is visible from view cells is found.

    ``method``       "cull-map", shadows of all that stands on the ground, fused; "slice-wise",
                     planes through whatever is closed or flat, for rooms and all else that has no
                     one height, in voxels of a fifth of the epsilon; "voxel-column", of elevation
                     models, the altitude over each tile from which each other one is seen;
                     "strong", what one convex occluder hides by itself, of any scene, best from
                     cells smaller than the occluders; "auto" is what serves the scene.
    ``cell_size``    edge of a cell in plan; smaller ones have smaller sets, and there are more.
    ``eye_height``   of the top of a cell over the ground: viewers are no higher.
    ``epsilon``      half the length of a cell's edge that one point on it stands for; occluders
                     are shrunk by so much along it, and by a fifth of it to all sides; what is left
                     is looked for again with a fifth of it along the edge as well.  Less shows less
                     that is hidden, and takes longer.  None is half the cell size, and one
                     post of an elevation model by voxel columns, whose epsilon is whole posts.
    ``backend``      what draws cull maps; both are conservative.  On graphics hardware ``opengl``
                     draws without the processor; it does not look again, so that its sets are
                     about a tenth larger.
    ``ground``       what stands on a border of its own stands on the ground there, and no viewer
                     looks under it.
    ``fill``         what is solid: "outside", objects that are closed, or open where they meet the
                     ground; "viewers", also what no view cell reaches through free space, which is
                     for scenes of open sheets, and right but for holes of a pixel or two.
    ``slices``       by cull maps on the processor, also which eighths of each visible object's box
                     along each axis are hidden, so that of large objects a part is drawn.  About
                     three times the time, and three bytes a visible object.
    ``skip_buried``  leave cells out that lie in an object wholly, in place of refusing them.
    ``seed``         of where pictures look from, and of the lines that slices try first, by which
                     sets differ at most in what shows through gaps of less than half a voxel.  All
                     else hangs on no chance.
    """

    method: Method = option(
        "auto",
        "How visible sets are found: auto (chosen for the scene), cull-map (objects on the ground),"
        " slice-wise (rooms and bridges), voxel-column (elevation models), or strong (one convex"
        " occluder hides an object).",
        group="Quality",
    )
    cell_size: float = option(
        10.0, "Width of a view cell, in the scene's units.",
        above=0.0, unit="world units", group="Input and scene",
    )  # fmt: skip
    eye_height: float = shared(
        SimplifyOptions, "eye_height",
        help="Maximum height of a viewer's eyes above the ground, in the scene's units."
        f" {EYE_HEIGHT:g} suits metres.",
    )  # fmt: skip
    backend: Backend = option("cpu", "What draws cull maps: cpu, or opengl (needs the 'gl' extra).")
    epsilon: float | None = option(
        None, "Half the spacing of sampled viewpoints along a cell's edge, in the scene's units."
        " Less gives smaller sets and takes longer.",
        above=0.0, absent="half the cell size", unit="world units", group="Quality",
    )  # fmt: skip
    up: Axis = shared(SimplifyOptions, "up", help="The scene's up axis: x, y or z.")
    ground: bool = shared(
        SimplifyOptions, "ground", help="Objects stand on the ground. Closes their open bases."
    )
    fill: Fill = option(
        "outside",
        "What is solid: outside (closed objects), or viewers (also what no view cell reaches).",
        group="Input and scene",
    )
    slices: bool = option(
        False,
        "Also find which slices of each visible object are hidden. Takes three times as long.",
        group="Quality",
    )  # fmt: skip
    skip_buried: bool = option(
        False, "Leave out view cells that lie within an object.", group="Input and scene"
    )
    transparent: Transparent = shared(
        SimplifyOptions, "transparent", help=SEE_THROUGH_HELP, of_result=False
    )
    time_limit: float | None = shared(
        SimplifyOptions, "time_limit",
        help="Seconds to spend. From view cells that are left, everything counts as visible.",
        absent="no limit",
    )  # fmt: skip

    seed: int = shared(
        SimplifyOptions, "seed",
        help="Seed of the pictures' viewpoints, and of the lines that slices try first.",
    )  # fmt: skip
    memory_limit: float | None = shared(SimplifyOptions, "memory_limit")

    @property
    def reach(self) -> float:
        """Half the length of edge that one point stands for."""
        return 0.5 * self.cell_size if self.epsilon is None else self.epsilon


@dataclass(frozen=True)
class ElevationOptions(OptionSet):
    """How an elevation model becomes a scene.

    ``spacing``  between posts along x and y; an array has none of its own.
    ``tile``     squares of four posts along a side of an object; larger ones make smaller files,
                 and sets that are further from what is seen.
    """

    spacing: tuple[float, ...] | None = option(
        None, "Distance between the posts of an elevation model, DX,DY, in world units. A .npy"
        " needs it.", kind="lengths", count=2, absent="the GeoTIFF's", unit="world units",
        group="Input and scene",
    )  # fmt: skip
    tile: int = option(
        16, "Posts of an elevation model along the side of each object.",
        low=1, high=65_536, unit="posts", group="Input and scene",
    )  # fmt: skip


@dataclass(frozen=True)
class VisibilityOptions(ElevationOptions, PvsOptions):
    """All that visible sets of a file hang on: scene, cells and method.

    ``cells``  where cells are placed, as :func:`~simplifier.visibility.placing.cells.place_cells`
               says; those that lie in an object are left out.
    """

    cells: Placing = option(
        "walkable", "Where view cells lie: walkable, grid, triangles, or floors (of rooms).",
        group="Input and scene",
    )  # fmt: skip
