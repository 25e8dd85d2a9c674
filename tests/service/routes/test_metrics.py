from __future__ import annotations

import re
import threading
import time

import pytest
from prometheus_client.parser import text_string_to_metric_families

from service.jobs.deliveries import WebhookOutcome
from tests.service.routes.serving import OBJ, served
from tests.waiting import until


@pytest.fixture
def fresh(tmp_path):
    with served(tmp_path) as one:
        yield one


def samples(service, **headers):
    text = service.http.get("/metrics", headers=headers).text
    return {
        (sample.name, *sample.labels.values()): sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }


def test_the_queue_is_counted_when_it_is_asked_for(fresh):
    fresh.queued()
    job_id = fresh.queued()
    told = samples(fresh)
    assert told["occluder_queue_depth",] == 2
    assert told["occluder_jobs", "succeeded"] == 0
    fresh.http.post(f"/v1/jobs/{job_id}/cancel")
    told = samples(fresh)
    assert told["occluder_queue_depth",] == 1
    assert told["occluder_jobs_ended_total", "occluder", "cancelled"] == 1


def test_jobs_are_counted_by_stage_and_failures_by_kind(fresh):
    fresh.queued()
    fresh.hand.begin()
    fresh.hand.fail("out-of-time")
    fresh.done(seconds=2.5)
    told = samples(fresh)
    assert told["occluder_job_failures_total", "out-of-time"] == 1
    assert told["occluder_job_seconds_count", "occluder", "refine"] == 1
    assert told["occluder_job_seconds_sum", "occluder", "all"] == 2.5


def test_a_stored_result_takes_no_time(fresh):
    fresh.post()
    fresh.hand.begin()
    fresh.hand.succeed()
    assert fresh.post(body=OBJ).json()["job"]["reused"]
    told = samples(fresh)
    assert told["occluder_jobs_ended_total", "occluder", "succeeded"] == 2
    assert told["occluder_job_seconds_count", "occluder", "all"] == 1


def test_each_asset_shows_how_good_its_latest_run_is(fresh):
    name = 'a "quoted"\\name'
    fresh.http.put("/v1/assets", json={"name": name, "min_recall": 0.7})
    fresh.http.put("/v1/assets", json={"name": "without a run"})
    for recall in (0.8, 0.6):
        job = fresh.http.post(
            "/v1/occluders", params={"filename": "a.obj", "asset": name, "seed": int(recall * 10)},
            content=OBJ,
        ).json()  # fmt: skip
        assert fresh.hand.begin().id == job["id"]
        fresh.hand.succeed(recall=recall)
    told = samples(fresh)
    assert told["occluder_asset_recall", name, "local"] == 0.6
    assert told["occluder_asset_holds", name, "local"] == 0.0
    assert told["occluder_asset_overhang", name, "local"] == 0.0042
    assert told["occluder_asset_verdict", name, "local", "weak"] == 1.0
    assert sum(key[0] == "occluder_asset_verdict" for key in told) == 1
    assert sum(key[0] == "occluder_asset_precision" for key in told) == 1


def test_answers_are_counted_by_the_template_of_their_route(fresh):
    for name in ("one", "two"):
        fresh.http.get(f"/v1/jobs/{name}")
    fresh.http.get("/nowhere/at/all")
    fresh.services.metrics.count_answer("BREW", None, 405, 0.1, waited=False)
    job_id = fresh.queued()
    documented = fresh.http.get("/openapi.json").json()["paths"]
    for path in documented:
        fresh.http.options(re.sub(r"{\w+}", "x", path))
    told = until_counted(fresh, ("occluder_http_responses_total", "POST", "/v1/occluders", "202"))
    by_route = "occluder_http_responses_total"
    routes = {key[2].replace(":path}", "}") for key in told if key[:2] == (by_route, "OPTIONS")}
    assert routes == set(documented)
    assert told[by_route, "GET", "/v1/jobs/{job_id}", "404"] == 2
    assert told[by_route, "GET", "other", "404"] == 1
    assert told[by_route, "other", "other", "405"] == 1
    assert told["occluder_http_request_seconds_count", "GET", "/v1/jobs/{job_id}"] == 2
    assert told["occluder_http_request_seconds_bucket", "+Inf", "GET", "/v1/jobs/{job_id}"] == 2
    assert not any(job_id in part for key in told for part in key)


def test_failures_are_counted_by_route_and_waiting_is_no_latency(fresh):
    threading.Timer(0.3, lambda: (fresh.hand.begin(), fresh.hand.fail("internal-error"))).start()
    failed = fresh.post(headers={"Prefer": "wait=10"})
    assert failed.status_code == 500
    asked = fresh.post(headers={"Prefer": "wait=1"}, body=OBJ + b"# other\n")
    assert asked.status_code == 202
    told = until_counted(fresh, ("occluder_http_responses_total", "POST", "/v1/occluders", "202"))
    assert told["occluder_http_responses_total", "POST", "/v1/occluders", "500"] == 1
    assert "occluder_http_request_seconds_count" not in {
        key[0] for key in told if "/v1/occluders" in key
    }


def test_the_oldest_job_that_waits_has_an_age(fresh):
    assert samples(fresh)["occluder_queue_oldest_seconds",] == 0.0
    fresh.queued()
    fresh.queued()
    time.sleep(0.05)
    assert 0.05 <= samples(fresh)["occluder_queue_oldest_seconds",] < 60.0
    fresh.hand.begin()
    fresh.hand.begin()
    assert samples(fresh)["occluder_queue_oldest_seconds",] == 0.0


def test_what_cannot_be_read_hides_nothing_else(fresh):
    def fail():
        raise OSError("the disk is gone")

    fresh.services.metrics.watch(
        {"test_broken": ("Broken.", fail), "test_none": ("None.", lambda: None),
         "test_well": ("Well.", lambda: 7)}
    )  # fmt: skip
    told = samples(fresh)
    assert told["test_well",] == 7.0
    assert not {("test_broken",), ("test_none",)} & set(told)


def test_webhooks_are_counted_from_nothing_on(fresh):
    """Else the first failure would be no increase."""
    counted = {
        key[1]: told
        for key, told in samples(fresh).items()
        if key[0] == "occluder_webhook_attempts_total"
    }
    assert counted["given_up"] == 0.0
    fresh.services.metrics.count_webhook(WebhookOutcome.GIVEN_UP)
    assert samples(fresh)["occluder_webhook_attempts_total", "given_up"] == 1.0


def until_counted(service, key):
    """The samples once one is there: an answer is counted when it has gone out."""
    return until(lambda: (told := samples(service)).get(key) and told)
