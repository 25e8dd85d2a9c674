"""What is drawn of the objects in a cell's set: slices, or from which height they are seen."""

from __future__ import annotations

from nicegui.element import Element

from service.dashboard.viewer import SETS


class CellParts(Element, component="cell_parts.js", esm={"occluder-sets": str(SETS)}):
    """A table of the objects of one cell.

    ``base``    address of the folder that :mod:`service.engines.work.set_view` writes.
    ``chosen``  the cell.
    """

    def __init__(self, base: str, *, chosen: int) -> None:
        super().__init__()
        self.props["base"] = base
        self.props["chosen"] = chosen

    def show_chosen(self, cell: int) -> None:
        """Show another cell's objects."""
        self.props["chosen"] = cell
        self.update()
