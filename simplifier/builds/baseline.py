"""The record that a change is compared with: a file, or that of a revision of git."""

from __future__ import annotations

import subprocess
from pathlib import Path

from simplifier.builds.record import Record, parse_record, read_record, record_path
from simplifier.errors import OptionError


def baseline(against: str, manifest: Path) -> Record:
    """Empty for a revision that has no record yet.

    Raises :class:`OptionError` for what is neither a file nor a revision, and
    :class:`~simplifier.errors.ManifestError` for a record that is damaged.
    """
    if Path(against).is_file():
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
