"""What a command from outside may use, so that it looks and ends as those of ``occluder`` do.

:data:`Debug`          the type of its ``--debug``, which it hands to :func:`run_guarded`
:func:`run_guarded`    does its work; an error is one line on standard error and an exit status
:func:`print_line`     a line on standard error; :func:`print_text` one on standard output
:func:`count_bar`      how many of some things are done, where somebody looks
:func:`with_options`   gives it the options of a table, such as ``SimplifyOptions.fields()``
:func:`percent`        a share of 0 to 1 as all commands write it
:func:`percent_at_most`  one that is to be small
:func:`read_values`    reads those of a table that are typed as lists
:func:`make_folder`    makes a folder to write to
:func:`overrides_beside`  the file of overrides that belongs to a mesh
:func:`interrupts`     listens to Ctrl-C; :data:`INTERRUPTED` is the exit status then

:mod:`simplifier.cli.main` says how it is found.
"""

from __future__ import annotations

from simplifier.cli.console import count_bar, print_line, print_text
from simplifier.cli.options import read_values, with_options
from simplifier.cli.running import INTERRUPTED, Debug, interrupts, run_guarded
from simplifier.io.files import make_folder
from simplifier.io.suffixes import overrides_beside
from simplifier.wording import percent, percent_at_most

__all__ = [
    "INTERRUPTED",
    "Debug",
    "count_bar",
    "interrupts",
    "make_folder",
    "overrides_beside",
    "percent",
    "percent_at_most",
    "print_line",
    "print_text",
    "read_values",
    "run_guarded",
    "with_options",
]
