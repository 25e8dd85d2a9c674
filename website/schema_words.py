"""What a JSON schema allows, in words."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

Schema = Mapping[str, Any]
Named = Callable[[str], str]
"""Of what a ``$ref`` leads to, the Markdown that names it."""

_KINDS = {
    "array": "list", "boolean": "true or false", "integer": "whole number", "null": "null",
    "number": "number", "object": "object", "string": "text",
}  # fmt: skip
_LOWEST = (("minimum", "at least"), ("exclusiveMinimum", "above"))
_HIGHEST = (("maximum", "at most"), ("exclusiveMaximum", "below"))


def kind_of(schema: Schema, named: Named) -> str:
    """Its kind with the limits, as "whole number, at least 1, at most 16"."""
    if "$ref" in schema:
        return named(schema["$ref"])
    if "const" in schema:
        return f"`{_value(schema['const'])}`"
    if "enum" in schema:
        return " or ".join(f"`{_value(one)}`" for one in schema["enum"])
    for key in ("anyOf", "oneOf", "allOf"):
        if key in schema:
            return " or ".join(dict.fromkeys(kind_of(one, named) for one in schema[key]))
    kinds = schema.get("type", "any")
    if not isinstance(kinds, str):
        return " or ".join(kind_of({**schema, "type": one}, named) for one in kinds)
    if kinds == "array" and isinstance(schema.get("items"), Mapping):
        return f"list of {kind_of(schema['items'], named)}"
    if kinds == "string" and "format" in schema:
        return {"binary": "bytes", "date-time": "time"}.get(schema["format"], schema["format"])
    words = [_KINDS.get(kinds, kinds)]
    if kinds in ("integer", "number"):
        for key, told in (*_LOWEST, *_HIGHEST):
            if key in schema:
                words.append(f"{told} {_number(schema[key], kinds)}")
    return ", ".join(words)


def _number(value: float, kind: str) -> str:
    return f"{int(value) if kind == 'integer' else value:,}"


def default_of(schema: Schema) -> str:
    return f"`{_value(schema['default'])}`" if schema.get("default") is not None else ""


def _value(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
