"""The curls of the docs, run as they stand there."""

from __future__ import annotations

import re
import shutil
import subprocess

import pytest

import simplifier
from tests import solids
from tests.acceptance.command import ROOT

needs_curl = pytest.mark.skipif(shutil.which("curl") is None, reason="there is no curl")


def curl(page, server, folder, more=""):
    """Run the curl of a page, with ``more`` in its query, on a box called castle.glb.

    How it ended; what it was to fetch is castle_occluder.glb.
    """
    blocks = re.findall(r"```sh\n(.*?)```", (ROOT / page).read_text(), re.DOTALL)
    block = next(one for one in blocks if "castle_occluder.glb" in one and "curl" in one)
    words = block[block.index("curl") :].replace("http://127.0.0.1:8000", server.address)
    words = words.replace("/v1/occluders?", f"/v1/occluders?{more}")
    mesh = solids.box()
    simplifier.save(simplifier.Occluder(mesh.vertices, mesh.faces), folder / "castle.glb")
    return subprocess.run(["bash", "-c", words], cwd=folder, capture_output=True, text=True)


def curled(page, server, folder, more=""):
    """What the curl of a page has fetched."""
    done = curl(page, server, folder, more)
    assert done.returncode == 0, done.stderr
    return simplifier.load(folder / "castle_occluder.glb")
