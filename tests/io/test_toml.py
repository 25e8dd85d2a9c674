"""A TOML file's values, and the lines that they come from."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.errors import OptionError, TomlError
from simplifier.io.toml import Table, parse_toml, read_toml

_TEXT = """\
# a comment with [brackets], "quotes' and '''more
top = 1
multi = \"\"\"
[no header]
a = 1 \"\"\"
raw = '''x
]''' # over
"quoted.key" = [ # a list
  1, # one
  { deep = "]" },
]
dotted.name.here = true

[plain]
key = "# no comment"
[plain.sub]
key = 2

[[box]]
name = "first"
[box.extra]
size = 1

[[box]]

name = "second"
  [[box.part]]
  id = 1
  [[box.part]]
  id = 2
  [box.extra]
  size = 2
"""


def _table(text: str) -> Table:
    return parse_toml(text.encode(), "f.toml")


def _plain(value: Any) -> Any:
    if isinstance(value, Table):
        return {key: _plain(one) for key, one in value.items()}
    return [_plain(one) for one in value] if isinstance(value, list) else value


def test_values_are_those_of_the_standard_reader() -> None:
    assert _plain(_table(_TEXT)) == tomllib.loads(_TEXT)


@pytest.mark.parametrize(
    ("keys", "line"),
    [
        (("top",), 2),
        (("multi",), 3),
        (("raw",), 6),
        (("quoted.key",), 8),
        (("quoted.key", 1, "deep"), 8),
        (("dotted",), 12),
        (("dotted", "name", "here"), 12),
        (("plain",), 14),
        (("plain", "key"), 15),
        (("plain", "sub"), 16),
        (("plain", "sub", "key"), 17),
        (("box",), 19),
        (("box", 0), 19),
        (("box", 0, "name"), 20),
        (("box", 0, "extra"), 21),
        (("box", 0, "extra", "size"), 22),
        (("box", 1), 24),
        (("box", 1, "name"), 26),
        (("box", 1, "part", 0, "id"), 28),
        (("box", 1, "part", 1, "id"), 30),
        (("box", 1, "extra", "size"), 32),
        (("box", 1, "missing"), 24),
        (("missing",), 1),
    ],
)
def test_each_key_knows_the_line_of_its_statement(keys: tuple[str | int, ...], line: int) -> None:
    assert _table(_TEXT).line(*keys) == line


def test_tables_inside_know_their_own_lines() -> None:
    second = _table(_TEXT)["box"][1]
    assert (second.line(), second.line("name"), second["extra"].line("size")) == (24, 26, 32)
    assert second["part"][1].where("id") == "f.toml:30"


def test_lines_end_as_they_do_on_windows_and_a_byte_order_mark_is_passed_over() -> None:
    text = b"\xef\xbb\xbf" + _TEXT.replace("\n", "\r\n").encode()
    table = parse_toml(text, "f.toml")
    assert table.line("box", 1, "name") == 26
    assert _plain(table) == tomllib.loads(_TEXT)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("a = 1\nb = \n", 2),
        ("a = 1\nb = 2\na = 3\n", 3),
        ("[t]\n[t]\n", 2),
        ("a = 1\nb = [1,\n2\n", 3),
        ("nonsense", 1),
        ("a = '\n'\n", 1),
    ],
)
def test_what_is_no_toml_is_refused_with_its_line(text: str, line: int) -> None:
    with pytest.raises(TomlError, match=rf"^f\.toml:{line}: this is no TOML: \S") as refused:
        _table(text)
    assert "(at" not in str(refused.value)


def test_bytes_that_are_no_utf8_are_refused_with_their_line() -> None:
    with pytest.raises(TomlError, match=r"^f\.toml:3: is not UTF-8; save it as UTF-8$"):
        parse_toml(b"a = 1\n\nb = '\xff'\n", "f.toml")


def test_deep_nesting_is_refused() -> None:
    with pytest.raises(TomlError, match="nested too deeply"):
        _table("a = " + "[" * 50_000)


def test_a_missing_file_is_refused_in_the_kind_that_the_caller_names(tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="there is no such file"):
        read_toml(tmp_path / "none.toml", error=OptionError)


def test_a_file_is_named_in_messages_as_it_was_given(tmp_path: Path) -> None:
    path = tmp_path / "x.toml"
    path.write_text("\na = 1\n")
    assert read_toml(path).where("a") == f"{path}:2"


_SCALARS = st.one_of(
    st.integers(-9, 9).map(str),
    st.sampled_from(["'#]'", '"[\\""', '"""\n[x]\n"""', "'''a\n'''", "[1,\n[2]]", "{ a = '}' }"]),
)


@given(st.lists(st.tuples(st.sampled_from(["", "# ]", "\n"]), _SCALARS), max_size=12))
def test_every_key_of_a_made_up_file_is_found_where_it_was_written(
    rows: list[tuple[str, str]],
) -> None:
    text, expected = "", {}
    for index, (before, value) in enumerate(rows):
        text += before + "\n"
        expected[f"k{index}"] = text.count("\n") + 1
        text += f"k{index} = {value}\n"
    table = _table(text)
    assert {key: table.line(key) for key in table} == expected


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("x = 1\n" + "a." * 3000 + "b = 1", 2),
        ("'a'." * 64 + "b = 1", 1),
        ("\n\n[" + "a . " * 200_000 + "b]", 3),
        ("x = {" + '"a".' * 64 + "b = 1}", 1),
        ('x = """\n' + "a.b" * 100 + '"""\n' + "a." * 64 + "b = 1", 3),
    ],
)
def test_a_key_of_many_parts_is_refused_before_it_is_read(text: str, line: int) -> None:
    """200,000 parts kept the standard reader for a minute, and 3,000 ended in a RecursionError."""
    with pytest.raises(TomlError, match=rf"^f\.toml:{line}: has a key of more than 64 parts"):
        _table(text)


def test_dots_elsewhere_are_no_parts() -> None:
    dots = "a." * 100
    text = f"# {dots}\nx = '{dots}'\ny = [{'1.5, ' * 100}]\n" + "a." * 63 + "b = 1\n"
    assert _table(text).line("y") == 3


def test_a_number_of_thousands_of_digits_is_refused() -> None:
    with pytest.raises(TomlError, match="has a number of thousands of digits"):
        _table("a = " + "1" * 5000)


def test_tables_that_nest_by_many_long_keys_are_refused() -> None:
    with pytest.raises(TomlError, match="nested too deeply"):
        _table("a = " + ("{" + "a." * 60 + "a = ") * 60 + "1" + "}" * 60)
