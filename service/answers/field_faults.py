"""Fields of a query or a body that are refused before a route sees them, in our own words.

The fault is told by the type of pydantic's error, and the remedy by the schema of the field, so
that a field of a kind that is known needs nothing here.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from pydantic import TypeAdapter

from service.errors import FieldError

Schema = Mapping[str, Any]

_LONGEST_ECHO = 60  # characters of a value
_LONGEST_NAME = 200  # characters of a field that is not known

_FAULTS = {
    "missing": "it is missing",
    "extra_forbidden": "there is no such field",
    "greater_than_equal": "{value} is out of range",
    "greater_than": "{value} is out of range",
    "less_than_equal": "{value} is out of range",
    "less_than": "{value} is out of range",
    "finite_number": "{value} is out of range",
    "int_parsing_size": "{value} is out of range",
    "int_parsing": "{value} is not a whole number",
    "int_type": "{value} is not a whole number",
    "int_from_float": "{value} is not a whole number",
    "float_parsing": "{value} is not a number",
    "float_type": "{value} is not a number",
    "bool_parsing": "{value} is neither true nor false",
    "bool_type": "{value} is neither true nor false",
    "enum": "{value} is not known",
    "literal_error": "{value} is not known",
    "string_type": "{value} is not text",
    "string_unicode": "{value} is not valid Unicode",
    "string_too_short": "it has {length} characters",
    "string_too_long": "it has {length} characters",
    "list_type": "{value} is not a list",
    "too_long": "{length} values are given",
    "dict_type": "{value} is not a JSON object",
    "model_type": "{value} is not a JSON object",
    "model_attributes_type": "{value} is not a JSON object",
}
"""By pydantic's type of error.  Times and cursors have their own."""

_OUT_OF_RANGE = "{value} is out of range"


def field_fault(route: object, fault: Mapping[str, Any]) -> FieldError:
    """One of pydantic's errors as a refusal of the field.

    ``route``  that refused; ``fault["loc"]`` is where it was, query or body, and the names that
    lead to the field.
    """
    place, *steps = fault["loc"] or ("body",)
    names = [step for step in steps if isinstance(step, str)]  # others number the items of a list
    name = ".".join(names)[:_LONGEST_NAME] or "body"
    fields = _fields_of(route, str(place))
    schema = fields.get(name, {"type": "object"} if name == "body" else {})
    kind, value = str(fault["type"]), fault.get("input")
    if kind == "extra_forbidden":
        return FieldError(name, _FAULTS[kind], f"choose from {', '.join(fields)}")
    if kind == "missing":
        return FieldError(name, _FAULTS[kind], _remedy(schema))
    if name == "cursor":
        return FieldError(
            name, f"{_text(value)} is no cursor of this list", "follow 'next' of the page before"
        )
    if schema.get("format") == "date-time":
        return FieldError(
            name, f"{_text(value)} is no time with an offset from UTC", _remedy(schema)
        )
    if kind == "value_error":  # one of ours, which says what is wrong
        said = str(fault["msg"]).removeprefix("Value error, ")
        return FieldError(name, said, "choose another")
    if kind == "too_long":
        return FieldError(name, _detail(kind, value), f"give at most {schema['maxItems']}")
    return FieldError(name, _detail(kind, value), _remedy(schema))


def _detail(kind: str, value: object) -> str:
    text = _FAULTS.get(kind, "{value} cannot be used")
    if text == _OUT_OF_RANGE and isinstance(value, str):  # a number of a query
        return text.format(value=_short(ascii(value)[1:-1]))
    length = len(value) if isinstance(value, (str, list)) else 0
    return text.format(value=_text(value), length=f"{length:,}")


def _text(value: object) -> str:
    """A value as JSON has it; one that may be of any depth is not shown."""
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, dict):
        return "an object"
    return "a list" if isinstance(value, list) else _short(ascii(value))


def _short(text: str) -> str:
    return text if len(text) <= _LONGEST_ECHO else f"{text[: _LONGEST_ECHO - 3]}..."


def _remedy(schema: Schema) -> str:
    """What a field may be."""
    if "enum" in schema:
        return f"choose one of {', '.join(map(str, schema['enum']))}"
    match schema.get("type"):
        case "array":
            return _remedy(schema["items"])
        case "boolean":
            return "give true or false"
        case "integer" | "number" as kind:
            number = "a whole number" if kind == "integer" else "a number"
            return _within(schema.get("minimum"), schema.get("maximum"), number)
        case "object":
            return "send a JSON object"
        case "string" if schema.get("format") == "date-time":
            return "give one such as 2026-01-31T12:00:00Z"
        case "string" if "maxLength" in schema:
            least, most = schema.get("minLength", 0), schema["maxLength"]
            return f"give {least} to {most} characters"
        case _:
            return "give text" if schema.get("type") == "string" else "choose another"


def _within(low: float | None, high: float | None, number: str) -> str:
    if low is None:
        return f"give {number}" if high is None else f"choose at most {high:,.15g}"
    return f"choose {low:,.15g} or more" if high is None else f"choose {low:,.15g} to {high:,.15g}"


def _fields_of(route: object, place: str) -> Mapping[str, Schema]:
    """The schemas of the fields that the query or the body of a route may have."""
    if place == "query":
        dependant = getattr(route, "dependant", None)
        wanted = [] if dependant is None else dependant.query_params
    else:
        body = getattr(route, "body_field", None)
        wanted = [] if body is None else [body]
    fields: dict[str, Schema] = {}
    for one in wanted:
        schema = _schema_of(one.field_info.annotation)
        fields |= schema.get("properties", {} if place == "body" else {one.alias: schema})
    return fields


@lru_cache
def _schema_of(annotation: Any) -> Schema:
    """Its schema, in which nothing refers to elsewhere or may be null."""
    schema = TypeAdapter(annotation).json_schema()
    plain: Schema = _plain(schema, schema.get("$defs", {}))
    return plain


def _plain(schema: Any, known: Mapping[str, Any]) -> Any:
    if isinstance(schema, list):
        return [_plain(one, known) for one in schema]
    if not isinstance(schema, dict):
        return schema
    if "$ref" in schema:
        return _plain(known[schema["$ref"].rpartition("/")[2]], known)
    if "anyOf" in schema:
        return _plain(next(one for one in schema["anyOf"] if one.get("type") != "null"), known)
    return {name: _plain(one, known) for name, one in schema.items() if name != "$defs"}
