"""Options of the command line, from the tables of :mod:`simplifier.option_fields`."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from inspect import Parameter
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from simplifier.errors import OptionError
from simplifier.option_fields import OptionField

Mesh = Annotated[Path, typer.Argument(help="The mesh: glb, gltf, obj, ply, stl or off.")]
TransparentScene = Annotated[
    Literal["leave-out", "keep"],
    typer.Option(
        "--transparent", help="Triangles of the scene that one can see through: leave-out, or keep."
    ),
]
ReportFile = Annotated[Path | None, typer.Option("--report", help="Write the report as JSON.")]
PicturesFolder = Annotated[
    Path | None, typer.Option(help="Write pictures and an HTML report to this folder.")
]

ManifestFile = Annotated[Path, typer.Argument(help="The manifest.")]
Server = Annotated[
    str | None, typer.Option(help="Address of a service that makes them in place of this machine.")
]
Key = Annotated[
    str | None, typer.Option(envvar="OCCLUDER_KEY", help="API key of the service, if it needs one.")
]
AtOnce = Annotated[
    int | None,
    typer.Option(min=1, max=256, help="Assets under way.", show_default="processors; 8 by server"),
]

Command = Callable[..., None]

_TYPES: Mapping[str, Any] = {
    "whole": int, "number": float, "flag": bool, "lengths": str, "wholes": str, "numbers": str,
}  # fmt: skip
_LISTS = ("lengths", "wholes", "numbers")


def with_options(fields: Sequence[OptionField]) -> Callable[[Command], Command]:
    """Give a command the options of a table in place of its ``**chosen``.

    What it has after a ``*`` is either one of the table, which the command asks for by its name, or
    an option of its own, listed behind those of the table.
    """
    names = {one.name for one in fields}

    def decorate(command: Command) -> Command:
        signature = inspect.signature(command, eval_str=True)
        own = [
            one for one in signature.parameters.values() if one.kind is not Parameter.VAR_KEYWORD
        ]
        first = [one for one in own if one.kind is not Parameter.KEYWORD_ONLY]
        last = [one for one in own if one not in first and one.name not in names]
        parameters = [*first, *map(_parameter, fields), *last]
        # typer reads both.
        vars(command)["__signature__"] = signature.replace(parameters=parameters)
        command.__annotations__ = {one.name: one.annotation for one in parameters}
        return command

    return decorate


def _parameter(one: OptionField) -> Parameter:
    kind = Literal[one.choices] if one.kind == "choice" else _TYPES[one.kind]
    option = typer.Option(
        f"--{one.name.replace('_', '-')}",
        help=one.help,
        show_default=one.absent or True,
        metavar="LIST" if one.kind in _LISTS else None,
    )
    return Parameter(
        one.name,
        Parameter.KEYWORD_ONLY,
        default=_joined_by_commas(one.default) if isinstance(one.default, tuple) else one.default,
        annotation=Annotated[kind | None if one.nullable else kind, option],
    )


def _joined_by_commas(values: tuple[float, ...]) -> str:
    return ",".join(f"{value:g}" for value in values)


def parse_lists(fields: Sequence[OptionField], chosen: Mapping[str, Any]) -> dict[str, Any]:
    """The options with ``"32,64"`` as numbers, each once; raises :class:`OptionError` where one is
    none."""
    kinds = {one.name: one.kind for one in fields}
    return {
        name: _numbers(name, value, int if kinds[name] == "wholes" else float)
        if kinds[name] in ("wholes", "numbers")
        else value
        for name, value in chosen.items()
    }


def _numbers(name: str, text: str, kind: Callable[[str], float]) -> tuple[float, ...]:
    try:
        return tuple(dict.fromkeys(kind(word) for word in text.split(",")))
    except ValueError:
        raise OptionError(
            f"'{text}' is no list of numbers", where=name, remedy="separate them by commas"
        ) from None


def parse_lengths(text: str | None, name: str) -> tuple[float, ...] | None:
    """Lengths separated by commas; raises :class:`OptionError` for anything else."""
    if text is None:
        return None
    try:
        return tuple(float(word) for word in text.split(","))
    except ValueError:
        raise OptionError(
            f"'{text}' is no list of lengths", where=name, remedy="separate them by commas"
        ) from None
