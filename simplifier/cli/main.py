"""The command line: ``occluder``.

Exit status: 0 done, 1 the input or the run failed, 2 wrong usage, 130 interrupted with nothing
kept.  A failure is one line on standard error that says what, where and what to do; ``--debug``
adds the traceback.

The commands of ``occluder``, each loaded when it is asked for, its own and those from outside.

A package above this one adds a command by an entry point of the group :data:`COMMAND_GROUP`, whose
name is the command's and whose object is a function as typer takes one, a ``typer.Typer`` with
commands of its own, or a :class:`LazyCommand`, which says where either is.  Nothing is imported for
a command but what it needs: a server does not pay for numpy, ``occluder simplify`` not for the
server, and ``occluder --help`` for none of them.
"""

from __future__ import annotations

import atexit
import gc
import os
import signal
import sys
from collections.abc import Iterator, Mapping
from functools import cached_property, partial
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer
from typer.core import TyperCommand, TyperGroup

from simplifier.cli.console import accept_any_text, count_bar, print_line
from simplifier.cli.help import HELP_NAMES, help_settings, help_text
from simplifier.cli.lazy import LazyCommand
from simplifier.cli.running import INTERRUPTED
from simplifier.errors import CommandError
from simplifier.matrix_threads import ONE_THREAD
from simplifier.progress import show_compiling_by
from simplifier.version import VERSION

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

COMMAND_GROUP = "occluder.commands"

OWN = {
    "simplify": LazyCommand(
        "simplifier.cli.simplify:simplify",
        "Make an occluder from a mesh and report its precision and recall.",
    ),
    "evaluate": LazyCommand(
        "simplifier.cli.evaluate:evaluate",
        "Judge an occluder, made here or elsewhere, against its mesh.",
    ),
    "tradeoff": LazyCommand(
        "simplifier.cli.tradeoff:tradeoff",
        "Measure speed against accuracy over many settings: a table, a picture and a page.",
    ),
    "path": LazyCommand(
        "simplifier.cli.path:path",
        "Write cameras along a walk or a flight through a scene, to judge occluders along.",
    ),
    "scene": LazyCommand(
        "simplifier.cli.scene:scene",
        "Make a tree of occluders for a scene of many objects.",
    ),
    "cull": LazyCommand(
        "simplifier.cli.cull:cull",
        "Judge the occluders of a scene along a camera path: what they hide, against the truth.",
    ),
    "pvs": LazyCommand(
        "simplifier.cli.pvs:pvs",
        "Find which objects of a scene can be seen from each view cell, before run time.",
    ),
    "pvs-show": LazyCommand(
        "simplifier.cli.pvs:pvs_show",
        "Show what a file of visible sets holds, or what can be seen from a point.",
    ),
    "pvs-check": LazyCommand(
        "simplifier.cli.pvs:pvs_check",
        "Check sets of visible objects against what is certainly seen from points in their cells.",
    ),
    "build": LazyCommand(
        "simplifier.cli.build:build",
        "Make the occluders of a manifest that are not current, and judge all of them.",
    ),
    "watch": LazyCommand(
        "simplifier.cli.watch:watch",
        "Build a manifest, and again whenever a mesh or the manifest changes, until Ctrl-C.",
    ),
    "warmup": LazyCommand(
        "simplifier.cli.warmup:warmup",
        "Compile and cache the kernels, so that the next start need not.",
    ),
}


class Catalogue(Mapping[str, Any]):
    """Commands by name: its own in their order, then those from outside by name.

    A command is loaded when it is looked up; no name from outside hides one of its own.  Raises
    :class:`CommandError` for one from outside that cannot be loaded.
    """

    @cached_property
    def _outside(self) -> dict[str, EntryPoint]:
        from importlib.metadata import entry_points  # which takes a while to load

        outside = sorted(entry_points(group=COMMAND_GROUP), key=lambda one: one.name)
        return {one.name: one for one in outside if one.name not in OWN}

    def __getitem__(self, name: str) -> Any:
        own = OWN.get(name)
        if own is None:
            return _from_outside(self._outside[name])
        return _command(name, own.load())

    def listed(self, name: str) -> Any:
        """What the help of ``occluder`` shows: a command without its options, which take a while
        to make."""
        own = OWN.get(name)
        if own is not None:
            return TyperCommand(name, help=own.help)
        return _from_outside(self._outside[name], listed=True) if name in self._outside else None

    def __iter__(self) -> Iterator[str]:
        yield from OWN
        yield from self._outside

    def __len__(self) -> int:
        return len(OWN) + len(self._outside)


class Commands(TyperGroup):
    """The commands of a :class:`Catalogue`."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self._catalogue = Catalogue()
        self.commands = cast(Any, self._catalogue)
        self._listed = False

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Without any, the help, which click would hand on as the text of an error."""
        if not args and not ctx.resilient_parsing:
            typer.echo(ctx.get_help())
            raise typer.Exit(2)
        return super().parse_args(ctx, args)

    def list_commands(self, ctx: Any) -> list[str]:
        return list(self.commands)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        self._listed = True
        super().format_help(ctx, formatter)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Each with the whole of its first paragraph, which click would cut at the first line."""
        listed = {name: self.get_command(ctx, name) for name in self.list_commands(ctx)}
        with formatter.section("Commands"):
            formatter.write_dl(
                [(name, _first(one.help)) for name, one in listed.items() if one is not None]
            )

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """For the help, which shows the rest where one cannot be loaded."""
        try:
            return self._catalogue.listed(cmd_name) if self._listed else self.commands.get(cmd_name)
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


def _first(text: str | None) -> str:
    """The first paragraph."""
    return (text or "").partition("\n\n")[0]


def _from_outside(place: EntryPoint, *, listed: bool = False) -> Any:
    try:
        found = place.load()
        if listed and (text := _listed_help(found)) is not None:
            return TyperCommand(place.name, help=text)
        return _command(place.name, found.load() if isinstance(found, LazyCommand) else found)
    except Exception as error:
        package = place.dist.name if place.dist else place.module
        raise CommandError(
            f"cannot be loaded ({type(error).__name__}: {error})",
            where=f"command '{place.name}' of {package}",
            remedy=f"mend or remove {package}",
        ) from error


def _listed_help(found: Any) -> str | None:
    """The help of the object of an entry point; of an app, where it states one."""
    if isinstance(found, LazyCommand):
        return found.help
    if not isinstance(found, typer.Typer):
        return help_text(found)
    return found.info.help if isinstance(found.info.help, str) else None


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
    cls=Commands,
    pretty_exceptions_enable=False,
    context_settings=HELP_NAMES,
    rich_markup_mode=None,  # of a list of commands, half of the time would go into boxes around it
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
    for name, value in ONE_THREAD.items():  # nothing has loaded numpy yet
        os.environ.setdefault(name, value)
    show_compiling_by(partial(count_bar, "compiling, once"))
    # Large scenes are a million small objects, none of them garbage: looking through them again
    # and again took a sixth of a build in which nothing had changed.
    gc.set_threshold(_OBJECTS_BETWEEN_COLLECTIONS)
    # As Python ends, it would look for garbage once more, for a tenth of the shortest runs.
    atexit.register(gc.freeze)
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
    # Ctrl-C while Python runs a text, as dataclasses do, ends the process by the signal in the end,
    # whatever the status; running another text takes that back.
    exec("")
    sys.exit(status)
