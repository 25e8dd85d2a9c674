"""The Godot import script without Godot: its grammar, and the command as the script calls it."""

from __future__ import annotations

import re
import struct

import numpy as np
import pytest

from tests.acceptance.command import ROOT, occluder

SCRIPT = ROOT / "integrations" / "godot" / "occluder_import.gd"
WEDGE = np.array([[0, 0, 0], [3, 0, 0], [0, 2, 0], [0, 0, 1]]) + np.array([0.5, 0.25, -4])
CLOCKWISE = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])


def test_it_is_gdscript_without_a_lint():
    pytest.importorskip("gdtoolkit", reason="GDScript's parser gdtoolkit is not installed")
    from gdtoolkit.linter import lint_code
    from gdtoolkit.parser import parser

    code = SCRIPT.read_text()
    parser.parse(code)
    assert lint_code(code) == []


def test_the_resource_lies_where_the_stl_that_the_script_writes_does(tmp_path):
    """The same layout: no normal, corners turned over, as ``_write_stl`` has it."""
    triangles = WEDGE[CLOCKWISE]
    rows = [struct.pack("<12fH", 0, 0, 0, *corners[[0, 2, 1]].ravel(), 0) for corners in triangles]
    mesh, made = tmp_path / "mesh.stl", tmp_path / "made.tres"
    mesh.write_bytes(bytes(80) + struct.pack("<I", len(rows)) + b"".join(rows))
    done = occluder("simplify", mesh, "-o", made, "--budget", "8")
    assert done.returncode == 0, done.stderr
    text = made.read_text()
    assert text.startswith('[gd_resource type="ArrayOccluder3D"')
    (packed,) = re.findall(r"vertices = PackedVector3Array\((.*)\)", text)
    vertices = np.array(packed.split(","), dtype=float).reshape(-1, 3)
    distances = np.linalg.norm(vertices[:, None] - WEDGE[None], axis=2)
    np.testing.assert_allclose(distances.min(axis=0), 0.0, atol=1e-6)
    np.testing.assert_allclose(distances.min(axis=1), 0.0, atol=1e-6)
