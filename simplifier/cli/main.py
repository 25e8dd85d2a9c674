"""The command line: ``occluder``.

Exit status: 0 done, 1 the input or the run failed, 2 wrong usage, 130 interrupted with nothing
kept.  A failure is one line on standard error that says what, where and what to do; ``--debug``
adds the traceback.

The commands of ``occluder``, each loaded when it is asked for, its own and those from outside.

A package above this one adds a command by an entry point of the group :data:`COMMAND_GROUP`, whose
name is the command's and whose object is a function as typer takes one, or a ``typer.Typer`` with
commands of its own.  Nothing is imported for a command but what it needs: a server does not pay for
numpy, and ``occluder simplify`` not for the server.
"""

from __future__ import annotations

import atexit
import gc
import signal
import sys
from collections.abc import Iterator, Mapping
from functools import cached_property
from importlib.metadata import EntryPoint, entry_points
from typing import Annotated, Any, cast

import typer
from typer.core import TyperGroup

from simplifier.cli.console import accept_any_text, print_line
from simplifier.cli.help import HELP_NAMES, help_settings
from simplifier.cli.running import INTERRUPTED
from simplifier.errors import CommandError
from simplifier.version import VERSION

COMMAND_GROUP = "occluder.commands"

_PLACES = {
    "simplify": "simplifier.cli.simplify:simplify",
    "evaluate": "simplifier.cli.evaluate:evaluate",
    "tradeoff": "simplifier.cli.tradeoff:tradeoff",
    "path": "simplifier.cli.path:path",
    "scene": "simplifier.cli.scene:scene",
    "cull": "simplifier.cli.cull:cull",
    "pvs": "simplifier.cli.pvs:pvs",
    "pvs-show": "simplifier.cli.pvs:pvs_show",
    "pvs-check": "simplifier.cli.pvs:pvs_check",
    "build": "simplifier.cli.build:build",
    "watch": "simplifier.cli.watch:watch",
    "warmup": "simplifier.cli.warmup:warmup",
}
_OWN = {name: EntryPoint(name, place, COMMAND_GROUP) for name, place in _PLACES.items()}


class Catalogue(Mapping[str, Any]):
    """Commands by name: its own in their order, then those from outside by name.

    A command is loaded when it is looked up; no name from outside hides one of its own.  Raises
    :class:`CommandError` for one from outside that cannot be loaded.
    """

    @cached_property
    def _places(self) -> dict[str, EntryPoint]:
        outside = sorted(entry_points(group=COMMAND_GROUP), key=lambda one: one.name)
        return _OWN | {one.name: one for one in outside if one.name not in _OWN}

    def __getitem__(self, name: str) -> Any:
        return _load_command(_OWN[name] if name in _OWN else self._places[name])

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)


class Commands(TyperGroup):
    """The commands of a :class:`Catalogue`."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.commands = cast(Any, Catalogue())

    def list_commands(self, ctx: Any) -> list[str]:
        return list(self.commands)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """For the help, which shows the rest where one cannot be loaded."""
        try:
            return self.commands.get(cmd_name)
        except CommandError as error:
            print_line(f"warning: {error}")
            return None

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """For a run: one that cannot be loaded is no unknown one."""
        try:
            self.commands.get(args[0])
        except CommandError as error:
            print_line(f"error: {error}")
            raise typer.Exit(1) from None
        except KeyboardInterrupt:  # else typer ends without a word
            print_line("error: interrupted; nothing was kept")
            raise typer.Exit(INTERRUPTED) from None
        return super().resolve_command(ctx, args)


def _load_command(place: EntryPoint) -> Any:
    try:
        return _command(place.name, place.load())
    except Exception as error:
        if place.name in _OWN:
            raise
        package = place.dist.name if place.dist else place.module
        raise CommandError(
            f"cannot be loaded ({type(error).__name__}: {error})",
            where=f"command '{place.name}' of {package}",
            remedy=f"mend or remove {package}",
        ) from error


def _command(name: str, found: Any) -> Any:
    """What click runs, of a function or of an app of several commands."""
    if not isinstance(found, typer.Typer):
        app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
        app.command(name, **help_settings(found))(found)
        found = app
    command = typer.main.get_command(found)
    command.name = name
    return command


app = typer.Typer(
    cls=Commands, no_args_is_help=True, pretty_exceptions_enable=False, context_settings=HELP_NAMES
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(VERSION)
        raise typer.Exit


@app.callback()
def root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    """Make occluders: a handful of triangles that hide nearly what a mesh hides."""


_UsageError: Any = typer.BadParameter.__bases__[0]
"""Wrong usage in general: click's class, or that of the copy that newer typers bring along."""


_OBJECTS_BETWEEN_COLLECTIONS = 200_000


def main() -> None:
    """The entry point of the ``occluder`` command."""
    accept_any_text()
    # Large scenes are a million small objects, none of them garbage: looking through them again
    # and again took a sixth of a build in which nothing had changed.
    gc.set_threshold(_OBJECTS_BETWEEN_COLLECTIONS)
    atexit.register(signal.signal, signal.SIGINT, signal.SIG_IGN)  # all is done by then
    try:
        status = app(prog_name="occluder", standalone_mode=False)
    except (typer.Abort, KeyboardInterrupt):  # Ctrl-C before the command has begun
        print_line("error: interrupted; nothing was kept")
        status = INTERRUPTED
    except _UsageError as error:
        message = error.format_message().rstrip(".")
        if message:  # else the help has been shown, for want of arguments
            command = error.ctx.command_path if error.ctx else "occluder"
            print_line(f"error: {message}; see '{command} --help'")
        status = error.exit_code
    sys.exit(status)
