"""Numbers from text: every word as Python's own float reads it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.kernels import text as kernels


def read(data: bytes) -> tuple[list[float | bytes], list[int]]:
    """Values, with the word itself where the kernel left it, and the first word of each line."""
    text = np.frombuffer(data, dtype=np.uint8)
    words, lines = kernels.count_words(text, 0)
    values, hard = np.empty(words), np.empty(words, dtype=np.int64)
    firsts = np.empty(lines, dtype=np.int64)
    kernels.read_words(text, 0, values, hard, firsts)
    found = [
        value if place < 0 else data[place:].split()[0]
        for value, place in zip(values.tolist(), hard.tolist(), strict=True)
    ]
    return found, firsts.tolist()


EASY = [
    *["0", "-0", "+1", "1.", ".5", "-.5e1", "1e22", "1E-22", "9007199254740992", "0.1", "1e+05"],
    *["123456.789", "00012.50", "-7.25E+2", "0.0000000000000000000001"],
]
HARD = [
    *["9007199254740993", "1e23", "1e-23", "0.12345678901234567", "nan", "inf", "1e", "e5", "-"],
    *[".", "1.2.3", "1-2", "--1", "1e+", "0x1", "1_0", "1e99999999999999999999", "1\0", "1/2"],
]


@pytest.mark.parametrize("word", EASY)
def test_easy_numbers_are_exact(word: str) -> None:
    (value,), _ = read(word.encode())
    assert isinstance(value, float)
    assert np.float64(value).tobytes() == np.float64(float(word)).tobytes()


@pytest.mark.parametrize("word", HARD)
def test_hard_words_are_left_to_the_caller(word: str) -> None:
    found, _ = read(b"5 " + word.encode() + b" 6")
    assert found == [5.0, word.encode(), 6.0]


@settings(max_examples=150, deadline=None)
@given(
    st.one_of(
        st.floats().map(repr),
        st.floats(-1e6, 1e6).map(lambda value: f"{value:.6f}"),
        st.floats(-1e6, 1e6).map(lambda value: f"{value:.9e}"),
        st.from_regex(r"[+-]?[0-9]{0,18}\.?[0-9]{0,18}(e[+-]?[0-9]{1,3})?", fullmatch=True),
    )
)
def test_a_number_is_python_s_or_left_over(word: str) -> None:
    (value,), _ = read(word.encode()) if word else ((0.0,), [])
    if isinstance(value, float) and word:
        assert np.float64(value).tobytes() == np.float64(float(word)).tobytes()


@settings(max_examples=150, deadline=None)
@given(st.text(alphabet="1 \t\n\r\\#a", max_size=40))
def test_lines_and_words_match_a_plain_splitter(content: str) -> None:
    expected_words: list[str] = []
    expected_firsts: list[int] = []
    for line in plain_lines(content):
        if line:
            expected_firsts.append(len(expected_words))
            expected_words += line
    found, firsts = read_words_only(content.encode())
    assert firsts == expected_firsts
    assert found == [word.encode() for word in expected_words]


def read_words_only(data: bytes) -> tuple[list[bytes], list[int]]:
    """The words themselves, whether they are numbers or not: each 1 is made hard to read."""
    data = data.replace(b"1", b"x")
    text = np.frombuffer(data, dtype=np.uint8)
    words, lines = kernels.count_words(text, 0)
    values, hard = np.empty(words), np.empty(words, dtype=np.int64)
    firsts = np.empty(lines, dtype=np.int64)
    kernels.read_words(text, 0, values, hard, firsts)
    found = []
    for place in hard.tolist():
        end = place
        while end < len(data) and data[end : end + 1] not in (b" ", b"\t", b"\n", b"\r"):
            if data[end : end + 1] == b"\\" and data[end + 1 : end + 2] in (b"\n", b"\r"):
                break
            end += 1
        found.append(data[place:end].replace(b"x", b"1"))
    return found, firsts.tolist()


def plain_lines(content: str) -> list[list[str]]:
    """Character by character: comments end a line's words, a backslash before its end joins it."""
    lines: list[list[str]] = [[]]
    word, comment, i = "", False, 0
    while i < len(content):
        c = content[i]
        newline = "\r\n" if content[i : i + 2] == "\r\n" else c if c in "\r\n" else ""
        joined = c == "\\" and content[i + 1 : i + 2] in ("\r", "\n") and not comment
        if newline or joined or c in " \t":
            if word:
                lines[-1].append(word)
            word = ""
        elif comment or (c == "#" and not word):
            comment = True
        else:
            word += c
        if newline:
            lines.append([])
            comment = False
        i += len(newline) or 1
        if joined:
            i += 2 if content[i : i + 2] == "\r\n" else 1
    if word:
        lines[-1].append(word)
    return lines


def test_statements_are_found_in_either_case_and_counted() -> None:
    data = b"v 1 2\nVERTEX 3 4\nvertex 5 6 7 # 8\n vertex\t-1 \\\n 2\nvertexes 1 2\n# vertex 1 2\n"
    text = np.frombuffer(data, dtype=np.uint8)
    keyword = np.frombuffer(b"vertex", dtype=np.uint8)
    count = kernels.count_statements(text, keyword)
    values, hard = np.empty((count, 2)), np.empty((count, 2), dtype=np.int64)
    assert kernels.read_statements(text, keyword, values, hard) == -1
    assert values.tolist() == [[3, 4], [5, 6], [-1, 2]]
    assert (hard == -1).all()


def test_a_short_statement_is_pointed_at() -> None:
    data = b"v 1 2\n  v 1\n"
    text, keyword = (np.frombuffer(part, dtype=np.uint8) for part in (data, b"v"))
    values, hard = np.empty((2, 2)), np.empty((2, 2), dtype=np.int64)
    assert kernels.read_statements(text, keyword, values, hard) == 8
