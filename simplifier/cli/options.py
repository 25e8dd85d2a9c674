"""Options of the command line, from the tables of :mod:`simplifier.options`."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from inspect import Parameter
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import typer

from simplifier.cli.help import ADVANCED, INPUT, OUTPUT
from simplifier.errors import OptionError
from simplifier.options.fields import OptionField, OptionGroup, OptionSet, SomeOptions
from simplifier.options.scene import TRANSPARENT_HELP
from simplifier.options.simplify import Transparent

Mesh = Annotated[Path, typer.Argument(help="The mesh: glb, gltf, obj, ply, stl, off, 3mf or dae.")]
SceneArgument = Annotated[
    Path,
    typer.Argument(
        help="The scene: a mesh file whose nodes are the objects, or a folder of mesh files."
    ),
]
TerrainArgument = Annotated[
    Path,
    typer.Argument(
        help="The scene: a mesh file whose nodes are the objects, a folder of mesh files, or an"
        " elevation model (.npy or .tif)."
    ),
]
PoolName = Annotated[
    str | None,
    typer.Option(
        "--pool",
        help="Spread the work: ray gives it to all nodes of a Ray cluster (needs the 'ray' extra)."
        " Default: this machine alone.",
        rich_help_panel=ADVANCED,
    ),
]
TransparentScene = Annotated[
    Transparent,
    typer.Option("--transparent", help=TRANSPARENT_HELP, rich_help_panel=INPUT),
]
ReportFile = Annotated[
    Path | None,
    typer.Option(
        "--report", help="Write the report to this file, as JSON.", rich_help_panel=OUTPUT
    ),
]
PicturesFolder = Annotated[
    Path | None,
    typer.Option(help="Write pictures and an HTML report to this folder.", rich_help_panel=OUTPUT),
]

ManifestFile = Annotated[Path, typer.Argument(help="The manifest of the assets to build.")]
Server = Annotated[
    str | None,
    typer.Option(
        help="Address of a service that makes the occluders instead of this machine.",
        rich_help_panel=INPUT,
    ),
]
Key = Annotated[
    str | None,
    typer.Option(
        envvar="OCCLUDER_KEY",
        help="API key of the service, if it needs one.",
        rich_help_panel=INPUT,
    ),
]
AtOnce = Annotated[
    int | None,
    typer.Option(
        min=1,
        max=256,
        help="Number of assets made at the same time.",
        show_default="the number of processors; 256 by a server",
        rich_help_panel=ADVANCED,
    ),
]

Command = Callable[..., None]

_GROUPS = get_args(OptionGroup)

Table = type[OptionSet] | Sequence[OptionField]
"""Options: all of a class, or some."""

_TYPES: Mapping[str, Any] = {"whole": int, "number": float, "flag": bool}
_METAVARS: Mapping[str, str] = {
    "lengths": "LIST", "wholes": "LIST", "numbers": "LIST", "size": "WxH",
}  # fmt: skip
"""Of kinds that are typed as one word of several values."""


def with_options(*tables: Table) -> Callable[[Command], Command]:
    """Give a command the options of some tables in place of its ``**chosen``.

    What it has after a ``*`` is either one of them, which the command asks for by its name, or an
    option of its own.  The help lists the groups of options in their order, and in each those of
    the command before those of the tables.
    """
    fields = [one for table in tables for one in _fields_of(table)]
    names = {one.name for one in fields}

    def decorate(command: Command) -> Command:
        signature = inspect.signature(command, eval_str=True)
        own = [
            one for one in signature.parameters.values() if one.kind is not Parameter.VAR_KEYWORD
        ]
        others = [one for one in own if one.name not in names]
        arguments = [one for one in others if _settings(one, typer.models.ArgumentInfo)]
        options = [one for one in others if one not in arguments]
        options = sorted([*options, *map(_parameter, fields)], key=_group_number)
        # typer passes all by name, so that any order will do.
        ordered = [*arguments, *options]
        parameters = [one.replace(kind=Parameter.KEYWORD_ONLY) for one in ordered]
        # typer reads both.
        vars(command)["__signature__"] = signature.replace(parameters=parameters)
        command.__annotations__ = {one.name: one.annotation for one in parameters}
        return command

    return decorate


def read_options(kind: type[SomeOptions], chosen: Mapping[str, Any]) -> SomeOptions:
    """The options of a class from what was typed, others left aside; lists are still text.

    Raises :class:`OptionError` for what is no list, and as the class does.
    """
    return kind(**read_values(kind, chosen))


def read_values(table: Table, chosen: Mapping[str, Any]) -> dict[str, Any]:
    """The values of a table's options by name; raises :class:`OptionError` for what is no list."""
    return {
        one.name: _READERS.get(one.kind, _as_it_is)(one, chosen[one.name])
        for one in _fields_of(table)
        if one.name in chosen
    }


