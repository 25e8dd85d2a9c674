"""Manifest and folder to assets: what is made of which mesh, with which options, and where to."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from simplifier.builds.finding import Requirements
from simplifier.builds.globs import Glob, mesh_files
from simplifier.builds.manifest import Manifest, Resolved, cascade, resolve
from simplifier.builds.outputs import Output, level_base, outputs_of
from simplifier.errors import ManifestError
from simplifier.io.suffixes import MESH_SUFFIXES
from simplifier.options.simplify import SimplifyOptions


@dataclass(frozen=True)
class Asset:
    """A mesh and what is to become of it.

    ``name``     its path, relative to the manifest's folder, with ``/`` between names.
    ``outputs``  with levels of detail each stands for their files, too.
    ``where``    the file and line that the outputs are said at.
    """

    name: str
    outputs: tuple[Output, ...]
    options: SimplifyOptions
    requirements: Requirements
    where: str

    @property
    def files(self) -> tuple[str, ...]:
        """Those of the outputs."""
        return tuple(output.file for output in self.outputs)


def plan_assets(manifest: Manifest, made: Collection[str] = ()) -> tuple[Asset, ...]:
    """The assets of a manifest, by name.

    Of the files that patterns name, those that are outputs are none: of another such file, or, by
    the record, ``made`` by an earlier run.  Raises :class:`ManifestError` for a pattern that names
    no mesh, and for outputs that two meshes share or that would replace a mesh.
    """
    patterns = [one for block in manifest.blocks for one in block.files]
    found = _assets_by_name(manifest, mesh_files(manifest.folder, patterns))
    sources = _Sources(found, made)
    assets = tuple(one for one in found.values() if sources.holds(one.name))
    _check_literal(patterns, found, assets)
    _check_matched(patterns, assets)
    check_outputs(assets)
    return assets


def _assets_by_name(manifest: Manifest, files: Iterable[str]) -> dict[str, Asset]:
    """Assets by name, outputs among them; blocks that say the same are resolved once."""
    resolved: dict[tuple[int, ...], Resolved] = {}
    found = {}
    for name in files:
        said = tuple(i for i, block in enumerate(manifest.blocks) if block.names(name))
        if not said:
            continue
        if said not in resolved:
            blocks = [manifest.blocks[i] for i in said]
            settings = cascade([manifest.defaults, *(block.settings for block in blocks)])
            resolved[said] = resolve(settings, blocks[-1].where)
        chosen = resolved[said]
        outputs = outputs_of(name, chosen.output.value, chosen.output.where)
        found[name] = Asset(name, outputs, chosen.options, chosen.requirements, chosen.output.where)
    return found


class _Sources:
    """Which of some files are nobody's output."""

    def __init__(self, found: Mapping[str, Asset], made: Collection[str]) -> None:
        self._made = frozenset(made)
        self._makers: dict[str, list[Asset]] = {}
        for asset in found.values():
            for output in asset.files:
                self._makers.setdefault(output, []).append(asset)
        self._known: dict[str, bool] = {}

    def holds(self, name: str) -> bool:
        if name not in self._known:
            self._known[name] = True  # where outputs go round in a circle
            others = (one.name for one in self._makers_of(name) if one.name != name)
            self._known[name] = name not in self._made and not any(map(self.holds, others))
        return self._known[name]

    def _makers_of(self, name: str) -> list[Asset]:
        base = level_base(name)
        leveled = self._makers.get(base, []) if base else []
        return self._makers.get(name, []) + [one for one in leveled if one.options.levels]


def _check_literal(
    patterns: Iterable[Glob], found: Mapping[str, Asset], assets: Iterable[Asset]
) -> None:
    """What is named in full is meant to be a mesh: it must not be taken for an output."""
    names = {asset.name for asset in assets}
    for pattern in patterns:
        if pattern.literal and pattern.text in found and pattern.text not in names:
            raise ManifestError(
                f"'{pattern.text}' is what another mesh becomes",
                where=pattern.where,
                remedy="name another output for that one, or take this one out",
            )


def _check_matched(patterns: Iterable[Glob], assets: Collection[Asset]) -> None:
    for pattern in patterns:
        if not any(pattern.matches(asset.name) for asset in assets):
            raise ManifestError(
                f"'{pattern.text}' names no mesh",
                where=pattern.where,
                remedy=f"correct it, or take it out; meshes end in {' '.join(MESH_SUFFIXES)}",
            )


def check_outputs(assets: Collection[Asset]) -> None:
    """Raise :class:`ManifestError` where two assets would become one file, or one a mesh.

    Also of names that differ by case alone, which are one file on other systems.
    """
    meshes = {asset.name.casefold(): asset for asset in assets}
    owners: dict[str, Asset] = {}
    for asset in assets:
        for output in asset.files:
            folded = output.casefold()
            if folded in meshes:
                raise _replacing(asset, output, meshes[folded])
            if folded in owners:
                raise _sharing_error(asset, output, owners[folded])
            owners[folded] = asset
    for output, asset in [*owners.items(), *meshes.items()]:
        base = level_base(output)
        other = owners.get(base) if base else None
        if other is not None and other is not asset and other.options.levels:
            raise _sharing_error(asset, output, other)


def _replacing(asset: Asset, output: str, mesh: Asset) -> ManifestError:
    which = "the mesh itself" if mesh is asset else f"the mesh '{mesh.name}'"
    return ManifestError(
        f"'{asset.name}' would become '{output}', which is {which}",
        where=asset.where,
        remedy="name another output, as in '{folder}/{name}_occluder.glb'",
    )


def _sharing_error(asset: Asset, output: str, other: Asset) -> ManifestError:
    what = f"an output of '{asset.name}' twice" if asset is other else (
        f"what both '{other.name}' and '{asset.name}' become"
    )  # fmt: skip
    return ManifestError(
        f"'{output}' is {what}",
        where=asset.where,
        remedy="put {folder}, {name} or {suffix} into the output",
    )
