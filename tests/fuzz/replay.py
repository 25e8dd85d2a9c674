"""One input once more, in this process: ``python -m tests.fuzz.replay [--target NAME] FILE``.

The target is the name of the folder that the file is in.  Prints what came of it, and the traceback
of a fault; exit status 1 for one.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import traceback
from collections.abc import Sequence
from pathlib import Path

from tests.fuzz.targets import TARGETS


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz.replay", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("file", type=Path)
    parser.add_argument("--target", choices=TARGETS, help="by default the name of its folder")
    given = parser.parse_args(arguments)
    name = given.target or given.file.resolve().parent.name
    if name not in TARGETS:
        parser.error(f"'{name}' is no target; choose one of {', '.join(TARGETS)} by --target")
    os.environ["OCCLUDER_THREADS"] = "1"
    with tempfile.TemporaryDirectory() as folder:
        try:
            verdict = TARGETS[name].verdict(given.file.read_bytes(), Path(folder))
        except Exception:
            traceback.print_exc()
            return 1
    print(verdict)
    return 0


if __name__ == "__main__":
    sys.exit(main())
