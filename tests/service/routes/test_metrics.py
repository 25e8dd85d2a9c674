from __future__ import annotations

import pytest
from prometheus_client.parser import text_string_to_metric_families

from tests.service.routes.serving import OBJ, served


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
