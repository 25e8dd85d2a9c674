"""Tests of ``simplifier/a/b.py`` are in ``tests/a/test_b.py`` or ``test_b_<aspect>.py``."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parents[1]
APART = {
    "acceptance", "bench", "cluster", "contracts", "examples", "extremes", "faults", "fuzz",
    "golden", "integrations", "mutants", "packaging", "properties", "service", "strategies",
    "website",
}  # fmt: skip
"""Folders that test more than a module, or no module of the library."""

OF_MANY = {
    "cli/test_commands.py": "every command, one after the other",
    "cli/test_interrupts.py": "signals, which cli/running.py has from its callers",
    "io/test_off_stl_tres.py": "three small formats under the same checks",
    "options/test_adding.py": "what an added option appears in",
    "production/test_judge.py": "the face's judgement of an occluder",
    "production/test_produce.py": "the face's run",
    "report/test_histogram.py": "two of the pictures of report/gallery.py",
    "test_documentation.py": "the pages",
    "test_import.py": "the package itself",
    "test_layout.py": "this rule",
    "test_operations.py": "the page on running a service",
    "tradeoff/test_pareto.py": "which settings tradeoff/cases.py leaves out",
    "tradeoff/test_pictures.py": "the plots of a study, with the page that holds them",
    "tradeoff/test_produce.py": "a study through the face",
    "visibility/oracles/test_blocker_extension.py": "a method of tests alone",
}
"""What else is not beside a module of its name, and why."""


def modules_of(folder: Path) -> set[str]:
    """Names of the modules and packages in a folder of the library."""
    files = {one.stem for one in folder.glob("*.py") if one.stem != "__init__"}
    return files | {one.parent.name for one in folder.glob("*/__init__.py")}


def test_every_file_of_tests_is_named_after_the_module_it_tests():
    tests = ROOT / "tests"
    lost = []
    for path in sorted(tests.rglob("test_*.py")):
        place = path.relative_to(tests)
        if place.parts[0] in APART or place.as_posix() in OF_MANY:
            continue
        name = path.stem.removeprefix("test_")
        modules = modules_of(ROOT / "simplifier" / place.parent)
        if not any(name == module or name.startswith(f"{module}_") for module in modules):
            lost.append(place.as_posix())
    assert not lost, f"no module of these names in simplifier: {lost}"


def test_no_exception_outlives_its_file():
    tests = ROOT / "tests"
    assert all((tests / name).is_file() for name in OF_MANY)
    assert not APART - {one.name for one in tests.iterdir()}
    assert not APART & {one.name for one in (ROOT / "simplifier").iterdir()}