def _fields_of(table: Table) -> Sequence[OptionField]:
    return table.fields() if isinstance(table, type) else table


def _settings(parameter: Parameter, kind: type[Any]) -> Any:
    """What typer was told of a parameter, if it is of that kind."""
    told = getattr(parameter.annotation, "__metadata__", ())
    return next((one for one in told if isinstance(one, kind)), None)


def _group_number(parameter: Parameter) -> int:
    """Where among the groups an option is listed."""
    settings = _settings(parameter, typer.models.OptionInfo)
    return _GROUPS.index(settings.rich_help_panel or ADVANCED) if settings else 0


def _parameter(one: OptionField) -> Parameter:
    kind = Literal[one.choices] if one.kind == "choice" else _TYPES.get(one.kind, str)
    option = typer.Option(
        f"--{one.name.replace('_', '-')}",
        help=one.help,
        show_default=one.absent or True,
        metavar=_METAVARS.get(one.kind),
        rich_help_panel=one.group,
    )
    return Parameter(
        one.name,
        Parameter.KEYWORD_ONLY,
        default=_default_text(one) if one.kind in _METAVARS else one.default,
        annotation=Annotated[kind | None if one.nullable else kind, option],
    )


def _default_text(one: OptionField) -> str | None:
    if one.default is None:
        return None
    return ("x" if one.kind == "size" else ",").join(f"{value:g}" for value in one.default)


def _as_it_is(one: OptionField, value: Any) -> Any:
    return value


def _read_lengths(one: OptionField, text: str | None) -> tuple[float, ...] | None:
    """Numbers as they are typed, whatever their number and order."""
    if text is None:
        return None
    try:
        return tuple(float(word) for word in text.split(","))
    except ValueError:
        raise OptionError(
            f"'{text}' is not a list of lengths", where=one.words, remedy="separate them by commas"
        ) from None


def _read_numbers(one: OptionField, text: str) -> tuple[float, ...]:
    """Each value once."""
    kind: Callable[[str], float] = int if one.kind == "wholes" else float
    try:
        return tuple(dict.fromkeys(kind(word) for word in text.split(",")))
    except ValueError:
        raise OptionError(
            f"'{text}' is not a list of numbers", where=one.name, remedy="separate them by commas"
        ) from None


def _read_size(one: OptionField, text: str) -> tuple[int, int]:
    """``"320x180"`` as columns and rows."""
    found = re.fullmatch(r"(\d{1,6})[xX](\d{1,6})", text.strip(), flags=re.ASCII)
    if found is None:
        raise OptionError(
            f"'{text}' is not a size", where=one.name, remedy="give columns and rows, as in 320x180"
        )
    return int(found[1]), int(found[2])


_READERS: Mapping[str, Callable[[OptionField, Any], Any]] = {
    "lengths": _read_lengths, "wholes": _read_numbers, "numbers": _read_numbers, "size": _read_size,
}  # fmt: skip
