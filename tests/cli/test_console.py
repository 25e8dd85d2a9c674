"""What the command line shows, apart from any run."""

from __future__ import annotations

import io
import json
import sys
import time

from simplifier.cli.console import (
    Printed,
    accept_any_text,
    count_bar,
    print_closing,
    print_json,
    print_line,
    print_report,
    print_table,
    printing,
    progress_bar,
    run_bar,
)
from simplifier.cli.progress_lines import EVERY, ProgressLines
from simplifier.progress import STAGES, Progress

REPORT = {
    "verdict": {"word": "good", "reason": "it hides most of it", "next": None},
    "triangles": 53,
    "precision": 0.9987,
    "recall": 0.8354,
    "worst_view": {"recall": 0.5, "precision": 0.75},
    "overhang": {"share": 0.0348, "stick_out": 0.0789, "worst_view": {"share": 0.04701}},
    "front": {"share": 0.0245, "worst_view": {"share": 0.05678}},
    "occlusion_measure": {"ratio": 0.9},
    "error_bound": 0.0537,
    "deviation": 0.03,
    "input": {"triangles": 1_234_567},
    "solid": {"resolution": [64, 32, 16]},
    "timings": {"load": 0.0125, "cut": 1.5, "surface": 0.0},
    "warnings": ["mind the gap"],
}


def test_the_table_has_the_headline_figures(capsys):
    print_report(REPORT, "castle.obj")
    shown = capsys.readouterr()
    for words in (
        "castle.obj", "1,234,567 -> 53", "99.87 %", "83.54 %", "recall 50.00 %, precision 75.00 %",
        "3.48 %, at worst 4.71 %", "0.07890", "2.45 %, at worst 5.68 %", "90.00 %", "0.05370",
        "64 x 32 x 16 voxels", "1.51 s",
    ):  # fmt: skip
        assert words in shown.out
    assert "12 ms" not in shown.out
    assert shown.out.endswith("\ngood: it hides most of it\n")
    assert shown.err == "warning: mind the gap\n"


def test_the_time_of_each_stage_is_told_when_asked_for(capsys):
    print_report(REPORT, "castle.obj", verbose=True)
    shown = capsys.readouterr().out
    for words in ("time: load", "12 ms", "time: cut", "1.50 s"):
        assert words in shown
    assert "surface" not in shown


def test_the_last_three_lines_tell_what_was_made_how_good_it_is_and_what_to_do_next(capsys):
    print_report(REPORT, "castle.obj", made="made: o.glb, 53 triangles", then="open it")
    assert capsys.readouterr().out.splitlines()[-3:] == [
        "made: o.glb, 53 triangles", "good: it hides most of it", "next: open it",
    ]  # fmt: skip
    print_closing("o.glb", "good enough", "open it")
    assert capsys.readouterr().out == "made: o.glb\ngood enough\nnext: open it\n"


def test_nothing_but_warnings_where_nothing_else_is_wanted(capsys):
    with printing(Printed.of(quiet=True, as_json=False)):
        print_report(REPORT, "castle.obj", made="made: o.glb", then="open it")
        print_json(REPORT)
        print_table("levels", ("a", "b"), [("1", "2")])
    shown = capsys.readouterr()
    assert (shown.out, shown.err) == ("", "warning: mind the gap\n")


def test_standard_output_is_json_and_nothing_else(capsys):
    with printing(Printed.of(quiet=True, as_json=True)):
        print_report({**REPORT, "levels": [LEVEL], "left_out": []}, "castle.obj", made="made: o")
        print_json(REPORT)
    assert json.loads(capsys.readouterr().out) == REPORT
    print_json(REPORT)
    assert capsys.readouterr().out == ""


def test_a_verdict_that_is_not_good_is_a_warning(capsys):
    weak = {"word": "weak", "reason": "it hides 1.55 %", "next": "occluder simplify a -o b"}
    print_report({**REPORT, "verdict": weak}, "castle.obj")
    shown = capsys.readouterr()
    assert "weak" in shown.out.splitlines()[2]
    assert shown.err == (
        "warning: mind the gap\nwarning: weak: it hides 1.55 %\ntry: occluder simplify a -o b\n"
    )


LEVEL = {
    "level": 0, "triangles": 53, "recall": 0.8354, "precision": 0.9987, "error_bound": 0.0537,
    "deviation": 0.03, "resolution": 64, "switch_distance": 50.2, "file": "castle_lod0.glb",
    "overhang": {"share": 0.0234}, "verdict": {"word": "good"},
}  # fmt: skip


def test_levels_and_what_was_left_out(capsys):
    coarse = {
        **LEVEL, "level": 1, "triangles": 8, "error_bound": None, "switch_distance": None,
        "verdict": {"word": "unusable"},
    }  # fmt: skip
    left_out = [{"resolution": 1024, "reason": "it hides nothing"}]
    print_report({**REPORT, "levels": [LEVEL, coarse], "left_out": left_out}, "castle.obj")
    shown = capsys.readouterr().out
    assert "levels of detail" in shown
    assert " any " in shown
    assert "unusable" in shown
    assert shown.count("2.34 %") == 2
    assert "\u2026" not in shown  # every cell has room on a narrow terminal
    assert shown.count("promise") == 2  # of its error, and so of where it is used
    assert "left out: 1,024 voxels: it hides nothing\n" in shown


