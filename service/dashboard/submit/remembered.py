"""Values that the browser keeps for a page, from one visit to the next."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from nicegui.element import Element


class Remembered(Element, component="remembered.js"):
    """``on_kept`` is told what was kept before, whatever it is; None for nothing."""

    def __init__(self, name: str, on_kept: Callable[[object], object]) -> None:
        super().__init__()
        self.props["name"] = f"occluder.{name}"
        self.on("kept", lambda event: on_kept(event.args))

    def keep(self, values: Mapping[str, object]) -> None:
        """Remember these values in place of those before."""
        self.run_method("keep", dict(values))
