"""Machine code that a wheel or an image brings along, for all kinds of processors that may run it.

``python -m simplifier.kernels.compiled.shipping`` adds it to the package where that is installed.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path

from simplifier.kernels.compiled.code_files import SHIPPED, kernel_files
from simplifier.kernels.compiled.library import build
from simplifier.kernels.compiled.processors import Kind, kinds_here
from simplifier.progress import shown_compiling


def ship(folder: Path, names: Sequence[str], kinds: Sequence[Kind]) -> None:
    """Compile kernel files for kinds of processors, which need not be here, into a folder.

    What the folder held goes.  Raises :class:`~simplifier.kernels.compiled.library.BuildError`.
    """
    shutil.rmtree(folder, ignore_errors=True)
    for kind in kinds:
        with shown_compiling() as tell:
            build(names, tell, folder, kind.processor)


if __name__ == "__main__":
    ship(SHIPPED, kernel_files(), kinds_here())
