"""What a method of finding visible sets is given, and what it gives."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.camera_paths.columns import UprightScene
from simplifier.errors import OptionError
from simplifier.geometry.scene import Scene
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.view_cells import ViewCells
from simplifier.options.visibility import PvsOptions
from simplifier.progress import TellCount
from simplifier.visibility.cull_maps.cull_map import CullMaps
from simplifier.visibility.solid.fill_leaks import FillLeak
from simplifier.visibility.solid.terrain import Terrain
from simplifier.visibility.strong.strong_occluders import StrongOccluders


@dataclass(frozen=True, eq=False)
class Task:
    """``cells``  upright, as what is found is to be.
    ``opaque``  what of the scene hides anything, by the objects' names; None is all of it.
    ``terrain``  what the scene was made of, if it is one.
    ``tell_objects``  hears how many objects are read, and may raise.
    ``looked_at_again``  whether another method looks at what this one leaves open, so that its own
                close looks are not worth their time.
    """

    upright: UprightScene
    cells: ViewCells
    options: PvsOptions
    opaque: Scene | None
    terrain: Terrain | None
    tell_objects: TellCount
    looked_at_again: bool = False


@dataclass(frozen=True, eq=False)
class Seen:
    """What is seen from some cells (c), of the objects (n) in the scene's order.

    ``visible``    (c, n) bool: whether each object may be visible.
    ``slices``     (c, n, 3) int8: what of it is drawn, as :class:`simplifier.geometry.pvs.Slices`
                   has it; those of hidden objects are not looked at.  None: it is not known.
    ``altitudes``  (c, n) uint16: from which altitude on it is seen, as
                   :class:`simplifier.geometry.pvs.Altitudes` has it.  None: it is not known.
    """

    visible: BoolArray
    slices: NDArray[np.int8] | None = None
    altitudes: NDArray[np.uint16] | None = None


@dataclass(frozen=True, eq=False)
class Tried:
    """Cells that were seen from before the others.

    ``cells``  (c,) int64: their places.  ``seen`` from them, in so many ``seconds``.
    """

    cells: NDArray[np.int64]
    seen: Seen
    seconds: float


See = Callable[[NDArray[np.int64]], Seen]
"""Places of cells (c,) -> what is seen from there."""

Narrow = Callable[[NDArray[np.int64], BoolArray], Seen]
"""The same, of no more than some objects (c, n)."""


@dataclass(frozen=True, eq=False)
class Sight:
    """A scene made ready to be seen from cells.

    ``method``  of :data:`simplifier.geometry.pvs.METHODS`.
    ``cells``   those of the task that can be seen from.
    ``see``     places in these (c,) int64 -> what is seen from there.
    ``batch``   cells between two looks at the clock.
    ``portable``  whether ``see`` can be pickled, to see from cells in other processes.
    ``conservative``  whether nothing visible is ever left out.
    ``reason``    why the sets are found so, as the end of a sentence.
    ``warnings``  what the user should know.
    ``maps``    what cull maps were looked up in last, and most closely.
    ``occluders``  those that each hide something by themselves, where these were looked for.
    ``narrow``  as ``see``, of no more than some objects (c, n); None where that saves nothing.
    ``tried``   cells that were seen from already.
    ``leaks``   spaces that would be solid without a hole.
    ``altitude_low``, ``altitude_step``  what altitudes count: k is low + k step, a height in the
                cells' space.  Where they are no float32 numbers, the next below are taken.
    """

    method: str
    cells: ViewCells
    see: See
    batch: int
    conservative: bool
    reason: str
    warnings: Callable[[], list[str]]
    portable: bool = False
    maps: CullMaps | None = None
    occluders: StrongOccluders | None = None
    narrow: Narrow | None = None
    tried: Tried | None = None
    leaks: tuple[FillLeak, ...] = ()
    altitude_low: float = 0.0
    altitude_step: float = 1.0


Method = Callable[[Task], AbstractContextManager[Sight]]


def better(task: Task) -> str:
    """What to try where a method that was asked for hides little, as the end of a sentence."""
    return "" if task.options.method == "auto" else "; try --method auto"


def check_processor(task: Task, what: str) -> None:
    """Raise :class:`OptionError` for options that only cull maps have.

    ``what``  that has none, in the plural.
    """
    options = task.options
    own = {
        "fill": options.fill == "viewers",
        "backend": options.backend == "opengl",
        "slices": options.slices,
    }
    for name in (name for name, chosen in own.items() if chosen):
        raise OptionError(
            f"{what} have no --{name}", where="method",
            remedy=f"leave --{name} out, or choose --method cull-map",
        )  # fmt: skip


def check_plain(task: Task, what: str) -> None:
    """As :func:`check_processor`, and for terrains."""
    check_processor(task, what)
    if task.terrain is not None:
        raise OptionError(
            f"a terrain has one height at each place, and no {what}", where="method",
            remedy="leave --method out, or choose --method cull-map or voxel-column",
        )  # fmt: skip


def without_buried(task: Task, buried: BoolArray, within: Callable[[int], str]) -> ViewCells:
    """The cells of a task but those that are ``buried`` (c,): none may be, unless they are skipped.

    ``within``  what such a cell lies in, for the message.  Raises :class:`OptionError`.
    """
    cells = task.cells
    if not buried.any():
        return cells
    if not task.options.skip_buried:
        cell = int(np.flatnonzero(buried)[0])
        raise OptionError(
            f"cell {cell} lies wholly within {within(cell)}", where="cells",
            remedy="leave it out, add --skip-buried, or, if viewers are in there, choose"
            " --method slice-wise",
        )  # fmt: skip
    if buried.all():
        raise OptionError(
            "all of them lie within objects", where="cells",
            remedy="move them, or, if viewers are in there, choose --method slice-wise",
        )  # fmt: skip
    return cells.some(~buried)
