from __future__ import annotations

from tests.service.routes.serving import problem


def test_an_answer_is_all_that_healthz_says(service):
    service.faults["engine"] = "its processes die"
    try:
        assert service.http.get("/healthz").json() == {"status": "ok", "version": "1.0"}
    finally:
        service.faults.clear()


def test_readyz_says_in_words_what_is_wrong(service):
    assert service.http.get("/readyz").json() == {"status": "ready", "checks": ["engine"]}
    service.faults["engine"] = "its processes die before they begin"
    try:
        told = problem(service.http.get("/readyz"), 503, "not-ready")
        assert told["detail"] == "engine: its processes die before they begin"
    finally:
        service.faults.clear()
