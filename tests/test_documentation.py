"""What the pages point to is there: files, commands, other pages and their sections."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.acceptance.command import ROOT

SHORT = ("simplifier", "service")
"""Folders that a page need not name: ``voxel/fill.py`` is that of ``simplifier``."""
OF_CODE = (".ci", "bench", "docker", "examples", "integrations", "tests", "website")
FOLDERS = frozenset(("docs", *OF_CODE, *SHORT))
PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")),
    *sorted((ROOT / "docs").rglob("*.md")),
    *sorted((ROOT / "bench" / "results").glob("*.md")),
    *sorted((ROOT / "examples").rglob("*.md")),
]

_FENCE = re.compile(r"^ *```.*?^ *```[^\n]*$", re.MULTILINE | re.DOTALL)
_CODE = re.compile(r"`((?:[^`\n]|\n(?!\s*\n))+)`")
_WORD = re.compile(r"[^\s\"'=()`]+")
_LINK = re.compile(r"\]\(([^)\s]+)\)|(?:src|href)=\"([^\"]+)\"")
_MODULE = re.compile(r"python3? -m\s+([\w.]+)")
_PATH = re.compile(r"[\w.*<>-]+(?:/[\w.*<>-]+)*/?")
_PLACEHOLDER = re.compile(r"<\w+>|(?<![A-Za-z])[A-Z]{2,}(?:_[A-Z]+)*(?![A-Za-z])")
_HEADING = re.compile(r"^#{1,6} (.+)$", re.MULTILINE)


class Mention(NamedTuple):
    """What a line of a page points to; ``path`` as it is written there."""

    page: Path
    line: int
    path: str

    def __str__(self) -> str:
        return f"{self.page.relative_to(ROOT)}:{self.line}: {self.path}"


def text_of(page: Path) -> str:
    return page.read_text(encoding="utf-8")


def without(pattern: re.Pattern[str], text: str) -> str:
    """The text with all matches taken away; every line keeps its number."""
    return pattern.sub(lambda found: "\n" * found[0].count("\n"), text)


def file_mentions(page: Path) -> Iterator[Mention]:
    """Every word of code that names a file or a folder of the repository."""
    text = text_of(page)
    prose = without(_FENCE, text)
    for blocks, source, fenced in ((_FENCE, text, True), (_CODE, prose, False)):
        for block in blocks.finditer(source):
            for word in _WORD.finditer(source, block.start(), block.end()):
                path = word[0].rstrip(".,:;")
                if _PATH.fullmatch(path) and is_of_the_repository(path, fenced):
                    yield Mention(page, source.count("\n", 0, word.start()) + 1, path)


def is_of_the_repository(path: str, fenced: bool) -> bool:
    """A path below one of its folders, or a Python file; in examples users have files too."""
    first, slash, _ = path.partition("/")
    if slash and first in FOLDERS:
        return True
    short = slash and (ROOT / "simplifier" / first).is_dir()
    return not fenced and bool(path.endswith(".py") or (short and path.endswith("/")))


def is_there(path: str) -> bool:
    """Under the repository or a folder that a page need not name; a bare name anywhere."""
    folders = [ROOT, *(ROOT / name for name in SHORT)]
    if "/" not in path:
        folders += [ROOT / name for name in sorted(FOLDERS)]
        return any(next(folder.rglob(path), None) is not None for folder in folders[1:])
    if any((folder / path).exists() for folder in folders):
        return True
    pattern = _PLACEHOLDER.sub("*", path)
    return "*" in pattern and any(next(folder.glob(pattern), None) for folder in folders)


def module_mentions(page: Path) -> Iterator[Mention]:
    """Modules of the repository that ``python -m`` is given."""
    text = text_of(page)
    for found in _MODULE.finditer(text):
        if found[1].split(".")[0] in FOLDERS:
            yield Mention(page, text.count("\n", 0, found.start()) + 1, found[1].rstrip("."))


def can_be_run(module: str) -> bool:
    place = ROOT.joinpath(*module.split("."))
    return place.with_suffix(".py").is_file() or (place / "__main__.py").is_file()


def link_mentions(page: Path) -> Iterator[Mention]:
    """Links to other pages, to files and to sections; not those to other places."""
    prose = without(_CODE, without(_FENCE, text_of(page)))
    for found in _LINK.finditer(prose):
        target = found[1] or found[2]
        if not re.match(r"[a-z]+:", target):
            yield Mention(page, prose.count("\n", 0, found.start()) + 1, target)


def leads_somewhere(link: Mention) -> bool:
    name, _, section = link.path.partition("#")
    target = (link.page.parent / name).resolve() if name else link.page
    if not target.exists():
        return False
    return not section or target.suffix != ".md" or section in sections(target)


def sections(page: Path) -> set[str]:
    """Anchors of a page's headings, as code hosts make them."""
    taken: Counter[str] = Counter()
    anchors = set()
    for heading in _HEADING.findall(without(_FENCE, text_of(page))):
        words = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading).strip().lower()
        anchor = re.sub(r"[^\w\- ]", "", words).replace(" ", "-")
        anchors.add(f"{anchor}-{taken[anchor]}" if taken[anchor] else anchor)
        taken[anchor] += 1
    return anchors


