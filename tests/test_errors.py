"""Messages can be shown anywhere, whatever names a damaged file has."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from simplifier.errors import OccluderError, printable


@given(st.text(st.characters(exclude_categories=())))
def test_any_text_becomes_one_line_that_can_be_written(text):
    shown = printable(text)
    assert shown.isprintable()
    shown.encode()
    assert (shown == text) == text.isprintable()


def test_a_terminal_obeys_no_message():
    error = OccluderError("no '\x1b[2J'", where="a\ud800.ply", remedy="é…\n")
    assert str(error) == r"a\ud800.ply: no '\x1b[2J'; é…\n"
    assert (error.what, error.where, error.remedy) == (r"no '\x1b[2J'", r"a\ud800.ply", r"é…\n")
