"""How the help of a command looks: its options in groups, and examples below them."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, TypeVar, get_args

from typer.core import TyperCommand

from simplifier.options.fields import OptionGroup

INPUT, QUALITY, LEVELS, OUTPUT, MEASUREMENT, ADVANCED = get_args(OptionGroup)

HELP_NAMES = {"help_option_names": ["-h", "--help"]}
"""Settings of a command for typer: by which options it shows its help."""

_EXAMPLES = "__examples__"

Command = TypeVar("Command", bound=Callable[..., Any])


class GroupedCommand(TyperCommand):
    """A command that lists ``--help`` among its advanced options."""

    def get_help_option(self, ctx: Any) -> Any:
        found: Any = super().get_help_option(ctx)
        if found is not None:
            found.rich_help_panel = ADVANCED
        return found


def with_examples(*examples: tuple[str, str]) -> Callable[[Command], Command]:
    """Show examples below the help of a command: of each what to type, and what it does."""

    def decorate(command: Command) -> Command:
        vars(command)[_EXAMPLES] = examples
        return command

    return decorate


def examples_of(command: Any) -> tuple[tuple[str, str], ...]:
    """What :func:`with_examples` was told."""
    found: tuple[tuple[str, str], ...] = vars(command).get(_EXAMPLES, ())
    return found


def help_settings(command: Any) -> dict[str, Any]:
    """What typer is told of a function that is a command."""
    from rich.markup import escape  # which loads what draws text

    examples = examples_of(command)
    lines = ["Examples:"]
    for typed, what in examples:
        lines += [escape(f"  {typed}"), f"      {what}"]
    return {
        "cls": GroupedCommand,
        "help": help_text(command),
        "epilog": "\n".join(lines) if examples else None,
        "context_settings": HELP_NAMES,
    }


def help_text(command: Any) -> str:
    """The paragraphs of a command's docstring, each in one line for the terminal to break."""
    text = inspect.getdoc(command) or ""
    return "\n\n".join(" ".join(one.split()) for one in text.split("\n\n"))
