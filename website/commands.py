"""The command line's reference: a page a command, from what ``--help`` is made of."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import groupby
from typing import Any

from typer.main import get_command

from simplifier.cli.help import ADVANCED
from simplifier.cli.main import app
from website.tables import page, table

FOLDER = "reference/commands"
_VALUES = {"int": "WHOLE", "float": "NUMBER", "path": "PATH"}  # "int range" is one, too


def pages() -> dict[str, str]:
    """Each command's page by its place."""
    return {f"{FOLDER}/{name}.md": _page(name, one) for name, one in _commands().items()}


def _commands() -> dict[str, Any]:
    return dict(get_command(app).commands)


def _page(name: str, command: Any) -> str:
    title = f"occluder {name}"
    parts = [f"# {title}", *_described(title, command)]
    for below, one in getattr(command, "commands", {}).items():
        parts += [f"## {title} {below}", *_described(f"{title} {below}", one, level="###")]
    return page(*parts)


def _described(title: str, command: Any, level: str = "##") -> Iterator[str]:
    yield _prose(command.help or "")
    if hasattr(command, "commands"):
        return
    arguments = [one for one in command.params if _is_argument(one)]
    options = [one for one in command.params if not _is_argument(one) and not one.hidden]
    words = [
        title,
        *(_argument_word(one) for one in arguments),
        *(["[OPTIONS]"] if options else []),
    ]
    yield f"```text\n{' '.join(words)}\n```"
    yield table(
        ("argument", "what it is"), ((f"`{_argument_word(one)}`", _help(one)) for one in arguments)
    )
    for group, some in groupby(options, key=lambda one: one.rich_help_panel or ADVANCED):
        yield f"{level} {group}"
        yield table(("option", "what it does", "default"), map(_option_row, some))
    yield _examples(command.epilog or "", level)


def _is_argument(parameter: Any) -> bool:
    return bool(parameter.param_type_name == "argument")


def _argument_word(argument: Any) -> str:
    word = (argument.metavar or argument.name).upper().removesuffix("...")
    word += "..." if argument.nargs == -1 else ""
    return word if argument.required else f"[{word}]"


def _option_row(option: Any) -> tuple[str, str, str]:
    names = "/".join(f"`{one}`" for one in option.opts)
    if option.secondary_opts:
        names += " or " + "/".join(f"`{one}`" for one in option.secondary_opts)
    if not option.is_flag and not option.count:
        names += f" {_value_word(option)}"
    told = _help(option)
    if option.envvar:
        told += f" Environment: `{option.envvar}`."
    return names, told, _default(option)


def _value_word(option: Any) -> str:
    """What is typed after an option's name."""
    choices = getattr(option.type, "choices", ())
    if choices and not option.metavar:
        return ", ".join(f"`{one}`" for one in choices)
    return str(option.metavar or _VALUES.get(option.type.name.partition(" ")[0], "TEXT"))


def _default(option: Any) -> str:
    if option.required:
        return "required"
    if isinstance(option.show_default, str):
        return _prose(option.show_default)
    if option.default in (None, False, (), "") or callable(option.default):
        return ""
    value = getattr(option.default, "value", option.default)
    return f"`{str(value).lower() if isinstance(value, bool) else value}`"


def _help(parameter: Any) -> str:
    return _prose(parameter.help or "")


def _prose(text: str) -> str:
    """Help as Markdown: what the terminal's markup escaped, and marks that are meant as such."""
    text = text.replace("\\[", "[")
    return re.sub(r"(?<!`)(--[a-z][a-z-]*)(?!`)", r"`\1`", re.sub(r"([<>*_])", r"\\\1", text))


def _examples(epilog: str, level: str) -> str:
    """The examples as the help prints them: what to type, and below it what that does."""
    lines = epilog.replace("\\[", "[").splitlines()[1:]
    pairs = zip(lines[::2], lines[1::2], strict=True)
    shown = [f"{what.strip()}\n\n```sh\n{typed.strip()}\n```" for typed, what in pairs]
    return "\n\n".join([f"{level} Examples", *shown]) if shown else ""
