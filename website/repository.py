"""Where each file of the repository is in the site.

Pages of ``docs/`` keep their places, the README is the home page.  What else a page links to comes
along below ``repository/``: pages as pages, source text as a page of code, a folder as a list of
what is in it, and the rest as it is.  So each link works on a code host and in the site.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
DOCS = "docs"
BELOW = "repository"
HOME = "README.md"
ROOTS = (HOME, "CHANGELOG.md", "CONTRIBUTING.md")
"""Pages outside of ``docs/`` that are part of the site whether or not one links to them."""

_AS_THEY_ARE = frozenset((".csv", ".glb", ".json", ".pdf", ".png", ".svg"))
_LANGUAGES = {
    ".c": "c", ".cpp": "cpp", ".cs": "csharp", ".h": "c", ".ini": "ini", ".js": "javascript",
    ".py": "python", ".sh": "bash", ".toml": "toml", ".yaml": "yaml", ".yml": "yaml",
}  # fmt: skip
_UNLISTED = frozenset(("__pycache__", "__init__.py"))

_LINK = re.compile(
    r"(?P<code>^ *```.*?^ *```[^\n]*$|`(?:[^`\n]|\n(?!\s*\n))+`)"
    r"|(?P<before>\]\(|(?:src|href)=\")(?P<target>[^)\s\"]+)",
    re.MULTILINE | re.DOTALL,
)
_ELSEWHERE = re.compile(r"[a-z]+:|#|/")


def site_path(path: str) -> str:
    """Of a file or folder of the repository, the file of the site's sources that shows it."""
    if path == HOME:
        return "index.md"
    if path.startswith(f"{DOCS}/") and (ROOT / path).is_file():
        return path.removeprefix(f"{DOCS}/")
    if (ROOT / path).is_dir():
        return f"{BELOW}/{path}/index.md"
    if path.endswith(".md") or Path(path).suffix in _AS_THEY_ARE:
        return f"{BELOW}/{path}"
    return f"{BELOW}/{path}.md"


def rewritten(text: str, path: str) -> str:
    """A page of the repository with its links as they are in the site."""
    here = posixpath.dirname(site_path(path))

    def moved(target: str) -> str:
        name, mark, section = target.partition("#")
        there = site_path(_resolved(name, path))
        return posixpath.relpath(there, here or ".") + mark + section

    return _each_link(text, moved)


def linked(text: str, path: str) -> Iterator[str]:
    """The files and folders of the repository that a page of it links to."""
    found: list[str] = []

    def noted(target: str) -> str:
        found.append(_resolved(target.partition("#")[0], path))
        return target

    _each_link(text, noted)
    yield from found


def brought_along(pages: Iterable[str]) -> dict[str, str | Path]:
    """What the site needs of the repository beside ``docs/``, for these pages of it.

    By its place in the sources of the site: the text of a page, or the file to copy.  Pages that
    come along bring what they link to in turn.  Raises :class:`FileNotFoundError` for a link that
    leads nowhere, with the page that has it.
    """
    needed: dict[str, str | Path] = {}
    waiting = [*ROOTS, *pages]
    seen = set(waiting)
    while waiting:
        path = waiting.pop()
        text, links = _shown(path)
        if not path.startswith(f"{DOCS}/") or (ROOT / path).is_dir():
            needed[site_path(path)] = text
        for one in links:
            if not (ROOT / one).exists():
                raise FileNotFoundError(f"{path}: links to {one}, which is not there; correct it")
            if one not in seen:
                seen.add(one)
                waiting.append(one)
    return needed


def source_of(place: str) -> str | None:
    """The page of the repository that a page of the site is, if its links are to be rewritten."""
    if place == "index.md":
        return HOME
    path = place.removeprefix(f"{BELOW}/") if place.startswith(f"{BELOW}/") else f"{DOCS}/{place}"
    return path if path.endswith(".md") and (ROOT / path).is_file() else None


def _shown(path: str) -> tuple[str | Path, list[str]]:
    """How a file or folder is shown, and what that links to."""
    place = ROOT / path
    if place.is_dir():
        names = sorted(one.name for one in place.iterdir() if _is_listed(one))
        lines = [f"- [{name}]({_beside(path, f'{path}/{name}')})" for name in names]
        return _unsearched(f"# {path}\n\n" + "\n".join(lines)), [f"{path}/{one}" for one in names]
    if place.suffix in _AS_THEY_ARE or not place.exists():
        return place, []
    text = place.read_text(encoding="utf-8")
    if place.suffix == ".md":
        links = list(linked(text, path))
        return (text if path in ROOTS else _unsearched(text)), links
    language = _LANGUAGES.get(place.suffix, "text")
    return _unsearched(f"# {path}\n\n`````{language}\n{text}\n`````\n"), []


def _is_listed(place: Path) -> bool:
    return place.name not in _UNLISTED and not place.name.startswith(".")


def _beside(folder: str, path: str) -> str:
    return posixpath.relpath(site_path(path), posixpath.dirname(site_path(folder)))


def _unsearched(text: str) -> str:
    """A page that searches pass over, since it would crowd out the documentation."""
    return f"---\nsearch:\n  exclude: true\n---\n\n{text}"


def _resolved(target: str, page: str) -> str:
    return posixpath.normpath(posixpath.join(posixpath.dirname(page), target))


def _each_link(text: str, change: Callable[[str], str]) -> str:
    """The text with each link to a file changed; code and links elsewhere stay as they are."""

    def changed(found: re.Match[str]) -> str:
        target = found["target"]
        if found["code"] or _ELSEWHERE.match(target):
            return found[0]
        return found["before"] + change(target)

    return _LINK.sub(changed, text)
