"""``occluders.lock``: what was made of what, kept beside the manifest and in version control.

The text is JSON, the same for the same content: sorted, and no line of an asset depends on another
one, so that changes of different assets merge.

The record that a change is compared with: a file, or that of a revision of git.
"""

from __future__ import annotations

import json
import re
import subprocess
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from simplifier.accuracy.verdict import VERDICT_WORDS, VerdictWord
from simplifier.builds.finding import AssetFigures, Finding
from simplifier.checks import is_finite
from simplifier.errors import ManifestError, OptionError
from simplifier.io.files import read_bytes, write_whole
from simplifier.io.places import is_file, is_there

_SCHEMA_VERSION = 1
_CONFLICT = re.compile(rb"^<<<<<<< ", re.MULTILINE)
_REST = 20.0  # times as long as writing it took: the rest of a build is for building


@dataclass(frozen=True)
class Entry:
    """What was made of a mesh.

    ``mesh``     SHA-256 of its file.
    ``beside``   those of the other files that it is read with, by path relative to the mesh's;
                 empty for one that was not there.
    ``options``  those that differ from their defaults.
    ``version``  of the program that made it.
    ``outputs``  SHA-256 of all files made, by path relative to the manifest's folder.
    ``written``  how outputs are written, of those of which something is said.
    """

    mesh: str
    beside: Mapping[str, str]
    options: Mapping[str, Any]
    version: str
    outputs: Mapping[str, str]
    figures: AssetFigures
    written: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


Record = Mapping[str, Entry]
"""Entries by the name of the asset."""


def record_path(manifest: Path) -> Path:
    """Beside the manifest: of ``occluders.toml`` it is ``occluders.lock``."""
    return manifest.with_suffix(".lock")


def read_record(path: Path) -> Record:
    """Empty where there is none yet; raises :class:`ManifestError` for a damaged one."""
    if not is_there(path):
        return {}
    return parse_record(read_bytes(path, error=ManifestError, remedy="remove it"), str(path))


def parse_record(data: bytes, where: str) -> Record:
    """Raises :class:`ManifestError` for what is no record; ``where`` is what messages call it."""
    conflict = _CONFLICT.search(data)
    if conflict:
        line = data.count(b"\n", 0, conflict.start()) + 1
        raise ManifestError(
            "two changes of it were not merged",
            where=f"{where}:{line}",
            remedy="take either side and build again: what it does not know is made anew",
        )
    try:
        content = json.loads(data)
        version = content["schema_version"]
        entries = parse_entries(content)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise ManifestError(
            "this is not a record of a build", where=where, remedy="remove it and build again"
        ) from None
    if version != _SCHEMA_VERSION:
        raise ManifestError(
            f"its schema_version is {version}, and {_SCHEMA_VERSION} is known here",
            where=where,
            remedy="use the version that wrote it, or remove it and build again",
        )
    return entries


def parse_entries(content: Mapping[str, Any]) -> dict[str, Entry]:
    """Those of a record's JSON; raises what a value of another kind makes of it."""
    return {utf8_text(name): _entry(one) for name, one in content["assets"].items()}


def write_record(path: Path, record: Record) -> None:
    """Whole or not at all.  Raises :class:`~simplifier.errors.OutputError`."""
    write_whole(path, record_text(record, schema_version=_SCHEMA_VERSION).encode())


def record_text(record: Record, **more: Any) -> str:
    """As JSON, with ``more`` beside the assets; these come first, so that none is the last line."""
    # Not by asdict, which copies whatever it meets and took a third of a join.
    assets = {
        name: {**vars(entry), "figures": vars(entry.figures)} for name, entry in record.items()
    }
    content = {"assets": assets, **more}
    text = json.dumps(content, indent=1, sort_keys=True, allow_nan=False, ensure_ascii=False)
    return f"{text}\n"


