"""What ``occluder scene``, ``occluder path`` and ``occluder cull`` can be told."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from simplifier.checks import check_whole
from simplifier.errors import OptionError
from simplifier.options.fields import OptionSet, option, shared
from simplifier.options.simplify import EYE_HEIGHT, Axis, SimplifyOptions, Transparent

LEAST_FOV = 1e-6
"""The narrowest field of view of a lens, degrees."""

LARGEST_SCREEN = 16_384
"""The most pixels along a side of a picture that is drawn."""

TRANSPARENT_HELP = (
    "Transparent surfaces must not occlude: leave-out ignores them, keep treats them as solid."
)

PathKind = Literal["street", "roof", "inside"]


@dataclass(frozen=True)
class SceneOptions(OptionSet):
    """How the occluders of a scene are made.

    ``budget``       most triangles of a leaf's near occluder; inner nodes have half of it and far
                     occluders of leaves a quarter, and a mesh of up to four times as many is its
                     own near one.
    ``resolution``   raising it makes occluders of use from nearer by, and costs time.
    ``up``, ``ground``, ``smallest_hole``, ``conservative``  as for a single mesh; the ground is
                     where each object stands, and the hole is in world units for all.
    ``overhang``     of the leaves' near occluders, which are drawn as if they were exact; all
                     others have an error that is answered for when they are drawn.
    ``pixel_error``  nodes whose occluder is never that exact from within the scene get none.
    ``preview``      whether all leaves' occluders are written to ``preview.glb``, too.

    Raises :class:`~simplifier.errors.OptionError` for what is out of range.
    """

    budget: int = shared(
        SimplifyOptions, "budget",
        help="Maximum number of triangles in an object's occluder. Nodes above have half.",
    )  # fmt: skip
    resolution: int = shared(
        SimplifyOptions,
        "resolution",
        64,
        absent="",
        help="Voxels along the longest edge of each node.",
    )
    width: int = option(8, "Maximum number of children of a node.", low=2, high=64)
    moves: int = shared(
        SimplifyOptions, "moves", 2400, absent="", help="Number of refining moves for each node."
    )
    up: Axis = shared(SimplifyOptions, "up", help="The scene's up axis: x, y or z.")
    ground: bool = shared(
        SimplifyOptions, "ground", help="Objects stand on the ground. Closes their open bases."
    )
    smallest_hole: float = shared(
        SimplifyOptions, "smallest_hole",
        help="Closes openings narrower than this, in the scene's units.",
    )  # fmt: skip
    conservative: bool = shared(SimplifyOptions, "conservative")
    overhang: float = shared(
        SimplifyOptions, "overhang",
        help="How much an object's near occluder may cover beside it, as a share of its silhouette."
        " A lower share hides less; 0 keeps the occluder wholly inside.",
    )  # fmt: skip
    pixel_error: float = option(
        0.5, "Maximum error of what is drawn, in pixels of the depth buffer.",
        above=0.0, high=1000.0, unit="pixels", group="Quality",
    )  # fmt: skip
    rows: int = option(
        180, "Height of the depth buffer, in pixels.",
        low=1, high=LARGEST_SCREEN, unit="pixels", group="Quality",
    )  # fmt: skip
    fov: float = option(
        60.0, "Vertical field of view, in degrees.",
        low=LEAST_FOV, high=179.0, unit="degrees", group="Quality",
    )  # fmt: skip
    preview: bool = option(
        False, "Also write the occluders of all objects to preview.glb, to look at.",
        of_result=False, group="Output",
    )  # fmt: skip
    seed: int = shared(SimplifyOptions, "seed")
    memory_limit: float | None = shared(SimplifyOptions, "memory_limit")


@dataclass(frozen=True)
class PathOptions(OptionSet):
    """A walk or a flight through a scene.

    ``kind``        ``street``: between the objects; ``roof``: above them; ``inside``: through
                    rooms.
    ``frames``      more of them lie closer together or lead further.
    ``eye_height``  of a walker's eyes over the ground, world units; 1.7 is right where the unit is
                    a metre.
    """

    kind: PathKind = option(
        "street",
        "street (between the objects), roof (above them), or inside (through rooms and doors).",
        group="Input and scene",
    )
    frames: int = option(
        60, "Number of cameras along the path.", low=1, high=100_000, group="Output"
    )
    up: Axis = shared(SimplifyOptions, "up", help="The scene's up axis: x, y or z.")
    eye_height: float = option(
        EYE_HEIGHT, "Height of the eyes above the ground, in the scene's units. All other lengths"
        f" of the path are multiples of it. {EYE_HEIGHT:g} suits metres.",
        low=0.0, unit="world units", group="Input and scene",
    )  # fmt: skip
    fov: float = option(
        60.0, "Vertical field of view, in degrees.",
        low=1.0, high=170.0, unit="degrees", group="Output",
    )  # fmt: skip
    transparent: Transparent = shared(
        SimplifyOptions, "transparent", help=TRANSPARENT_HELP, of_result=False
    )
    seed: int = shared(
        SimplifyOptions, "seed", help="Seed of the path. Another seed gives another path."
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.eye_height == 0.0:
            raise OptionError(
                "0 is not a height", where="eye height", remedy="give a positive length"
            )


@dataclass(frozen=True)
class CullOptions(OptionSet):
    """How a flythrough is measured.

    ``image``        of the depth buffer: columns and rows, pixels.
    ``pixel_error``  of the occluders that are drawn; None is what they were built for.  Raising it
                     draws fewer triangles and hides less.
    ``detail``       pixels of the item buffer along one of the depth buffer.
    ``repeats``      times that a frame is culled; the least time counts.
    ``shots``        frames that pictures are kept of, spread over the path.
    """

    image: tuple[int, int] = option(
        (320, 180), "Width and height of the depth buffer, in pixels.",
        unit="pixels", group="Measurement",
    )  # fmt: skip
    pixel_error: float | None = option(
        None, "Maximum error of the occluders that are drawn, in pixels. A larger error draws fewer"
        " triangles and hides less.", above=0.0, high=1000.0, absent="as they were built for",
        unit="pixels", group="Measurement",
    )  # fmt: skip
    transparent: Transparent = shared(
        SimplifyOptions, "transparent", help=TRANSPARENT_HELP, of_result=False
    )
    detail: int = option(4, low=1, high=16)
    repeats: int = option(3, low=1, high=1000)
    shots: int = option(12, low=0, high=100)

    def __post_init__(self) -> None:
        super().__post_init__()
        # The item buffer has as many times the pixels.
        check_whole("rows", self.rows, 1, LARGEST_SCREEN // self.detail)
        check_whole("columns", self.columns, 1, LARGEST_SCREEN // self.detail)

    @property
    def columns(self) -> int:
        """Pixels across the depth buffer."""
        return self.image[0]

    @property
    def rows(self) -> int:
        """Pixels down the depth buffer."""
        return self.image[1]
