"""The place to drop files on, and what sends them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from nicegui.element import Element
from nicegui.events import GenericEventArguments

from service.dashboard.asset.downloads_panel import size
from simplifier import MESH_SUFFIXES


class Uploader(Element, component="uploader.js"):
    """Meshes that wait to be sent are named by ``on_chosen``, each job that came of one by
    ``on_sent``; ``on_done`` follows the last."""

    def __init__(
        self,
        largest: int,
        *,
        on_chosen: Callable[[list[str]], object],
        on_sent: Callable[[str], object],
        on_done: Callable[[], object],
    ) -> None:
        super().__init__()
        self.props["address"] = "/v1/occluders"
        self.props["accept"] = ",".join([*sorted(MESH_SUFFIXES), ".toml"])
        formats = ", ".join(one.removeprefix(".") for one in sorted(MESH_SUFFIXES))
        self.props["help"] = (
            f"Choose or drop {formats}; each at most {size(largest)}. "
            "castle.overrides.toml goes along with castle.glb."
        )

        def chosen(event: GenericEventArguments) -> None:
            on_chosen([str(name) for name in event.args])

        def sent(event: GenericEventArguments) -> None:
            on_sent(str(event.args["job"]))

        self.on("chosen", chosen)
        self.on("sent", sent)
        self.on("done", lambda: on_done())

    def send(self, settings: Sequence[tuple[str, str]], assets: Sequence[str]) -> None:
        """Send all that wait, each with the same settings and its asset's name."""
        self.run_method("send", [list(pair) for pair in settings], list(assets))
