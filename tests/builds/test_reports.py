"""What CI systems read."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET

import pytest

from simplifier.builds.finding import AssetFigures, Finding, State
from simplifier.builds.reports import headline, json_report, junit_report, markdown_report

FIGURES = AssetFigures(64, 0.99, 0.8, 0.125, None, 0.00412, "weak")
FINDINGS = [
    Finding("props/a.glb", State.CURRENT, "", FIGURES),
    Finding("props/b|<c>.glb", State.BUILT, "the mesh has changed", FIGURES, ("recall",), ("w",)),
    Finding("d.glb", State.FAILED, "it is\x00\n*broken*"),
    Finding("e.glb", State.GONE, "no such asset"),
]  # fmt: skip


def test_junit_has_a_case_an_asset():
    suite = ET.fromstring(junit_report("occluders.toml", FINDINGS))[0]
    assert (suite.get("tests"), suite.get("failures")) == ("4", "3")
    cases = {(one.get("classname"), one.get("name")): one for one in suite}
    assert list(cases) == [("props", "a.glb"), ("props", "b|<c>.glb"), (".", "d.glb"),
                           (".", "e.glb")]  # fmt: skip
    assert cases["props", "a.glb"].find("failure") is None
    assert cases["props", "b|<c>.glb"].find("failure").get("message") == "recall"
    assert "*broken*" in cases[".", "d.glb"].find("failure").text


def test_markdown_leads_with_what_is_wrong_and_leaves_out_what_is_as_it_was():
    lines = markdown_report("occluders.toml", FINDINGS).decode().splitlines()
    assert lines[0] == "### occluders.toml: " + headline(FINDINGS).replace("_", r"\_")
    rows = [line for line in lines if line.startswith("| ")][1:]
    assert rows[0].startswith(r"| d.glb | ❌ |") or rows[0].startswith(r"| props/b")
    assert any(
        r"props/b\|\<c\>.glb | ❌ | weak | 64 | 80.00 % | 99.00 % | 0.42 % | recall |" in row
        for row in rows
    )
    assert len(rows) == 3


def test_markdown_stays_below_what_pages_take():
    many = [Finding(f"{i}" * 20, State.FAILED, "x" * 100) for i in range(5000)]
    assert len(markdown_report("m", many)) < 1_000_000
    assert b"and 4,500 more" in markdown_report("m", many)


def test_json_holds_all():
    content = json.loads(json_report("occluders.toml", FINDINGS))
    assert content["good"] is False
    assert [one["state"] for one in content["assets"]] == ["current", "built", "failed", "gone"]
    assert content["assets"][1]["figures"]["error_bound"] is None
    assert content["assets"][1]["figures"]["overhang"] == 0.00412
    assert content["assets"][1]["figures"]["verdict"] == "weak"
    assert content["assets"][2]["faults"] == ["failed: it is\x00\n*broken*"]


@pytest.mark.parametrize(
    ("findings", "words"),
    [
        (FINDINGS[:1], "1 asset: 1 current"),
        (FINDINGS, "4 assets: 1 current, 1 built, 1 failed, 1 gone, 1 not good enough"),
    ],
)
def test_the_headline_counts(findings, words):
    assert headline(findings) == words
