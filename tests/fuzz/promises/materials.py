"""Materials of an OBJ: whatever their file says, triangles are opaque or left out with a word."""

from __future__ import annotations

from pathlib import Path

from simplifier.io.load import load
from tests.fuzz.promises import promise


def check_material_file(path: Path) -> None:
    """Raises ``OccluderError`` where nothing opaque is left."""
    whole = load(path, transparent="keep")
    promise(not whole.omitted, "what is kept is not left out")
    opaque = load(path)
    left_out = sum(one.triangles for one in opaque.omitted)
    promise(all(one.see_through for one in opaque.omitted), "only what is see-through is left out")
    promise(len(opaque.faces) + left_out == len(whole.faces), "all triangles are accounted for")
