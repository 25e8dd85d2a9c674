"""Whether what a command makes is current: by this version, of the same files and options.

What was made of what is kept in the user's own folder, a small file an output, so that nothing lies
beside it.  Where nothing can be kept, every occluder is made anew, and every scene gone through.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from hashlib import sha256
from pathlib import Path
from types import MappingProxyType
from typing import Any

import typer

from simplifier.builds.digests import Digests
from simplifier.errors import OccluderError
from simplifier.io.files import make_folder, write_whole
from simplifier.io.places import followed
from simplifier.kernels.threads import thread_count
from simplifier.options.fields import OptionSet
from simplifier.version import VERSION

_FOLDER = "planar-occluder"
_MOST = 500
"""Outputs that are known of; the oldest are forgotten."""


@dataclass(frozen=True)
class Making:
    """All that an occluder, or a scene's, hangs on, and where it goes.

    ``output``  the file or folder that was named, or the base of the names of levels.
    ``asked``   version, options and digests of the files that are read, as JSON has them.
    """

    output: Path
    asked: Mapping[str, Any]
    _read: Digests = field(default_factory=Digests, compare=False, repr=False)

    @classmethod
    def of(
        cls,
        stamp: tuple[str, Mapping[str, str]],
        output: Path,
        overrides: Path | None,
        *options: OptionSet,
        also: Mapping[str, Any] = MappingProxyType({}),
    ) -> Making:
        """``stamp``  of what is read, as :func:`~simplifier.builds.making.mesh_stamp` gives it;
        ``overrides`` the file of them that is read, if one is; ``also`` what is no option."""
        digest, beside = stamp
        by_hand = None if overrides is None else Digests().of(overrides)
        chosen = {name: value for one in options for name, value in one.chosen().items()}
        asked = {"version": VERSION, "mesh": digest, "beside": beside, "by_hand": by_hand,
                 "options": chosen, **also}  # fmt: skip
        return cls(followed(output), json.loads(json.dumps(asked)))

    def current(self) -> Any:
        """What was told of what is there, if that is what would be made; else None."""
        try:
            kept = json.loads(self._record.read_bytes())
            files = kept["files"]
            self._read.remember(files, kept.get("stamps", {}))  # earlier versions kept none
            known = kept["asked"] == self.asked and self._digests(files) == files
            return kept["report"] if known else None
        except (OSError, ValueError, KeyError, TypeError, AttributeError):  # none, or damaged
            return None

    def keep(self, files: Iterable[Path], report: Mapping[str, Any]) -> None:
        """Remember what was made, and what to tell of it: JSON."""
        digests = self._digests(_resolved(files))
        kept = {
            "asked": self.asked,
            "files": digests,
            "stamps": self._read.stamps(digests),
            "report": report,
        }
        with suppress(OSError, OccluderError):
            make_folder(self._record.parent)
            write_whole(self._record, json.dumps(kept).encode())
            _forget_oldest(self._record.parent)

    def _digests(self, files: Iterable[str]) -> dict[str, str | None]:
        """What was not written since it was looked at, by this run or the last, is not read."""
        return self._read.all_of(files, thread_count())

    @property
    def _record(self) -> Path:
        name = sha256(str(self.output).encode(errors="surrogateescape")).hexdigest()
        return Path(typer.get_app_dir(_FOLDER)) / "made" / f"{name}.json"


def _resolved(files: Iterable[Path]) -> list[str]:
    """Each by the path of its folder, looked up once: a scene has thousands of files in one."""
    resolved = cache(os.path.realpath)
    split = (os.path.split(file) for file in files)
    return [os.path.join(resolved(folder), name) for folder, name in split]  # noqa: PTH118


def _forget_oldest(folder: Path) -> None:
    known = sorted(folder.glob("*.json"), key=lambda one: one.stat().st_mtime, reverse=True)
    for record in known[_MOST:]:
        record.unlink(missing_ok=True)