def by_name(page: Path) -> str:
    return str(page.relative_to(ROOT))


@pytest.fixture(params=PAGES, ids=by_name)
def page(request):
    return request.param


def test_files_that_a_page_names_exist(page):
    lost = [str(one) for one in file_mentions(page) if not is_there(one.path)]
    assert not lost, "no such file; name today's:\n" + "\n".join(lost)


def test_modules_that_a_page_runs_exist(page):
    lost = [str(one) for one in module_mentions(page) if not can_be_run(one.path)]
    assert not lost, "no such module to run; name today's:\n" + "\n".join(lost)


def test_links_of_a_page_lead_somewhere(page):
    lost = [str(one) for one in link_mentions(page) if not leads_somewhere(one)]
    assert not lost, "no such page, file or section:\n" + "\n".join(lost)


def test_what_is_lost_is_found_with_its_line(tmp_path):
    """The checks themselves: each kind of mention, once right and once wrong."""
    page = tmp_path / "page.md"
    page.write_text(
        "# Title: one, two\n"
        "`voxel/fill.py`, `voxel/drain.py`, `scene.json`, `model/obj`\n"
        "`bench/results/tradeoff_NAME.csv` `docs/NAME.csv` `pipeline.py` `no_such.py`\n"
        "`python -m bench.speed`, `python -m bench.haste`, `python -m pytest`\n"
        "[here](#title-one-two), [there](#title), [this](page.md), [that](lost.md#title)\n"
        "\n```\nexamples/castle.py castle.py examples/lost.py\n# Title\n```\n"
        "`occluder simplify\ndocs/lost.md` no `code\n\ndocs/lost.md` here\n"
    )
    lost = [(one.line, one.path) for one in file_mentions(page) if not is_there(one.path)]
    assert sorted(lost) == [
        (2, "voxel/drain.py"), (3, "docs/NAME.csv"), (3, "no_such.py"), (8, "examples/lost.py"),
        (12, "docs/lost.md"),
    ]  # fmt: skip
    run = [(one.line, one.path) for one in module_mentions(page)]
    assert run == [(4, "bench.speed"), (4, "bench.haste")]
    assert [path for _, path in run if not can_be_run(path)] == ["bench.haste"]
    assert [one.path for one in link_mentions(page) if not leads_somewhere(one)] == [
        "#title", "lost.md#title",
    ]  # fmt: skip


def test_the_pages_are_found():
    assert len(PAGES) > 25
    assert sum(1 for page in PAGES for _ in file_mentions(page)) > 50