def test_no_promise_is_told(capsys):
    print_report({**REPORT, "error_bound": None, "warnings": []}, "x")
    shown = capsys.readouterr()
    assert "no promise" in shown.out
    assert shown.err == ""


# Escape sequences, markup, line ends, text that runs backwards, bytes that are no text.
HOSTILE = "\x1b[31mred\x1b]0;title\x07 [bold]x[/bold]\r\n[/]\u202efdp.exe\udcff\x00"


def test_nothing_that_a_terminal_obeys_is_printed(capsys):
    print_report(REPORT, HOSTILE)
    print_line(f"error: {HOSTILE}: no such file")
    shown = capsys.readouterr()
    for text in (shown.out, shown.err):
        assert not set(text) & set("\x1b\x07\r\u202e\x00\udcff")
        assert "[bold]x[/bold]" in text
        assert "\\x1b[31mred" in text
    assert shown.err.count("\n") == 2  # the warning and the line
    text = "\\x1b[31mred\\x1b]0;title\\x07 [bold]x[/bold] [/]\\u202efdp.exe\\udcff\\x00"
    assert f"error: {text}: no such file\n" in shown.err


def test_plain_text_of_any_language_stays(capsys):
    print_line("error: schloß 城.obj: es fehlt")
    assert capsys.readouterr().err == "error: schloß 城.obj: es fehlt\n"


def test_an_encoding_without_the_letters(monkeypatch):
    raw = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(raw, encoding="ascii"))
    accept_any_text()
    print_report(REPORT, "schloß.obj")
    sys.stdout.flush()
    assert b"schlo\\xdf.obj" in raw.getvalue()
    assert b"83.54 %" in raw.getvalue()


def test_no_bar_where_there_is_no_terminal(capsys):
    with progress_bar() as listener:
        for stage in STAGES:
            listener(Progress(stage, 0.0, 0.5))
            listener(Progress(stage, 1.0, 0.5))
    shown = capsys.readouterr()
    assert (shown.out, shown.err) == ("", "")


def test_lines_now_and_then_where_there_is_no_terminal(capsys):
    now = [100.0]
    lines = ProgressLines(lambda: now[0])
    for second in range(12):
        now[0] = 100.0 + second
        lines.tell(lambda: f"step {second}")  # noqa: B023
    assert EVERY == 5.0
    assert capsys.readouterr().err == "progress: step 5, 5 s\nprogress: step 10, 10 s\n"


def test_every_bar_has_lines_in_its_place(capsys, monkeypatch):
    monkeypatch.setattr("simplifier.cli.progress_lines.EVERY", 0.0)
    with progress_bar() as listener:
        listener(Progress("cut", 0.5, 1.2, None, 2, 4))
    with run_bar(3) as tell:
        tell(1, "castle\x1b.obj")
    with count_bar("cells") as tell:
        tell(1200, 5000)
    assert capsys.readouterr().err == (
        "progress: 3/4 choosing polygons  50%, 0 s\nprogress: 1 of 3: castle\\x1b.obj, 0 s\n"
        "progress: cells: 1,200 of 5,000, 0 s\n"
    )
    with printing(Printed.NOTHING), progress_bar() as listener, count_bar("cells") as tell:
        listener(Progress("cut", 0.5, 1.2))
        tell(1, 2)
    assert capsys.readouterr().err == ""


def test_the_bar_tells_which_level_it_is(monkeypatch):
    terminal = as_terminal(monkeypatch)
    with progress_bar() as listener:
        listener(Progress("cut", 0.5, 1.2, None, 2, 4))
    assert "3/4 choosing polygons  50%" in terminal.getvalue()


def as_terminal(monkeypatch):
    """Standard error, as if it were one."""
    stream = io.StringIO()
    stream.isatty = lambda: True
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setenv("TERM", "xterm")
    return stream


def test_the_bar_knows_every_stage(monkeypatch):
    terminal = as_terminal(monkeypatch)
    with progress_bar() as listener:
        for stage in STAGES:
            listener(Progress(stage, 0.5, 0.5))
        listener(Progress("refine", 0.62, 1.2, 0.9134))
    shown = terminal.getvalue()
    assert "refining triangles  62%" in shown
    assert "measure 91.3 %" in shown
    assert "\x1b[2K" in shown  # it wipes itself away


def test_a_bar_within_another_has_the_line_to_itself(monkeypatch):
    terminal = as_terminal(monkeypatch)
    with progress_bar() as listener:
        listener(Progress("load", 0.5, 0.1))
        with count_bar("compiling, once") as tell:
            begin = terminal.tell()
            for done in range(4):
                tell(done, 3)
                time.sleep(0.12)  # bars draw themselves ten times a second
            within = terminal.getvalue()[begin:]
        listener(Progress("cut", 0.5, 0.2))
    assert "compiling, once" in within
    assert "reading the mesh" not in within
    assert "choosing polygons" in terminal.getvalue()
