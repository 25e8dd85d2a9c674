"""View cells in plan, coloured by the size of their sets."""

from __future__ import annotations

from collections.abc import Callable

from nicegui.element import Element

from service.dashboard.colours import Colour, css
from service.dashboard.links import ADDRESS
from service.dashboard.viewer import SETS

_STOPS: tuple[Colour, ...] = (
    (205, 236, 222), (139, 208, 199), (77, 170, 184), (43, 124, 166), (45, 79, 139), (38, 32, 92),
)  # fmt: skip
"""From the smallest set to the largest, ever darker; without the yellow of what is seen."""


class CellsPlan(
    Element,
    component="cells_plan.js",
    esm={"occluder-address": ADDRESS, "occluder-sets": str(SETS)},
):
    """One cell can be chosen, by a click, or by the arrow keys and Enter; Home is the largest set.

    ``base``    address of the folder that :mod:`service.engines.work.set_view` writes.
    ``chosen``  the cell whose set is shown; None for none.
    ``label``   what the plan shows, for those who do not see it.
    """

    def __init__(self, base: str, *, chosen: int | None, label: str) -> None:
        super().__init__()
        self.props["base"] = base
        self.props["stops"] = [css(stop) for stop in _STOPS]
        self.props["chosen"] = chosen
        self.props["label"] = label

    def show_chosen(self, cell: int) -> None:
        """Mark the cell whose set is shown elsewhere, and the objects in it."""
        self.props["chosen"] = cell
        self.update()

    def on_choose(self, told: Callable[[int], None]) -> None:
        """Hear of the number of each cell that is chosen."""
        self.on("choose", lambda event: told(int(event.args)))
