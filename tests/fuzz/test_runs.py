"""Runs from the command line: what they print, what they leave, and how a failure is seen again."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.fuzz import __main__ as command
from tests.fuzz import replay
from tests.fuzz.corpus import CORPUS
from tests.fuzz.findings import record
from tests.fuzz.misbehaving import misbehaving
from tests.fuzz.tally import Tally
from tests.fuzz.watched import Watched


@pytest.fixture
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where a run may leave its files."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("OCCLUDER_THREADS", "1")
    return tmp_path


def test_a_short_run_ends_with_a_table(elsewhere: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["--seconds", "1", "--seed", "3", "off"]) == 0
    printed = capsys.readouterr().out
    assert "1 s, seed 3, plain engine" in printed
    row = printed.splitlines()[-1]
    assert row.startswith("| off | ")
    assert row.endswith(" | 0 |")


@pytest.mark.parametrize("arguments", [["nothing"], ["--engine", "other"], ["--seconds", "x"]])
def test_wrong_arguments_are_told(arguments: list[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        command.main(arguments)


def test_a_failure_is_made_small_and_written_with_its_command(elsewhere: Path) -> None:
    with Watched(find=misbehaving) as watched:
        outcome = watched.tried("off", b"break")
        finding = record("off", b"break", outcome, watched)
        tally = Tally("off")
        tally.count(b"break", outcome, watched)
        tally.count(b"break", outcome, watched)
    assert finding.path.read_bytes() == b"break"
    told = finding.path.with_suffix(".txt").read_text()
    assert f"python -m tests.fuzz.replay {finding.path}" in told
    assert "Traceback" in told
    assert (tally.cases, len(tally.findings)) == (2, 1)


def test_an_input_is_tried_again(elsewhere: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert replay.main([str(CORPUS / "off" / "colours")]) == 0
    assert capsys.readouterr().out == "taken\n"
    Path("other").write_bytes(b"OFF\n")
    assert replay.main(["--target", "off", "other"]) == 0
    assert capsys.readouterr().out == "UnreadableMeshError\n"
    with pytest.raises(SystemExit, match="2"):
        replay.main(["other"])
