"""The pages that are made for the site hold all that there is."""

from __future__ import annotations

import re

import pytest
import yaml
from typer.main import get_command

import simplifier
from simplifier.cli.main import app
from tests.acceptance.command import ROOT
from website import commands, http_routes, json_keys, python_names
from website.docstrings import as_markdown
from website.schema_words import default_of, kind_of
from website.tables import page, table

COMMANDS = get_command(app).commands


@pytest.mark.parametrize("name", COMMANDS)
def test_each_command_has_a_page_with_its_options_and_examples(name):
    text = commands.pages()[f"reference/commands/{name}.md"]
    below = getattr(COMMANDS[name], "commands", {})
    for one in (COMMANDS[name], *below.values()):
        for option in one.params if one.params and one not in below else ():
            if not getattr(option, "hidden", False) and option.param_type_name == "option":
                assert all(f"`{word}`" in text for word in option.opts)
    assert all(f"## occluder {name} {one}\n" in text for one in below)
    examples = (COMMANDS[name].epilog or "").count("  occluder ")
    assert text.count("```sh\noccluder ") == examples


def test_an_option_is_described_with_values_and_default():
    text = commands.pages()["reference/commands/simplify.md"]
    assert "| `--up` `x`, `y`, `z` | The mesh's up axis: x, y or z. | `y` |" in text
    assert re.search(r"\| `--budget` WHOLE \| Maximum number .* \| `64` \|", text)
    assert "beside the mesh, if it is there |" in text
    assert "| `MESH...` |" in text


def test_each_operation_and_body_is_described():
    document = yaml.safe_load((ROOT / "openapi.yaml").read_text(encoding="utf-8"))
    made = http_routes.pages()
    whole = "".join(made.values())
    for path, methods in document["paths"].items():
        for method, one in methods.items():
            assert whole.count(f"```text\n{method.upper()} {path}\n```") == 1
            text = made[f"reference/http/{one['tags'][0]}.md"]
            assert all(f"`{word['name']}`" in text for word in one.get("parameters", ()))
    bodies = made["reference/http/bodies.md"]
    assert all(f"\n## {name}\n" in bodies for name in document["components"]["schemas"])
    links = set(re.findall(r"\]\(bodies\.md#([\w-]+)\)", whole))
    assert links <= {name.lower() for name in document["components"]["schemas"]}


def test_keys_of_reports_are_described_at_every_depth():
    text = json_keys.pages()["reference/keys/report.md"]
    for key in ("recall", "by_view[].direction", "options.lods.pixel_error", "verdict.word"):
        assert f"| `{key}` |" in text


def test_each_exported_name_is_on_one_page():
    whole = "".join(python_names.pages().values())
    names = re.findall(r"^::: ([\w.]+)$", whole, re.MULTILINE)
    assert sorted(names) == sorted(python_names.exported())
    assert {one.rpartition(".")[2] for one in names} == set(simplifier.__all__) - {"__version__"}


def test_options_have_a_table_of_their_fields():
    text = python_names.pages()["reference/python/options.md"]
    after = text.partition("::: simplifier.options.simplify.SimplifyOptions\n")[2]
    whole = after.partition("\n:::")[0]
    assert all(f"| `{one.name}` |" in whole for one in simplifier.SimplifyOptions.fields())
    assert "| `resolution` | int, at least 1, at most 1,024 | `None` (64) |" in whole
    assert "| `up` | one of `x`, `y`, `z` | `y` |" in whole


@pytest.mark.parametrize(
    ("schema", "words"),
    [
        ({"type": "integer", "minimum": 1, "maximum": 1000},
         "whole number, at least 1, at most 1,000"),
        ({"type": "integer", "minimum": 0.0}, "whole number, at least 0"),
        ({"type": ["number", "null"], "exclusiveMinimum": 0}, "number, above 0 or null"),
        ({"anyOf": [{"$ref": "#/a/Job"}, {"type": "null"}]}, "Job or null"),
        ({"type": "array", "items": {"enum": ["x", True]}}, "list of `x` or `true`"),
        ({"type": "string", "format": "binary"}, "bytes"),
        ({"const": 1}, "`1`"),
        ({}, "any"),
    ],
)  # fmt: skip
def test_schemas_in_words(schema, words):
    assert kind_of(schema, lambda name: name.rpartition("/")[2]) == words


def test_defaults_in_words():
    assert default_of({"default": False}) == "`false`"
    assert default_of({"default": None}) == default_of({}) == ""


def test_docstrings_become_markdown():
    assert as_markdown("Raises :class:`~simplifier.errors.MeshError`.") == (
        "Raises `simplifier.errors.MeshError`."
    )
    column = "``a``  one,\n       and more.\n``b``, ``c``  two."
    assert as_markdown(f"Before.\n\n{column}\n\nAfter.") == (
        "Before.\n\n- ``a``: one, and more.\n- ``b``, ``c``: two.\n\nAfter."
    )
    assert as_markdown("``a``  one\nand prose.") == "``a``  one\nand prose."


def test_tables_and_pages():
    assert table(("a", "b"), [("1 | 2", "x\ny")]) == "| a | b |\n|---|---|\n| 1 \\| 2 | x y |"
    assert table(("a",), []) == ""
    assert page("# A", "", "b") == "# A\n\nb\n"
