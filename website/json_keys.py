"""The keys of the JSON files: a page a schema of ``docs/``."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from website.repository import DOCS, ROOT
from website.schema_words import Schema, kind_of
from website.tables import page, table

FOLDER = "reference/keys"
_ENDING = ".schema.json"


def pages() -> dict[str, str]:
    """Each schema's page by its place."""
    made = {}
    for file in sorted((ROOT / DOCS).glob(f"*{_ENDING}")):
        schema = json.loads(file.read_text(encoding="utf-8"))
        name = file.name.removesuffix(_ENDING)
        made[f"{FOLDER}/{name}.md"] = _page(schema, f"../../{file.name}")
    return made


def _page(schema: Any, file: str) -> str:
    return page(
        f"# {schema['title']}",
        schema.get("description", ""),
        f"The [schema]({file}) is what programs check a file by.",
        table(("key", "kind", "what it is"), _rows(schema, schema, "")),
    )


def _rows(schema: Any, whole: Any, above: str) -> Iterator[tuple[str, str, str]]:
    """The keys of an object and, below each, those of what it holds."""
    needed = schema.get("required", ())
    for name, one in schema.get("properties", {}).items():
        held = _followed(one, whole)
        told = one.get("description") or held.get("description", "")
        if name not in needed:
            told = f"Optional. {told}"
        key = f"{above}{name}"
        yield f"`{key}`", kind_of(_without_reference(one, held), _nameless), told
        inner = held
        if isinstance(held.get("items"), dict):
            inner, key = _followed(held["items"], whole), f"{key}[]"
        for some in (inner, *inner.get("anyOf", ())):
            yield from _rows(_followed(some, whole), whole, f"{key}.")


def _followed(schema: Any, whole: Any) -> Any:
    """What a reference leads to, or the schema itself."""
    reference = schema.get("$ref")
    return whole["$defs"][reference.rpartition("/")[2]] if reference else schema


def _without_reference(schema: Schema, held: Schema) -> Schema:
    return held if "$ref" in schema else schema


def _nameless(reference: str) -> str:
    return reference.rpartition("/")[2]
