"""What a page shows, kept in its address, and the button that copies it."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Self, TypeVar

from nicegui import ui
from nicegui.element import Element

T = TypeVar("T")

ADDRESS = str(Path(__file__).with_name("address"))
"""The module that reads and writes the address."""


class CopyButton(Element, component="copy_button.js", esm={"occluder-address": ADDRESS}):
    """Copies a text; the page's own address where none is given."""

    def __init__(self, title: str = "Copy link", text: str | None = None) -> None:
        super().__init__()
        self.props["title"] = title
        if text is not None:
            self.props["text"] = text


def keep_in_address(**values: object) -> None:
    """Put values into the query of the page's address, by their names; None takes one out.

    The page reads them when it is built, so that a reload, or whoever is sent the link, sees the
    same.
    """
    texts = {name: None if value is None else str(value) for name, value in values.items()}
    ui.run_javascript(f"window.keepInAddress({json.dumps(texts)})")


@dataclass(frozen=True)
class Address:
    """What the query says of a page, or of a part of it, and the place to keep changes of it.

    ``suffix``  of the names, where a page has two of a part.
    """

    values: Mapping[str, str]
    suffix: str = ""

    @classmethod
    def of_page(cls, suffix: str = "") -> Self:
        """As the page was asked for; while it is being built."""
        return cls(ui.context.client.request.query_params, suffix)

    def text(self, name: str) -> str:
        """Empty where the address does not say."""
        return self.values.get(name + self.suffix, "")

    def one_of(self, name: str, choices: Iterable[T], otherwise: T) -> T:
        """The choice that the address names; anybody may have changed what it says."""
        told = self.text(name)
        return next((one for one in choices if str(one) == told), otherwise)

    def keep(self, **values: object) -> None:
        """Put values into the address; None takes one out."""
        keep_in_address(**{name + self.suffix: value for name, value in values.items()})