class RecordKeeper:
    """A record that changes while a build runs, in its file often enough that little is lost."""

    def __init__(self, path: Path, record: Record) -> None:
        self._path, self._entries = path, dict(record)
        self._changed = False
        self._rest_until = 0.0

    def entry(self, name: str) -> Entry | None:
        return self._entries.get(name)

    def note(self, finding: Finding) -> None:
        """Hear of one that was made, before its entry is put, or that failed."""

    def put(self, name: str, entry: Entry) -> None:
        """Raises :class:`~simplifier.errors.OutputError`."""
        self._entries[name] = entry
        self._changed = True
        if time.monotonic() >= self._rest_until:
            self.save()

    def drop(self, name: str) -> None:
        del self._entries[name]
        self._changed = True

    def save(self) -> None:
        """Write what has changed.  Raises :class:`~simplifier.errors.OutputError`."""
        if not self._changed:
            return
        begin = time.monotonic()
        self._write()
        end = time.monotonic()
        self._rest_until = end + _REST * (end - begin)
        self._changed = False

    def _write(self) -> None:
        write_record(self._path, self._entries)


def _entry(data: Mapping[str, Any]) -> Entry:
    """Raises what a value of another kind makes of it."""
    figures = data["figures"]
    bound = figures["error_bound"]
    # A record from before they were kept lacks them.
    overhang, verdict = figures.get("overhang"), figures.get("verdict")
    return Entry(
        utf8_text(data["mesh"]),
        _texts(data["beside"]),
        _settings(data["options"]),
        utf8_text(data["version"]),
        _texts(data["outputs"]),
        AssetFigures(
            _whole(figures["triangles"]),
            _number(figures["precision"]),
            _number(figures["recall"]),
            _number(figures["deviation"]),
            None if bound is None else _number(bound),
            None if overhang is None else _number(overhang),
            None if verdict is None else _verdict(verdict),
        ),
        {utf8_text(output): _settings(said) for output, said in data["written"].items()},
    )


def _verdict(word: str) -> VerdictWord:
    for one in VERDICT_WORDS:
        if word == one:
            return one
    raise ValueError


def _texts(data: Mapping[str, Any]) -> dict[str, str]:
    return {utf8_text(key): utf8_text(value) for key, value in data.items()}


def _settings(data: Mapping[str, Any]) -> dict[str, Any]:
    """Of options, whose values are single, or lists of numbers."""
    return {
        utf8_text(name): [_number(one) for one in value]
        if isinstance(value, list)
        else _single(value)
        for name, value in data.items()
    }


def _single(value: Any) -> Any:
    if value is None or isinstance(value, bool):
        return value
    return utf8_text(value) if isinstance(value, str) else _number(value)


def utf8_text(value: str) -> str:
    """The same; raises ValueError or AttributeError for what is none."""
    value.encode()  # JSON may hold halves of characters, which no file can
    return value


def _whole(value: int) -> int:
    if not isinstance(value, int):
        raise TypeError
    return value


def _number(value: float) -> float:
    if not is_finite(value):
        raise TypeError
    return value


def baseline(against: str, manifest: Path) -> Record:
    """Empty for a revision that has no record yet.

    Raises :class:`OptionError` for what is neither a file nor a revision, and
    :class:`~simplifier.errors.ManifestError` for a record that is damaged.
    """
    if is_file(Path(against)):
        return read_record(Path(against))
    name = record_path(manifest).name
    shown = _git(manifest.parent, "ls-tree", "--name-only", against, "--", name)
    if shown is None:
        raise OptionError(
            f"'{against}' is neither a file nor a revision of git",
            where="against",
            remedy="name a record, or a revision such as HEAD or origin/main that was fetched",
        )
    if not shown.strip():
        return {}
    data = _git(manifest.parent, "show", f"{against}:./{name}")
    return parse_record(data or b"", f"{against}:{name}")


def _git(folder: Path, *arguments: str) -> bytes | None:
    """What git prints; None where it fails or is not there."""
    try:
        done = subprocess.run(
            ["git", "-C", str(folder), *arguments], capture_output=True, check=False
        )
    except OSError:
        return None
    return done.stdout if done.returncode == 0 else None
