"""All assets as a list.  The rows live in the browser, which fetches, filters and sorts them."""

from __future__ import annotations

from collections.abc import Awaitable, Iterable, Mapping, Sequence
from typing import Any, Protocol

from nicegui.element import Element

from service.dashboard.links import ADDRESS
from service.dashboard.overview.exports import SOURCE

Limits = Mapping[str, Mapping[str, float | None]]


class AskedOfList(Protocol):
    """What people ask of the list, each by the ids of assets or the path of a folder."""

    def demand(self, asset_id: str) -> None: ...
    def demand_folder(self, folder: str) -> None: ...
    def rename(self, asset_id: str) -> None: ...
    def remove(self, asset_ids: Sequence[str]) -> Awaitable[None]: ...
    def export(self, asset_ids: Sequence[str]) -> None: ...


class AssetList(
    Element,
    component="asset_list.js",
    esm={"occluder-assets": SOURCE, "occluder-address": ADDRESS},
):
    """What it is narrowed to, and its order, stand in the page's address.

    ``source``     address of all rows; ``first`` some of them, to be drawn at once, as
                   :func:`~service.dashboard.overview.exports.rows_of` gives them, of ``count``.
    ``limits``     thresholds of folders by their paths, as plain values.
    ``editable``   whether to offer changes.
    """

    def __init__(
        self,
        source: str,
        first: Mapping[str, Any],
        count: int,
        *,
        limits: Limits,
        editable: bool,
        asked: AskedOfList,
    ) -> None:
        super().__init__()
        self.props["editable"] = editable
        self.props["limits"] = limits
        self.props["source"] = source
        self.props["first"] = first
        self.props["count"] = count
        self.on("demand", lambda event: asked.demand(str(event.args)))
        self.on("demandFolder", lambda event: asked.demand_folder(str(event.args)))
        self.on("rename", lambda event: asked.rename(str(event.args)))
        self.on("remove", lambda event: asked.remove(_texts(event.args)))
        self.on("export", lambda event: asked.export(_texts(event.args)))

    def show(self, source: str, count: int, limits: Limits) -> None:
        """Other rows, at an address."""
        self.props["source"] = source
        self.props["count"] = count
        self.props["limits"] = limits
        self.update()

    def show_kind(self, kind: str) -> None:
        """Narrow it to the assets of a kind, and go there."""
        self.run_method("showKind", kind)


def _texts(told: Iterable[object]) -> list[str]:
    return [str(one) for one in told]
