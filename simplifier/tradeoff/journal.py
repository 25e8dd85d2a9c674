"""The trials of a sweep, kept as they come: a sweep that was killed goes on where it was.

A line of JSON a trial, on the disk before the next one runs.  What a kill left of the last line is
passed over.  The first line says what all is about: trials of other options, or of another
version, are not taken up.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any, Self

from simplifier.errors import OutputError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.hierarchy.node_plan import mesh_key
from simplifier.io.files import write_whole
from simplifier.options.tradeoff import TradeoffOptions
from simplifier.tradeoff.sweep import Setting, Trial
from simplifier.version import VERSION

Place = tuple[str, int, Setting]
"""A mesh in hex, a round of the sweep from 0, and the setting."""


class Journal:
    """A :class:`~simplifier.tradeoff.sweep.Keeper` in a file, for one sweep at a time."""

    def __init__(self, path: Path, known: dict[Place, dict[str, Any]]) -> None:
        self._path, self._known = path, known

    @classmethod
    def open(cls, path: Path, options: TradeoffOptions) -> Self:
        """What is there of the same sweep is taken up, all else is written over.

        Raises :class:`~simplifier.errors.OutputError`.
        """
        about = json.loads(json.dumps({"version": VERSION, **asdict(options)}))
        lines = _lines(path)
        known = {}
        if lines and lines[0].get("about") == about:
            known = {place: line for line in lines[1:] if (place := _place(line))}
        made = cls(path, known)
        made._begin(about)
        return made

    def __len__(self) -> int:
        return len(self._known)

    def known(self, mesh: TriangleMesh, number: int, setting: Setting, name: str) -> Trial | None:
        """The trial of that round, if it was run before; the mesh is called ``name`` now."""
        line = self._known.get((mesh_key(mesh).hex(), number, setting))
        if line is None:
            return None
        told = {one: math.nan if line[one] is None else line[one] for one in _NUMBERS}
        return Trial(
            name, setting, triangles=line["triangles"], failure=line["failure"],
            warnings=tuple(line["warnings"]), **told,
        )  # fmt: skip

    def keep(self, mesh: TriangleMesh, number: int, trial: Trial) -> None:
        """Write a trial down, if there is room."""
        if trial.setting is None:
            return
        numbers = {one: _finite(getattr(trial, one)) for one in _NUMBERS}
        line = {
            "mesh": mesh_key(mesh).hex(), "round": number, "setting": asdict(trial.setting),
            "triangles": trial.triangles, "failure": trial.failure, "warnings": trial.warnings,
            **numbers,
        }  # fmt: skip
        # A full disk ends no sweep: what it measures is still to be had at its end.
        with suppress(OutputError):
            self._append(line)

    def end(self) -> None:
        """The sweep is whole, and its results are elsewhere."""
        self._path.unlink(missing_ok=True)

    def _begin(self, about: dict[str, Any]) -> None:
        """Without what a kill left of a line, and whole at any moment."""
        lines = [{"about": about}, *self._known.values()]
        with _told(self._path):
            write_whole(self._path, "".join(json.dumps(one) + "\n" for one in lines).encode())

    def _append(self, line: dict[str, Any]) -> None:
        with _told(self._path), self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
            file.flush()
            os.fsync(file.fileno())


_NUMBERS = ("seconds", "precision", "recall", "overhang")
_KEYS = {"mesh", "round", "setting", "triangles", "failure", "warnings", *_NUMBERS}


@contextmanager
def _told(path: Path) -> Iterator[None]:
    try:
        yield
    except (OSError, ValueError) as error:  # ValueError: a path with a NUL
        raise OutputError(
            f"the journal cannot be used ({error})", where=str(path), remedy="name another file"
        ) from error


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _lines(path: Path) -> list[dict[str, Any]]:
    """Those that can be read."""
    found = []
    with _told(path), suppress(FileNotFoundError):
        for text in path.read_text("utf-8", "replace").splitlines():
            with suppress(ValueError):
                line = json.loads(text)
                if isinstance(line, dict):
                    found.append(line)
    return found


def _place(line: dict[str, Any]) -> Place | None:
    """None for a line that somebody else has written."""
    if not line.keys() >= _KEYS:
        return None
    try:
        return line["mesh"], line["round"], Setting(**line["setting"])
    except TypeError:
        return None
