"""Options of jobs, from the library's own tables: their JSON schema, and reading them.

Kinds, limits, defaults and sentences are the library's, so that its command line and the service
say the same.  A wrong request hears of every option that is wrong, not of the first alone.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

from service.errors import FieldError, InvalidOptionsError
from simplifier import OptionError, OptionField

Given = Mapping[str, Any]
Resolve = Callable[[dict[str, Any]], dict[str, Any]]

_LONGEST_ECHO = 200  # characters: a wrong value may be much longer


@dataclass(frozen=True)
class OptionTable:
    """The options of one kind of job.

    ``resolve``  all options from those that were given and are each right by itself; raises
                 :class:`~simplifier.errors.OptionError` for what cannot go together.
    """

    fields: tuple[OptionField, ...]
    resolve: Resolve

    def schema(self) -> dict[str, Any]:
        """JSON schema of an object that holds some of them."""
        return {
            "type": "object",
            "additionalProperties": False,
            "properties": {
                one.name: {**_schema(one), "description": one.help} for one in self.fields
            },
        }

    def parameters(self) -> list[dict[str, Any]]:
        """OpenAPI's query parameters."""
        return [_parameter(one) for one in self.fields]

    def from_query(self, pairs: Iterable[tuple[str, str]]) -> dict[str, Any]:
        """Values as JSON would have them, from text; what is no such value stays text.

        Raises :class:`~service.errors.InvalidOptionsError` for an option given twice.
        """
        fields = {one.name: one for one in self.fields}
        given: dict[str, Any] = {}
        twice: list[FieldError] = []
        for name, text in pairs:
            if name in given:
                twice.append(FieldError(name, "it is given twice", "give it once"))
            given[name] = _from_text(fields[name], text) if name in fields else text
        if twice:
            raise InvalidOptionsError(twice)
        return given

    def from_json(self, text: bytes | str) -> dict[str, Any]:
        """Raises :class:`~service.errors.InvalidOptionsError` for what is not a JSON object."""
        try:
            # RecursionError: thousands of opening brackets.
            given = json.loads(text, parse_constant=_refuse)
        except (ValueError, RecursionError):
            given = None
        if not isinstance(given, dict):
            fault = FieldError(
                "options", "this is not a JSON object", 'send such as {"budget": 32}'
            )
            raise InvalidOptionsError([fault])
        return given

    def read(self, given: Given) -> dict[str, Any]:
        """All options, with the defaults of those that are not given.

        Raises :class:`~service.errors.InvalidOptionsError` that names each wrong one.
        """
        fields = {one.name: one for one in self.fields}
        faults: list[FieldError] = []
        chosen: dict[str, Any] = {}
        for name, value in given.items():
            try:
                chosen[name] = self._checked(fields, name, value)
            except OptionError as error:
                faults.append(_fault(name, error))
        if not faults:
            try:
                return self.resolve(chosen)
            except OptionError as error:
                faults.append(_fault(error.where.replace(" ", "_"), error))
        raise InvalidOptionsError(faults)

    def _checked(self, fields: Mapping[str, OptionField], name: str, value: Any) -> Any:
        if name not in fields:
            raise OptionError(
                "there is no such option", remedy=f"choose from {', '.join(sorted(fields))}"
            )
        value = _normal(fields[name], value)
        fields[name].check(value)
        return value


def _fault(name: str, error: OptionError) -> FieldError:
    return FieldError(_short(name), _short(error.what), error.remedy)


def _short(text: str) -> str:
    """Without the middle of a long value, after which the fault is said."""
    half = _LONGEST_ECHO // 2
    return text if len(text) <= _LONGEST_ECHO else f"{text[:half]}...{text[-half:]}"


def _refuse(constant: str) -> float:
    raise ValueError(f"JSON has no {constant}")


def _normal(field: OptionField, value: Any) -> Any:
    """The same number, whichever way it was written, so that equal work is known as equal."""
    if isinstance(value, bool):
        return value
    if field.kind == "whole" and isinstance(value, float) and value.is_integer():
        return int(value)
    if field.kind == "number" and isinstance(value, int):
        return _float(value)
    if field.kind in _ITEMS and isinstance(value, list):
        return [_normal(replace(field, kind=_ITEMS[field.kind]), one) for one in value]
    return value


_ITEMS: Mapping[str, Literal["whole", "number"]] = {
    "lengths": "number",
    "wholes": "whole",
    "numbers": "number",
}
"""Kinds of lists, and the kind of what is in them."""


def _float(value: int | str) -> float:
    try:
        return float(value)
    except OverflowError:  # a whole number beyond all floats, which no limit allows
        return math.inf


def _from_text(field: OptionField, text: str) -> Any:
    try:
        match field.kind:
            case "whole":
                return int(text)
            case "number":
                return _float(text)
            case "flag":
                return {"true": True, "false": False}.get(text.lower(), text)
            case "lengths" | "numbers":
                return [_float(word) for word in text.split(",")]
            case "wholes":
                return [int(word) for word in text.split(",")]
            case _:
                return text
    except ValueError:
        return text


def _parameter(field: OptionField) -> dict[str, Any]:
    schema = _schema(field)
    # A query has no way to say null: what is not wanted is left out.
    schema.pop("default", None)
    if field.nullable:
        schema = {**schema, "type": schema["type"][0]}
    parameter = {
        "name": field.name,
        "in": "query",
        "required": False,
        "description": field.help,
        "schema": schema,
    }
    if not field.nullable:
        schema["default"] = _schema(field)["default"]
    if field.kind in _ITEMS:
        parameter |= {"style": "form", "explode": False}
    return parameter


def _schema(field: OptionField) -> dict[str, Any]:
    types = {
        "whole": "integer",
        "number": "number",
        "flag": "boolean",
        "choice": "string",
        "lengths": "array",
        "wholes": "array",
        "numbers": "array",
    }
    schema: dict[str, Any] = {"type": types[field.kind]}
    if field.kind == "choice":
        schema["enum"] = list(field.choices)
    elif field.kind in _ITEMS:
        several = {"minItems": 1, "maxItems": 16, "uniqueItems": True}
        if field.count is not None:
            several = {"minItems": field.count, "maxItems": field.count}
        schema |= {"items": {"type": types[_ITEMS[field.kind]], **_limits(field)}, **several}
    elif field.kind != "flag":
        schema |= _limits(field)
    if field.nullable:
        schema["type"] = [schema["type"], "null"]
    default = list(field.default) if isinstance(field.default, tuple) else field.default
    return {**schema, "default": default}


def _limits(field: OptionField) -> dict[str, float]:
    limits: dict[str, float] = {}
    if field.low is not None:
        limits["exclusiveMinimum" if field.low_excluded else "minimum"] = field.low
    if field.high is not None:
        limits["maximum"] = field.high
    return limits
