"""Loaded by each interpreter of a server under test, before anything of it.

``FAULTS_CLOCK``  file with the seconds by which the time of day is wrong, read at each look.
``FAULTS_WORK``   file to be run in worker processes in place of the library's work.
``FAULTS_RELEASE``  file that says which release this is.

Whatever begins with ``FAULTS_`` reaches workers as well: not by the environment, which is kept from
them, but by entries of the path that lead nowhere.
"""

from __future__ import annotations

import importlib.machinery
import importlib.util
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType


def _set_wrong(file: Path) -> None:
    right = time.time

    def wrong() -> float:
        return right() + float(file.read_text())

    time.time = wrong


class _OtherFile:
    """Finds a file where a module is asked for."""

    def __init__(self, module: str, file: str) -> None:
        self._module, self._file = module, file

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        if name != self._module:
            return None
        return importlib.util.spec_from_file_location(name, self._file)


_PASSING = "/faults/"
for entry in sys.path:
    if entry.startswith(_PASSING):
        name, _, value = entry.removeprefix(_PASSING).partition("=")
        os.environ.setdefault(name, value)
for name, value in os.environ.items():
    if name.startswith("FAULTS_") and (entry := f"{_PASSING}{name}={value}") not in sys.path:
        sys.path.append(entry)

if clock := os.environ.get("FAULTS_CLOCK"):
    _set_wrong(Path(clock))
if work := os.environ.get("FAULTS_WORK"):
    sys.meta_path.insert(0, _OtherFile("service.engines.work.start", work))
if release := os.environ.get("FAULTS_RELEASE"):
    sys.meta_path.insert(0, _OtherFile("simplifier.version", release))
