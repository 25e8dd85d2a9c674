"""What ``occluder --help`` says of the commands of the service."""

from __future__ import annotations

import inspect
from importlib.metadata import entry_points

import pytest
import typer

from service.cli import commands
from simplifier.cli.lazy import LazyCommand
from simplifier.cli.main import COMMAND_GROUP

LISTED = {name: one for name, one in vars(commands).items() if isinstance(one, LazyCommand)}


@pytest.mark.parametrize("name", LISTED)
def test_the_list_says_of_a_command_what_its_own_help_says(name):
    command = LISTED[name].load()
    text = command.info.help if isinstance(command, typer.Typer) else command.__doc__
    first = " ".join(inspect.cleandoc(text).partition("\n\n")[0].split())
    assert first == LISTED[name].help


def test_all_of_them_are_installed():
    assert {one.name: one.load() for one in entry_points(group=COMMAND_GROUP)} == LISTED
