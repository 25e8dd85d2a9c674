"""The real command line, as users run it."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

from simplifier.cli.main import main

ROOT = Path(__file__).parents[2]
OCCLUDER = (sys.executable, "-m", "simplifier")
PICTURES = (
    "framed_figure", "horizons_picture", "pictures", "plan_figure", "slices_picture",
    "strong_picture",
)  # fmt: skip
"""Modules of visible sets that know how wide a picture is."""


def environment(**changes):
    """This process's, with the package on the path; None takes a variable out."""
    paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    merged = {**os.environ, "PYTHONPATH": os.pathsep.join(paths), **changes}
    return {name: value for name, value in merged.items() if value is not None}


def occluder(*arguments, cwd=None, timeout=120, **changes):
    """Run the command; its exit status, output and errors as text, progress not among them."""
    done = subprocess.run(
        [*OCCLUDER, *map(os.fspath, arguments)],
        cwd=cwd, env=environment(**changes), timeout=timeout,
        capture_output=True, text=True, errors="surrogateescape", check=False,
    )  # fmt: skip
    done.stderr = _without_progress(done.stderr)
    return done


def _without_progress(errors):
    """Lines of progress come where a busy machine takes seconds."""
    lines = errors.splitlines(keepends=True)
    return "".join(line for line in lines if not line.startswith("progress: "))


def beside_verdict(errors):
    """What was told on standard error but for the verdict, which few views or moves leave weak."""
    said = ("warning: weak: ", "warning: unusable: ", "try: ")
    return "".join(line for line in errors.splitlines(keepends=True) if not line.startswith(said))


def occluder_here(monkeypatch, capfd, *arguments, cwd=None):
    """The same in this process, without the second of processor time that a start takes."""
    if cwd is not None:
        monkeypatch.chdir(cwd)
    monkeypatch.setattr(sys, "argv", ["occluder", *map(os.fspath, arguments)])
    with pytest.raises(SystemExit) as end:
        main()
    shown = capfd.readouterr()
    return subprocess.CompletedProcess(
        arguments, end.value.code or 0, shown.out, _without_progress(shown.err)
    )


def draw_small(monkeypatch):
    """Pictures of visible sets a quarter as wide: of their whole size each takes a second."""
    # All at first: one that is loaded later would take over another's width and keep it.
    modules = [import_module(f"simplifier.visibility.pictures.{name}") for name in PICTURES]
    for module in modules:
        monkeypatch.setattr(module, "PIXELS", module.PIXELS // 4)


def read_all(descriptor):
    """What is written to a pseudo-terminal until its other end is closed."""
    return b"".join(_parts(descriptor))


def read_until(descriptor, pattern):
    """What is written to it until the pattern was, or its other end is closed."""
    shown = b""
    for part in _parts(descriptor):
        shown += part
        if re.search(pattern, shown):
            break
    return shown


def _parts(descriptor):
    while True:
        try:
            part = os.read(descriptor, 65536)
        except OSError:
            part = b""
        if not part:
            return
        yield part
