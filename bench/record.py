"""Rows to CSV, and all CSV files of a benchmark to one page of Markdown tables.

A CSV file begins with lines ``# key: value`` (command, machine, versions, date, remarks), then
comes the row of column names.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from bench.machine import header
from simplifier.progress import TellCount

Row = Mapping[str, object]


@dataclass(frozen=True)
class Table:
    """What a CSV file holds; all cells are text."""

    remarks: tuple[str, ...]
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def write_table(path: Path, rows: Sequence[Row], command: str, *remarks: str) -> None:
    """Write at least one row; columns in the order in which rows first name them."""
    columns = list(dict.fromkeys(column for row in rows for column in row))
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        file.writelines(f"# {line}\n" for line in (*header(command), *remarks))
        writer = csv.DictWriter(file, columns, restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows({name: _cell(value) for name, value in row.items()} for row in rows)


def read_table(path: Path) -> Table:
    """What :func:`write_table` wrote."""
    return table_of(path.read_text(encoding="utf-8"))


def table_of(text: str) -> Table:
    """The table that such a file holds."""
    lines = text.splitlines(keepends=True)
    remarks = tuple(line[2:].rstrip("\n") for line in lines if line.startswith("# "))
    names, *rows = csv.reader(lines[len(remarks) :])
    return Table(remarks, tuple(names), tuple(tuple(row) for row in rows))


def write_page(folder: Path, prefix: str, names: Iterable[str]) -> Path:
    """Write ``folder/prefix.md`` from the ``prefix_name.csv`` that are there, pictures included."""
    parts = [f"# bench.{prefix}"]
    for name in names:
        path = folder / f"{prefix}_{name}.csv"
        if not path.exists():
            continue
        parts += [f"## {name.replace('_', ' ')}"]
        parts += [markdown(read_table(path))]
        if path.with_suffix(".png").exists():
            parts += [f"![{path.stem}]({path.stem}.png)"]
    page = folder / f"{prefix}.md"
    page.write_text("\n\n".join(parts) + "\n", encoding="utf-8")
    return page


def markdown(table: Table) -> str:
    """The remarks as a list, then the rows; numbers are set to the right."""
    numeric = [all(_is_number(row[i]) for row in table.rows) for i in range(len(table.columns))]
    rules = ["---:" if right else "---" for right in numeric]
    lines = [table.columns, rules, *table.rows]
    body = "\n".join("| " + " | ".join(line) + " |" for line in lines)
    return "\n".join(f"- {remark}" for remark in table.remarks) + "\n\n" + body


def told(row: Row) -> str:
    """A row as one line for a reader who waits: what is empty is left out."""
    return ", ".join(f"{name} {_cell(value)}" for name, value in row.items() if _cell(value))


def tell_parts(what: str) -> TellCount:
    """Prints each tenth part of the work; what the first call finds done is no news."""
    known: set[int] = set()

    def tell(done: int, total: int) -> None:
        part = 10 * done // max(total, 1)
        if known and part not in known:
            print(f"{what} {done} of {total}", flush=True)
        known.add(part)

    return tell


def _is_number(text: str) -> bool:
    try:
        float(text or "0")
    except ValueError:
        return False
    return True


def _cell(value: object) -> str:
    """Four significant digits for a float, or all before the point; nothing for None."""
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.0f}" if abs(value) >= 1000.0 else f"{value:.4g}"
    return str(value)
