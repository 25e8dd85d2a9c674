"""How easily things are found: sizes of files and functions, and who imports whom.

    python -m bench.structure [ROOT]       # the packages simplifier and service, and the pages

A file without a statement (an empty ``__init__.py``) is not counted.
"""

from __future__ import annotations

import argparse
import ast
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from bench.machine import ROOT

PACKAGES = ("simplifier", "service")
PAGES = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "docs")


@dataclass(frozen=True)
class Module:
    """A file, parsed; ``name`` is its dotted one, that of a package for ``__init__``."""

    name: str
    lines: int
    tree: ast.Module

    @property
    def folder(self) -> str:
        return self.name.rpartition(".")[0]


def main() -> None:
    """Print the figures of each package, and the words of each page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("root", type=Path, nargs="?", default=ROOT)
    root = parser.parse_args().root
    everything = {package: modules_of(root, package) for package in PACKAGES}
    for package, modules in everything.items():
        for name, value in figures(package, modules).items():
            print(f"{package}: {name}: {value}")
    for name, words in words_of(root).items():
        print(f"words: {name}: {words:,}")


def modules_of(root: Path, package: str) -> dict[str, Module]:
    """The modules of a package that hold a statement, by name."""
    found = {}
    for path in sorted((root / package).rglob("*.py")):
        text = path.read_text("utf-8")
        tree = ast.parse(text)
        parts = path.relative_to(root).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        if any(not isinstance(one, ast.Expr) for one in tree.body):
            found[name] = Module(name, text.count("\n"), tree)
    return found


def figures(package: str, modules: Mapping[str, Module]) -> dict[str, object]:
    """The figures of one package, by what they are called."""
    sizes = {name: one.lines for name, one in modules.items()}
    functions = dict(_functions(modules))
    importers = _importers(modules)
    alone = [
        name
        for name, users in importers.items()
        if len(users) == 1 and modules[next(iter(users))].folder == modules[name].folder
    ]
    folders = {
        (modules[user].folder, modules[name].folder)
        for name, users in importers.items()
        for user in users
        if modules[user].folder != modules[name].folder
    }
    longest, slowest = max(sizes, key=sizes.__getitem__), max(functions, key=functions.__getitem__)
    return {
        "files": len(modules),
        "lines": f"{sum(sizes.values()):,}",
        "loose files": sum(name.count(".") <= 1 and _is_loose(name, modules) for name in modules),
        "median file": round(median(sizes.values())),
        "longest file": f"{sizes[longest]} ({longest})",
        "median function": round(median(functions.values())),
        "longest function": f"{functions[slowest]} ({slowest})",
        "imports between folders": len(folders),
        "modules with one importer, in their folder": len(alone),
    }


def words_of(root: Path) -> dict[str, int]:
    """Words of the pages, and of all together."""
    pages = [path for name in PAGES for path in _pages(root / name)]
    counted = {
        path.relative_to(root).as_posix(): len(path.read_text("utf-8").split()) for path in pages
    }
    return {**counted, "all": sum(counted.values())}


def _pages(place: Path) -> list[Path]:
    return sorted(place.rglob("*.md")) if place.is_dir() else [place]


def _is_loose(name: str, modules: Mapping[str, Module]) -> bool:
    """Whether a module stands at the top of its package and is no folder."""
    return not any(other.startswith(f"{name}.") for other in modules) or "." not in name


def _functions(modules: Mapping[str, Module]) -> Iterator[tuple[str, int]]:
    for name, module in modules.items():
        for node in ast.walk(module.tree):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                yield f"{name}:{node.name}:{node.lineno}", (node.end_lineno or 0) - node.lineno + 1


def _importers(modules: Mapping[str, Module]) -> dict[str, set[str]]:
    """By module, those of the package that import it or a name of it."""
    users: dict[str, set[str]] = defaultdict(set)
    for name, module in modules.items():
        for node in ast.walk(module.tree):
            if isinstance(node, ast.ImportFrom) and node.level == 0 and node.module is not None:
                for alias in node.names:
                    whole = f"{node.module}.{alias.name}"
                    users[whole if whole in modules else node.module].add(name)
    return {name: found - {name} for name, found in users.items() if name in modules}


if __name__ == "__main__":
    main()
