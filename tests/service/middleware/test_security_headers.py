"""What browsers are told about every answer."""

from __future__ import annotations

import pytest

from service.middleware.security_headers import SecurityHeaders
from service.settings import Settings
from tests.service.middleware.asgi import Answer, Echo, ask


def answer(path: str, content_type: str, **more: str) -> Answer:
    app = Echo({"content-type": content_type, **more})
    return ask(SecurityHeaders(app, Settings()), path)


def policy(path: str, content_type: str) -> dict[str, str]:
    """The directives of the content security policy."""
    told = answer(path, content_type).headers["content-security-policy"]
    return dict(f"{one.strip()} ".split(" ", 1) for one in told.split(";"))


@pytest.mark.parametrize("path", ["/v1/jobs", "/docs", "/healthz", "/metrics"])
def test_every_answer_is_neither_sniffed_nor_framed_nor_embedded(path: str) -> None:
    headers = answer(path, "application/json").headers
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["x-frame-options"] == "DENY"
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["cross-origin-resource-policy"] == "same-origin"
    assert headers["cross-origin-opener-policy"] == "same-origin"
    assert "camera=()" in headers["permissions-policy"]
    assert "frame-ancestors 'none'" in headers["content-security-policy"]


@pytest.mark.parametrize(
    "kind", ["text/html; charset=utf-8", "TEXT/HTML", "image/svg+xml", "application/xhtml+xml"]
)
def test_pages_made_from_uploads_run_no_script_and_have_no_origin(kind: str) -> None:
    told = policy("/v1/jobs/7/files/report.html", kind)
    assert "sandbox" in told
    assert told["sandbox"] == ""
    assert told["default-src"].strip() == "'none'"
    assert "script-src" not in told
    assert told["img-src"].strip() == "data:"
    assert told["style-src"].strip() == "'unsafe-inline'"


def test_pages_of_the_service_run_its_own_scripts_only() -> None:
    told = policy("/docs", "text/html")
    assert told["script-src"].strip() == "'self'"
    assert told["default-src"].strip() == "'none'"
    assert "sandbox" not in told


def test_data_loads_nothing() -> None:
    told = policy("/v1/jobs/7/files/occluder.glb", "model/gltf-binary")
    assert told["default-src"].strip() == "'none'"
    assert "img-src" not in told


def test_what_is_under_keys_is_kept_by_nobody_in_between() -> None:
    headers = answer("/v1/jobs", "application/json").headers
    assert headers["cache-control"] == "private, no-cache"
    assert headers["vary"] == "Authorization, X-API-Key"
    assert "cache-control" not in answer("/docs", "text/html").headers


def test_a_route_may_know_better() -> None:
    headers = answer(
        "/v1/jobs/7/files/occluder.glb",
        "model/gltf-binary",
        **{"cache-control": "private, immutable", "vary": "Accept"},
    ).headers
    assert headers["cache-control"] == "private, immutable"
    assert headers["vary"] == "Accept, Authorization, X-API-Key"


def test_only_https_is_asked_to_stay_so() -> None:
    name = "strict-transport-security"
    here = SecurityHeaders(Echo(), Settings())
    assert name not in ask(here).headers
    assert name in ask(here, scheme="https").headers
    behind = SecurityHeaders(Echo(), Settings(public_url="https://occluders.example.org"))
    assert name in ask(behind).headers


def test_bodies_pass_piece_by_piece() -> None:
    answered = ask(SecurityHeaders(Echo(body=(b"a", b"b", b"c")), Settings()))
    assert [one["body"] for one in answered.messages[1:]] == [b"a", b"b", b"c"]
