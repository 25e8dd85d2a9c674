"""A command that the help of ``occluder`` lists without loading it."""

from __future__ import annotations

from importlib import import_module
from typing import Any, NamedTuple


class LazyCommand(NamedTuple):
    """Where a command is, as ``package.module:name``, and the first paragraph of its help.

    ``occluder --help`` shows that of each; loading all of them for it would take half a second.
    The object of an entry point may be one, so that its module imports this one alone.
    """

    place: str
    help: str

    def load(self) -> Any:
        """The function or the ``typer.Typer``; an :class:`ImportError` or :class:`AttributeError`
        where there is none."""
        module, _, name = self.place.partition(":")
        return getattr(import_module(module), name)
