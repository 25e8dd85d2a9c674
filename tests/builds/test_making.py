"""One asset made, by a maker that takes no time."""

from __future__ import annotations

import pytest

from simplifier.builds.making import AssetJob, Target, make_asset
from simplifier.builds.outputs import Output
from simplifier.options.simplify import SimplifyOptions
from tests.builds.quick import TRIANGLE, QuickMaker


def test_a_second_attempt_is_made_where_the_first_one_ended(tmp_path):
    mesh = tmp_path / "a.obj"
    mesh.write_bytes(TRIANGLE)
    draft = tmp_path / "scratch" / "0" / "a_occluder.glb"
    target = Target(draft, tmp_path / draft.name, Output(draft.name))
    job = AssetJob(mesh, SimplifyOptions(), (target,))

    def ended(job):
        draft.write_bytes(b"half")
        raise SystemExit

    with pytest.raises(SystemExit):
        make_asset(ended, job)
    assert make_asset(QuickMaker(), job).figures.recall == 0.9
    assert draft.read_bytes() == TRIANGLE
