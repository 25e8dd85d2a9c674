"""``occluders.toml``: which files become occluders, and how.

What a block of a manifest says of its assets, and what several together come to.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from simplifier.builds.finding import Requirements
from simplifier.builds.globs import Glob
from simplifier.builds.outputs import Output
from simplifier.errors import ManifestError, OptionError
from simplifier.io.toml import Table, read_toml
from simplifier.options.fields import OptionField
from simplifier.options.simplify import SimplifyOptions

MANIFEST_NAME = "occluders.toml"
"""The manifest's usual name."""


@dataclass(frozen=True)
class Block:
    """Files and what holds for them.  ``where`` the block begins."""

    files: tuple[Glob, ...]
    exclude: tuple[Glob, ...]
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
            "'defaults' is not a table",
            where=top.where("defaults"),
            remedy="begin it by [defaults]",
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


def _patterns(table: Table, key: str) -> tuple[Glob, ...]:
    if key not in table:
        return ()
    return tuple(Glob(text, table.where(key)) for text in texts(table, key))


_OUTPUT, _REQUIRE = "output", "require"
_OPTIONS = {field.name: field for field in SimplifyOptions.fields()}
_REQUIREMENTS = {field.name: field for field in Requirements.fields()}
_WRITING = {field.name: field for field in Output.fields()}

_RIVALS = (
    {"resolution", "error_bound", "error_bounds"},
    {"lods", "error_bounds"},
    {"moves", "time_limit"},
)
"""Answers to one question: a later block's takes the place of an earlier block's."""

BESIDE = Output("{folder}/{name}_occluder.glb")
"""Where none is named."""


@dataclass(frozen=True)
class ManifestSetting:
    """A value, checked, and the file and line that it stands at."""

    value: Any
    where: str


@dataclass(frozen=True)
class Settings:
    """Values by name, of one block or of several.

    ``options``       by the names of :class:`~simplifier.options.simplify.SimplifyOptions`.
    ``requirements``  by those of :class:`~simplifier.builds.finding.Requirements`.
    ``output``        a tuple of templates, :class:`Output`, if there is one.
    """

    options: Mapping[str, ManifestSetting]
    requirements: Mapping[str, ManifestSetting]
    output: ManifestSetting | None = None


@dataclass(frozen=True)
class Resolved:
    """What counts for an asset.  ``where`` the outputs are said, if anywhere."""

    options: SimplifyOptions
    requirements: Requirements
    output: ManifestSetting


def read_settings(table: Table, others: Collection[str] = ()) -> Settings:
    """Those of a table, each checked by itself; ``others`` are keys that it may have beside.

    Raises :class:`ManifestError` with file and line.
    """
    _check_writing(table)
    check_keys(table, [*others, _OUTPUT, _REQUIRE, *_OPTIONS])
    demanded = table.get(_REQUIRE, {})
    if not isinstance(demanded, Mapping):
        raise ManifestError(
            "'require' is not a table",
            where=table.where(_REQUIRE),
            remedy="write as in: require = { min_recall = 0.8 }",
        )
    if isinstance(demanded, Table):
        check_keys(demanded, list(_REQUIREMENTS))
    return Settings(
        _check_values(table, _OPTIONS),
        _check_values(demanded, _REQUIREMENTS) if isinstance(demanded, Table) else {},
        _output(table),
    )


def cascade(blocks: Iterable[Settings]) -> Settings:
    """Several, each over those before it, setting by setting."""
    options: dict[str, ManifestSetting] = {}
    requirements: dict[str, ManifestSetting] = {}
    output = None
    for block in blocks:
        replaced = {
            rival for name in block.options for group in _RIVALS if name in group for rival in group
        }
        kept = {name: one for name, one in options.items() if name not in replaced}
        options = {**kept, **block.options}
        requirements |= block.requirements
        output = block.output or output
    return Settings(options, requirements, output)


