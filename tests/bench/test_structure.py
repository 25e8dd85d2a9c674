"""The figures of the structure, on a package of three files."""

from __future__ import annotations

from bench.structure import figures, modules_of, words_of


def test_figures_of_a_small_package(tmp_path):
    for name, text in {
        "pack/__init__.py": '"""Only words."""\n',
        "pack/top.py": "from pack.inner.step import run\n\n\ndef go():\n    return run()\n",
        "pack/inner/__init__.py": "",
        "pack/inner/step.py": "from pack.inner import helper\n\n\n"
        "def run():\n    return helper.X\n",
        "pack/inner/helper.py": "X = 1\n",
        "README.md": "five words of plain text\n",
        "CONTRIBUTING.md": "one\n",
        "CHANGELOG.md": "two words\n",
        "docs/page.md": "three more words\n",
    }.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    found = figures("pack", modules_of(tmp_path, "pack"))
    assert found == {
        "files": 3,
        "lines": "11",
        "loose files": 1,
        "median file": 5,
        "longest file": "5 (pack.inner.step)",
        "median function": 2,
        "longest function": "2 (pack.inner.step:run:4)",
        "imports between folders": 1,
        "modules with one importer, in their folder": 1,
    }
    assert words_of(tmp_path)["docs/page.md"] == 3
    assert words_of(tmp_path)["all"] == 11
