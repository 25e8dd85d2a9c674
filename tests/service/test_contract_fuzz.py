"""The service keeps to ``openapi.yaml``, as ``contract_fuzz.py`` tries in a process of its own.

Its cases take seconds to build while modules are collected, which every worker of the tests does.
And those of all operations have one name, of which such workers do but one.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from service.openapi import FILE
from tests.acceptance.command import ROOT, environment

CASES = Path(__file__).with_name("contract_fuzz.py")
METHODS = {"delete", "get", "head", "patch", "post", "put"}


@pytest.mark.parametrize(
    ("examples", "keyed"),
    [
        (5, True),
        pytest.param(8, False, marks=pytest.mark.slow),
        pytest.param(60, True, marks=pytest.mark.slow),
    ],
)
def test_every_operation_and_what_it_leads_to_is_as_documented(examples, keyed):
    done = subprocess.run(
        [
            sys.executable, "-m", "pytest", "-s", "-p", "schemathesis", "-p", "no:cacheprovider",
            CASES,
        ],
        cwd=ROOT, env=environment(CONTRACT_EXAMPLES=str(examples), CONTRACT_KEYED=str(int(keyed))),
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    operations = sum(len(METHODS & path.keys()) for path in document()["paths"].values())
    assert operations > 20
    [passed] = re.findall(r"^(\d+) passed in", done.stdout, re.MULTILINE)
    assert int(passed) == operations + 1, done.stdout  # and one that goes from answer to answer
    [accepted] = re.findall(r"^(\d+) jobs were accepted", done.stdout, re.MULTILINE)
    assert int(accepted) >= examples  # uploads of bytes that a worker judges


def document():
    return yaml.load(FILE.read_text(), yaml.CSafeLoader)
