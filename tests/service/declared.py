"""The commands that ``pyproject.toml`` declares, wherever the tests run from.

An installed package says which commands it adds; a checkout that is not installed does not.  A
folder with that record, first on the path, does it for both.
"""

from __future__ import annotations

import tomllib

from tests.acceptance.command import ROOT


def declare(folder):
    """Write the record; the folder, to be put on the path."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    record = folder / f"{project['name'].replace('-', '_')}-0.dist-info"
    record.mkdir(parents=True)
    (record / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: 0\n"
    )
    lines = [
        f"[{group}]\n" + "\n".join(f"{name} = {place}" for name, place in places.items())
        for group, places in project["entry-points"].items()
    ]
    (record / "entry_points.txt").write_text("\n".join(lines) + "\n")
    return folder