def resolve(settings: Settings, where: str) -> Resolved:
    """With the defaults of what is not set.

    Raises :class:`ManifestError` for what cannot go together, at the line of the one that is to
    blame or else at ``where``.
    """
    try:
        options = SimplifyOptions(**_values(settings.options))
    except OptionError as error:
        blamed = settings.options.get(error.where.replace(" ", "_"))
        place = where if blamed is None else blamed.where
        raise ManifestError(
            f"{error.where}: {error.what}", where=place, remedy=error.remedy
        ) from None
    requirements = Requirements(**_values(settings.requirements))
    output = settings.output or ManifestSetting((BESIDE,), where)
    if options.levels is not None and any(one.with_original for one in output.value):
        raise ManifestError(
            "levels of detail are not written with the original",
            where=output.where,
            remedy="take with_original out, or the levels",
        )
    return Resolved(options, requirements, output)


def check_keys(table: Table, known: Collection[str]) -> None:
    """Raise :class:`ManifestError` for a key that is not known, with the one that may be meant."""
    for key in table:
        if key not in known:
            near = get_close_matches(key.replace("-", "_"), known, n=1)
            raise ManifestError(
                f"'{key}' is not known",
                where=table.where(key),
                remedy=f"did you mean '{near[0]}'?" if near else f"choose from {', '.join(known)}",
            )


def texts(table: Table, key: str) -> tuple[str, ...]:
    """A text or a list of texts, at least one.  Raises :class:`ManifestError`."""
    value = table[key]
    listed = value if isinstance(value, list) else [value]
    if not listed or not all(isinstance(one, str) and one for one in listed):
        raise ManifestError(
            f"'{key}' is neither a text nor a list of texts",
            where=table.where(key),
            remedy='write as in: "props/*.glb"',
        )
    return tuple(listed)


def _check_values(table: Table, fields: Mapping[str, OptionField]) -> dict[str, ManifestSetting]:
    return {
        name: ManifestSetting(value, table.where(name)) for name, value in _values_of(table, fields)
    }


def _values_of(table: Table, fields: Mapping[str, OptionField]) -> Iterator[tuple[str, Any]]:
    for name in table:
        if name not in fields:
            continue
        value = tuple(table[name]) if isinstance(table[name], list) else table[name]
        try:
            fields[name].check(value)
        except OptionError as error:
            raise ManifestError(
                f"{name}: {error.what}", where=table.where(name), remedy=error.remedy
            ) from None
        yield name, value


def _output(table: Table) -> ManifestSetting | None:
    """A text, a table, or a list of them."""
    if _OUTPUT not in table:
        return None
    value = table[_OUTPUT]
    listed = value if isinstance(value, list) else [value]
    if not listed:
        raise _no_output(table)
    return ManifestSetting(tuple(_template(table, one) for one in listed), table.where(_OUTPUT))


def _template(table: Table, said: Any) -> Output:
    if isinstance(said, str) and said:
        return Output(said)
    if not (isinstance(said, Table) and isinstance(said.get("file"), str) and said["file"]):
        raise _no_output(table)
    check_keys(said, ["file", *_WRITING])
    written = {name: one.value for name, one in _check_values(said, _WRITING).items()}
    return Output(said["file"], **written)


def _no_output(table: Table) -> ManifestError:
    return ManifestError(
        "'output' is neither a text, a table with a file, nor a list of them",
        where=table.where(_OUTPUT),
        remedy='write as in: "{folder}/{name}.glb", or { file = "{folder}/{name}.glb", '
        'sides = "single" }',
    )


def _check_writing(table: Table) -> None:
    """One mesh may become several files, each written in its own way."""
    for key in table:
        if key.replace("-", "_") in _WRITING:
            raise ManifestError(
                f"'{key}' is said of an output",
                where=table.where(key),
                remedy=f'write as in: output = {{ file = "{BESIDE.file}", {key} = ... }}',
            )


def _values(settings: Mapping[str, ManifestSetting]) -> dict[str, Any]:
    return {name: setting.value for name, setting in settings.items()}
