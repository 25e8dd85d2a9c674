"""Builds of scenes into folders, and a program that is one, to be killed."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from simplifier.hierarchy.scene_build import build_occluders
from simplifier.hierarchy.scene_file import occluder_store, read_earlier, write_manifest
from simplifier.options.scene import SceneOptions
from tests.hierarchy.scenes import QUICK, street


def built(scene, folder, options=QUICK, **more):
    """As the command line does it: the build, with everything written."""
    known = read_earlier(folder).summaries
    build = build_occluders(scene, options, occluder_store(folder), known, **more)
    write_manifest(folder, scene, options, build)
    return build


def files(folder):
    """Bytes by path."""
    found = (path for path in Path(folder).rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in found}


SLOW = SceneOptions(budget=8, resolution=16, width=4, moves=2500, pixel_error=100.0)
"""Long enough to be killed in the middle."""


def main():
    """``python -m tests.hierarchy.builds FOLDER``: says how many are there after each."""
    built(
        street(20), Path(sys.argv[1]), SLOW, tell=lambda done, total: print(done, total, flush=True)
    )


if __name__ == "__main__":
    assert os.environ["OCCLUDER_THREADS"]
    main()
