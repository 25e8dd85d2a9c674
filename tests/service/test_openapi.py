from __future__ import annotations

from service.openapi import FILE, document
from service.routes.api import make_api


def test_the_file_says_what_the_application_does():
    assert FILE.read_text("utf-8") == document(), "run: python -m service.openapi"


def test_every_operation_is_summed_up_and_every_answer_described():
    paths = make_api().openapi()["paths"]
    for path, operations in paths.items():
        for method, operation in operations.items():
            assert operation.get("summary"), (method, path)
            assert operation.get("description"), (method, path)
            for status, response in operation["responses"].items():
                assert response.get("description") or response.get("$ref"), (method, path, status)
