"""Options as they are typed: text by name, read by the same tables as requests are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import Any

from service.dashboard.jobs.words import sentence
from service.errors import InvalidOptionsError
from service.schemas.options import OptionTable
from simplifier import OptionField

Typed = Mapping[str, str]
"""Text by the name of its option, "true" and "false" for yes and no; empty: it is not given."""


@dataclass(frozen=True)
class ReadForm:
    """What a form says.

    ``given``   its options as a query has them: those that differ from their default.
    ``resolved``  all options, empty where there are faults.
    ``faults``  what is wrong, a sentence or two, by option; one that no option has stands for all.
    """

    given: tuple[tuple[str, str], ...]
    resolved: Mapping[str, Any]
    faults: Mapping[str, str]


def read_typed(table: OptionTable, typed: Typed) -> ReadForm:
    """Read what is not left empty."""
    defaults = {one.name: typed_value(one, one.default) for one in table.fields}
    given = tuple(
        (name, text.strip())
        for name, text in typed.items()
        if text.strip() and text.strip() != defaults.get(name)
    )
    try:
        return ReadForm(given, table.read(table.from_query(given)), {})
    except InvalidOptionsError as error:
        faults = {
            one.field: f"{sentence(one.detail)} {sentence(one.remedy)}".strip()
            for one in error.errors
        }
        return ReadForm(given, {}, faults)


def typed_value(field: OptionField, value: Any) -> str:
    """A value as it would be typed."""
    if value is None:
        return ""
    match field.kind:
        case "flag":
            return "true" if value else "false"
        case "lengths" | "wholes" | "numbers":
            return ",".join(f"{one:.12g}" for one in value)
        case "number":
            return f"{value:.12g}"
        case _:
            return str(value)


def typed_options(table: OptionTable, options: Mapping[str, Any]) -> dict[str, str]:
    """The options of a job, as far as there still are such."""
    return {
        one.name: typed_value(one, options[one.name]) for one in table.fields if one.name in options
    }


def remembered_options(table: OptionTable, told: object) -> dict[str, str]:
    """What a browser has kept, of which anything may be wrong."""
    if not isinstance(told, dict):
        return {}
    names = {one.name for one in table.fields}
    return {name: text for name, text in told.items() if name in names and isinstance(text, str)}


def asset_names(typed: str, files: Sequence[str]) -> list[str]:
    """Whose run each file becomes; empty for none.

    ``files``  names, or paths within a folder that was dropped.

    Several files are assets of their own below the name that was typed, for else they would be one
    history of different things.
    """
    name = typed.strip()
    if not name or len(files) == 1:
        return [name] * len(files)
    return [f"{name.rstrip('/')}/{PurePosixPath(file).with_suffix('')}" for file in files]
