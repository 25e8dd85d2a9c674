"""The command line as programs find it: one file that can be run."""

from __future__ import annotations

import shlex
import sys

from tests.acceptance.command import ROOT


def make_command(folder):
    """A path at which this checkout's ``occluder`` is."""
    path = folder / "occluder"
    path.write_text(
        f"#!/bin/sh\nPYTHONPATH={shlex.quote(str(ROOT))} "
        f'exec {shlex.quote(sys.executable)} -m simplifier "$@"\n'
    )
    path.chmod(0o755)
    return path
