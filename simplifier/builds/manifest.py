"""``occluders.toml``: which files become occluders, and how."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from simplifier.builds.globs import Pattern
from simplifier.builds.settings import Settings, check_keys, read_settings, texts
from simplifier.errors import ManifestError
from simplifier.io.toml import Table, read_toml

NAME = "occluders.toml"
"""The manifest's usual name."""


@dataclass(frozen=True)
class Block:
    """Files and what holds for them.  ``where`` the block begins."""

    files: tuple[Pattern, ...]
    exclude: tuple[Pattern, ...]
    settings: Settings
    where: str

    def names(self, path: str) -> bool:
        """Whether it speaks of a file."""
        return any(one.matches(path) for one in self.files) and not any(
            one.matches(path) for one in self.exclude
        )


@dataclass(frozen=True)
class Manifest:
    """``blocks`` in the order of the file: a later one counts over those before it.

    Paths are relative to ``folder``, which the manifest is in.
    """

    path: Path
    defaults: Settings
    blocks: tuple[Block, ...]

    @property
    def folder(self) -> Path:
        return self.path.parent


def read_manifest(path: Path) -> Manifest:
    """Raises :class:`ManifestError` that says what is wrong, in which line, and what to do."""
    top = read_toml(path, error=ManifestError)
    check_keys(top, ("defaults", "asset"))
    defaults, blocks = top.get("defaults"), top.get("asset")
    if defaults is not None and not isinstance(defaults, Table):
        raise ManifestError(
            "'defaults' is no table", where=top.where("defaults"), remedy="begin it by [defaults]"
        )
    every = Settings({}, {}) if defaults is None else read_settings(defaults)
    if not isinstance(blocks, list) or not all(isinstance(one, Table) for one in blocks):
        raise ManifestError(
            "there is no [[asset]]",
            where=top.where("asset"),
            remedy='add one with files = "props/**/*.glb"',
        )
    return Manifest(path, every, tuple(_block(one) for one in blocks))


def _block(table: Table) -> Block:
    settings = read_settings(table, ("files", "exclude"))
    if "files" not in table:
        raise ManifestError(
            "this [[asset]] names no files",
            where=table.where(),
            remedy='add files = "props/**/*.glb" or the like',
        )
    return Block(_patterns(table, "files"), _patterns(table, "exclude"), settings, table.where())


def _patterns(table: Table, key: str) -> tuple[Pattern, ...]:
    if key not in table:
        return ()
    return tuple(Pattern(text, table.where(key)) for text in texts(table, key))
