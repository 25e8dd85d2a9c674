"""The HTTP interface's reference: a page a subject, from ``openapi.yaml``."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import yaml

from website.repository import ROOT
from website.schema_words import Schema, default_of, kind_of
from website.tables import page, table

FOLDER = "reference/http"
BODIES = "bodies"
_METHODS = ("get", "head", "post", "put", "patch", "delete")


def pages() -> dict[str, str]:
    """Each page by its place: one a tag of the document, and one of all bodies."""
    text = (ROOT / "openapi.yaml").read_text(encoding="utf-8")
    document = yaml.load(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    made = {f"{FOLDER}/{one['name']}.md": _subject(one, document) for one in document["tags"]}
    return made | {f"{FOLDER}/{BODIES}.md": _bodies(document["components"]["schemas"])}


def _subject(tag: Schema, document: Any) -> str:
    parts = [f"# {tag['name'].capitalize()}", tag["description"]]
    for path, methods in document["paths"].items():
        for method in _METHODS:
            operation = methods.get(method)
            if operation and tag["name"] in operation["tags"]:
                parts += _operation(method, path, operation, document["components"])
    return page(*parts)


def _operation(method: str, path: str, operation: Any, components: Any) -> Iterator[str]:
    yield f"## {operation['summary']}"
    yield f"```text\n{method.upper()} {path}\n```"
    yield operation.get("description", "")
    rows = [
        (f"`{one['name']}`", one["in"], kind_of(one["schema"], _named),
         "required" if one.get("required") else default_of(one["schema"]),
         one.get("description", ""))
        for one in operation.get("parameters", ())
    ]  # fmt: skip
    if rows:
        yield "**Parameters**"
        yield table(("name", "in", "kind", "default", "what it is"), rows)
    if "requestBody" in operation:
        yield "**Body**"
        yield from _contents(operation["requestBody"]["content"])
    yield "**Answers**"
    yield table(
        ("status", "when, and what it is", "body"),
        (_answer(status, one, components) for status, one in operation["responses"].items()),
    )


def _contents(contents: Any) -> Iterator[str]:
    plain = [kind for kind, one in contents.items() if "properties" not in one["schema"]]
    described = [f"`{one}`{_body_of(contents[one]['schema'])}" for one in plain]
    if described:
        yield "One of " + ", ".join(described) + "." if len(described) > 1 else described[0] + "."
    for kind, one in contents.items():
        if kind not in plain:
            yield f"Or `{kind}` with these parts:" if plain else f"`{kind}` with these parts:"
            yield _properties(one["schema"])


def _body_of(schema: Schema) -> str:
    return "" if schema.get("format") == "binary" else f" ({kind_of(schema, _named)})"


def _answer(status: str, answer: Any, components: Any) -> tuple[str, str, str]:
    if "$ref" in answer:
        answer = components["responses"][answer["$ref"].rpartition("/")[2]]
    told = answer.get("description", "")
    heads = answer.get("headers", {})
    if heads:
        told += " Headers: " + ", ".join(f"`{one}`" for one in heads) + "."
    kinds = [
        f"`{kind}`{_body_of(one.get('schema', {}))}"
        for kind, one in answer.get("content", {}).items()
    ]
    return status, told, ", ".join(kinds)


def _bodies(schemas: Any) -> str:
    parts = ["# Bodies", "What requests and answers hold, by name."]
    for name, schema in sorted(schemas.items()):
        parts += [f"## {name}", schema.get("description", "")]
        parts.append(_properties(schema) or kind_of(schema, _named))
    return page(*parts)


def _properties(schema: Schema) -> str:
    needed = schema.get("required", ())
    rows = []
    for name, one in schema.get("properties", {}).items():
        default = "required" if name in needed else default_of(one)
        rows.append((f"`{name}`", kind_of(one, _named), default, one.get("description", "")))
        for inner, told in one.get("properties", {}).items():  # the options in a form
            rows.append(
                (f"`{name}.{inner}`", kind_of(told, _named), default_of(told),
                 told.get("description", ""))
            )  # fmt: skip
    return table(("name", "kind", "default", "what it is"), rows)


def _named(reference: str) -> str:
    name = reference.rpartition("/")[2]
    return f"[{name}]({BODIES}.md#{name.lower()})"
