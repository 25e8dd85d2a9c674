"""An upload becomes a job, and the job's result where it comes in time."""

from __future__ import annotations

import json
import threading
import time

import pytest

from tests.service.routes.serving import OBJ, RESULTS, problem
from tests.waiting import until

WAIT = {"Prefer": "wait=20"}


def faults(response):
    return {one["field"]: one for one in problem(response, 422, "invalid-options")["errors"]}


def test_a_raw_mesh_becomes_a_job_with_all_options_resolved(service):
    response = service.post(
        "/v1/occluders?filename=castle.obj&budget=32&preset=draft&asset=props/castle"
    )
    job = response.json()
    assert response.status_code == 202
    assert response.headers["location"] == job["links"]["self"] == f"/v1/jobs/{job['id']}"
    assert (job["state"], job["kind"], job["name"]) == ("queued", "occluder", "castle.obj")
    assert job["asset"]["name"] == "props/castle"
    assert job["created"].endswith("Z")
    options = job["options"]
    assert (options["budget"], options["preset"], options["lods"]) == (32, "draft", 3)
    assert options["views"] == 256
    assert "slicer" not in options
    assert service.hand.woken.is_set()
    assert service.hand.begin().id == job["id"]
    service.hand.succeed()


def test_what_keeps_wholly_inside_has_one_level(service):
    job = service.post("/v1/occluders?filename=a.obj&conservative=true").json()
    assert job["options"]["lods"] is None
    assert service.http.post(job["links"]["cancel"]).json()["state"] == "cancelled"


def test_a_form_brings_mesh_and_options(service):
    response = service.http.post(
        "/v1/occluders",
        files={"mesh": ("tower.obj", OBJ)},
        data={"options": json.dumps({"budget": 8, "error_bounds": [0.5, 0.25]}), "asset": "tower"},
    )
    job = response.json()
    assert (response.status_code, job["name"]) == (202, "tower.obj")
    assert job["options"]["error_bounds"] == [0.5, 0.25]
    assert job["options"]["lods"] is None
    service.http.post(job["links"]["cancel"])


def test_an_evaluation_needs_both_its_parts(service):
    parts = {"mesh": ("a.obj", OBJ), "occluder": ("b.obj", OBJ + b"\n")}
    job = service.http.post("/v1/evaluations", files=parts).json()
    names = [one["name"] for one in service.http.get(job["links"]["files"]).json()["items"]]
    assert names == ["input/mesh.obj", "input/occluder.obj"]
    service.http.post(job["links"]["cancel"])
    del parts["occluder"]
    body = problem(service.http.post("/v1/evaluations", files=parts), 400, "bad-request")
    assert "occluder" in body["detail"]


KEEP = b'[[open]]\nname = "gate"\ncenter = [0, 0, 0]\nsize = [1, 1, 1]\n'


def with_overrides(service, overrides=KEEP, label="castle.overrides.toml", query="", **headers):
    files = {"mesh": ("castle.obj", OBJ), "overrides": (label, overrides)}
    return service.http.post(f"/v1/occluders{query}", files=files, headers=headers)


def inputs(service, job):
    listed = service.http.get(job["links"]["files"]).json()["items"]
    return {one["name"]: one["sha256"] for one in listed if one["name"].startswith("input/")}


def test_overrides_are_an_input_of_their_own(service):
    job = with_overrides(service).json()
    assert job["name"] == "castle.obj"
    sent = service.http.get(f"{job['links']['files']}/input/overrides.toml")
    assert sent.content == KEEP
    assert sent.headers["content-type"] == "application/toml"
    assert sent.headers["content-disposition"] == 'attachment; filename="overrides.toml"'
    assert service.hand.begin().id == job["id"]
    labels = {one.name: one.label for one in service.hand.claim.inputs}
    assert labels == {
        "input/mesh.obj": "castle.obj", "input/overrides.toml": "castle.overrides.toml",
    }  # fmt: skip
    service.hand.end_cancelled()
    parts = {"mesh": ("a.obj", OBJ), "occluder": ("b.obj", OBJ), "overrides": ("a.toml", KEEP)}
    judged = service.http.post("/v1/evaluations", files=parts).json()
    assert set(inputs(service, judged)) == {
        "input/mesh.obj", "input/occluder.obj", "input/overrides.toml",
    }  # fmt: skip
    service.http.post(judged["links"]["cancel"])


def test_other_overrides_are_other_work_and_the_same_is_done_once(service):
    query = "?budget=19"
    first = with_overrides(service, query=query).json()
    assert service.hand.begin().id == first["id"]
    service.hand.succeed()
    same = with_overrides(service, query=query, label="renamed.toml")
    assert same.status_code == 200
    assert same.json()["job"]["reused"] == first["id"]
    assert inputs(service, same.json()["job"]) == inputs(service, first)
    for other in (with_overrides(service, KEEP + b"# more\n", query=query),
                  service.post(f"/v1/occluders{query}&filename=castle.obj")):  # fmt: skip
        assert other.status_code == 202
        service.http.post(other.json()["links"]["cancel"])


def test_the_same_key_with_other_overrides_conflicts(service):
    key = {"Idempotency-Key": "overrides-1"}
    first = with_overrides(service, **key).json()
    assert with_overrides(service, **key).json()["id"] == first["id"]
    problem(with_overrides(service, KEEP + b"# more\n", **key), 422, "idempotency-key-reused")
    service.http.post(first["links"]["cancel"])


def test_done_again_or_with_other_options_they_stay(service):
    job = with_overrides(service, query="?budget=21").json()
    sent = inputs(service, job)
    assert len(sent) == 2
    service.hand.begin()
    service.hand.fail("invalid-overrides")
    again = service.http.post(job["links"]["retry"]).json()
    assert inputs(service, again) == sent
    service.hand.begin()
    assert [one.label for one in service.hand.claim.inputs] == [
        "castle.obj", "castle.overrides.toml",
    ]  # fmt: skip
    service.hand.succeed()
    other = service.http.post(again["links"]["rerun"], json={"options": {"budget": 22}}).json()
    assert (other["state"], inputs(service, other)) == ("queued", sent)
    service.http.post(other["links"]["cancel"])
    stored = service.http.post(again["links"]["rerun"], json={"options": {}}).json()
    assert stored["reused"] == again["id"]


def test_a_tradeoff_takes_the_mesh_and_its_overrides(service):
    files = {"mesh": ("castle.obj", OBJ), "overrides": ("castle.overrides.toml", KEEP)}
    job = service.http.post("/v1/occluders?asset=kept&budget=23", files=files).json()
    service.hand.begin()
    service.hand.succeed()
    swept = service.http.post(f"/v1/assets/{job['asset']['id']}/tradeoff", json={}).json()
    assert set(inputs(service, swept)) == {"input/mesh.obj", "input/overrides.toml"}
    service.http.post(swept["links"]["cancel"])


def test_overrides_that_cannot_be_taken_in_are_refused(service):
    large = b"#" * ((1 << 20) + 1)
    told = problem(with_overrides(service, large), 413, "too-large")
    assert "'overrides' may have 1,048,576 bytes" in told["detail"]
    problem(with_overrides(service, b""), 400, "invalid-overrides")
    told = problem(with_overrides(service, label="a.json"), 415, "unsupported-media-type")
    assert told["remedy"].endswith("of these: .toml (application/toml)")
    scene = {"scene": ("a.glb", b"glTF"), "overrides": ("a.toml", KEEP)}
    assert "overrides" in faults(service.http.post("/v1/scenes", files=scene))


def test_a_scene_comes_as_one_file(service):
    job = service.post("/v1/scenes?filename=city.zip&budget=16", b"PK").json()
    assert (job["kind"], job["options"]["budget"], job["options"]["width"]) == ("scene", 16, 8)
    service.http.post(job["links"]["cancel"])
    told = problem(service.post("/v1/scenes?filename=city.obj"), 415, "unsupported-media-type")
    assert "city.obj" in told["detail"]
    assert told["remedy"].endswith("of these: .glb (model/gltf-binary), .zip (application/zip)")


def test_every_wrong_option_is_told_at_once(service):
    told = faults(
        service.post("/v1/occluders?filename=a.obj&budget=0&preset=slow&alpha=x&colour=red&seed=")
    )
    assert set(told) == {"budget", "preset", "alpha", "colour", "seed"}
    assert told["budget"]["detail"] == "0 is out of range"
    assert told["budget"]["remedy"] == "choose 1 to 100,000"
    assert told["alpha"]["detail"] == "'x' is out of range"
    assert "'seed'" not in told["colour"]["detail"]


@pytest.mark.parametrize(
    ("query", "field", "words"),
    [
        ("moves=64&time_limit=1", "time_limit", "cannot be given together"),
        ("lods=2&conservative=true", "lods", "wholly inside"),
        ("moves=5&time_limit=1", "time_limit", "cannot be given together"),
        ("time_limit=1e5", "time_limit", "out of range"),
        ("slicer=gl", "slicer", "no such option"),
        ("budget=1&budget=2", "budget", "given twice"),
        ("error_bounds=1,1", "error_bounds", "given twice"),
        ("asset=", "asset", "characters"),
        ("asset=a&asset=b", "asset", "given twice"),
        ("filename=b.obj", "filename", "given twice"),
        ("webhook=http://private", "webhook", "private"),
        ("alpha=nan", "alpha", "out of range"),
        ("seed=" + "9" * 5000, "seed", "whole number"),
    ],
)
def test_what_cannot_be_done_names_its_field(service, query, field, words):
    told = faults(service.post(f"/v1/occluders?filename=a.obj&{query}"))
    assert words in told[field]["detail"]


@pytest.mark.parametrize(
    "text", ["[]", "{", "[" * 20_000, '{"budget": "32"}', '{"budget": true}', '{"alpha": NaN}',
             '{"alpha": 1' + "0" * 400 + "}", '{"\\ud800": 1}', '{"up": ["x"]}'],
)  # fmt: skip
def test_options_that_are_no_options_are_refused(service, text):
    form = {"files": {"mesh": ("a.obj", OBJ)}, "data": {"options": text}}
    assert faults(service.http.post("/v1/occluders", **form))


def test_an_option_is_said_once_by_query_or_part(service):
    form = {"files": {"mesh": ("a.obj", OBJ)}, "data": {"options": '{"budget": 3}'}}
    assert (
        "given twice"
        in faults(service.http.post("/v1/occluders?budget=2", **form))["budget"]["detail"]
    )


def test_numbers_mean_the_same_however_they_are_written(service):
    first = service.post("/v1/occluders?filename=a.obj&smallest_hole=1&budget=7").json()
    form = {
        "files": {"mesh": ("a.obj", OBJ)},
        "data": {"options": '{"smallest_hole": 1.0, "budget": 7.0}'},
    }
    second = service.http.post("/v1/occluders", **form).json()
    assert json.dumps(first["options"]) == json.dumps(second["options"])
    for job in (first, second):
        service.http.post(job["links"]["cancel"])


def test_the_same_key_gives_the_same_job_and_another_request_none(service):
    key = {"Idempotency-Key": "key-1"}
    first = service.post(headers=key).json()
    assert service.post(headers=key).json()["id"] == first["id"]
    other = service.post("/v1/occluders?filename=a.obj&budget=9", headers=key)
    problem(other, 422, "idempotency-key-reused")
    service.http.post(first["links"]["cancel"])
    for bad in ("x" * 256, "two words"):
        assert "Idempotency-Key" in faults(service.post(headers={"Idempotency-Key": bad}))


def test_a_priority_goes_with_the_job_and_its_retry(service):
    first = service.post("/v1/occluders?filename=a.obj&priority=bulk", OBJ + b"# hurry\n").json()
    assert first["priority"] == "bulk"
    assert service.http.get(f"/v1/jobs/{first['id']}").json()["priority"] == "bulk"
    service.http.post(first["links"]["cancel"])
    again = service.http.post(first["links"]["retry"]).json()
    assert again["priority"] == "bulk"
    other = service.http.post(first["links"]["rerun"], json={"options": {"budget": 9}}).json()
    assert other["priority"] == "interactive"  # which somebody has asked for by hand
    form = {"files": {"mesh": ("a.obj", OBJ + b"# parts\n")}, "data": {"priority": "bulk"}}
    by_parts = service.http.post("/v1/occluders", **form).json()
    assert by_parts["priority"] == "bulk"
    for job in (again, other, by_parts):
        service.http.post(job["links"]["cancel"])
    assert "priority" in faults(service.post("/v1/occluders?filename=a.obj&priority=soon"))


def test_what_is_kept_goes_with_the_job_and_all_that_come_of_it(service):
    first = service.post("/v1/occluders?filename=a.obj&keep=lean", OBJ + b"# lean\n").json()
    plain = service.post("/v1/occluders?filename=a.obj", OBJ + b"# plain\n").json()
    assert (first["keep"], plain["keep"]) == ("lean", "all")
    service.http.post(first["links"]["cancel"])
    others = [
        service.http.post(first["links"]["retry"]).json(),
        service.http.post(first["links"]["rerun"], json={"options": {"budget": 9}}).json(),
        service.http.post(
            "/v1/occluders", files={"mesh": ("a.obj", OBJ + b"# by parts\n")},
            data={"keep": "lean"},
        ).json(),
    ]  # fmt: skip
    assert {one["keep"] for one in others} == {"lean"}
    for job in (plain, *others):
        service.http.post(job["links"]["cancel"])
    assert "keep" in faults(service.post("/v1/occluders?filename=a.obj&keep=most"))


def test_a_result_that_comes_in_time_is_the_answer(service):
    def work():
        until(lambda: service.services.jobs.counts().get("queued", 0) > 0)
        service.hand.begin()
        service.hand.succeed()

    worker = threading.Thread(target=work)
    worker.start()
    response = service.post(body=OBJ + b"# in time\n", headers=WAIT)
    worker.join()
    assert response.status_code == 200
    assert response.headers["preference-applied"] == "wait=5"
    result = response.json()
    assert result["job"]["state"] == "succeeded"
    assert result["report"]["recall"] == 0.8
    assert [one["switch_distance"] for one in result["levels"]] == [0.0, 7.5]
    assert result["levels"][1]["files"] == {"obj": f"{result['job']['links']['files']}/lod1.obj"}
    stored = service.post(body=OBJ + b"# in time\n")
    assert stored.status_code == 200
    assert stored.json()["job"]["reused"] == result["job"]["id"]
    glb = service.post(body=OBJ + b"# in time\n", headers={"Accept": "model/gltf-binary"})
    assert glb.content == RESULTS["occluder.glb"][0]
    assert glb.headers["content-type"] == "model/gltf-binary"
    assert "If-None-Match" not in glb.headers
    again = service.post(
        body=OBJ + b"# in time\n",
        headers={"Accept": "model/obj", "If-None-Match": "*", "Range": "bytes=0-1"},
    )
    assert (again.status_code, again.content) == (200, OBJ)


def test_a_result_that_does_not_come_in_time_leaves_the_job(service):
    begun = time.monotonic()
    response = service.post(
        body=OBJ + b"# late\n", headers={"Prefer": "wait=1", "Accept": "model/ply"}
    )
    assert 1.0 <= time.monotonic() - begun < 4.0
    assert response.status_code == 202
    assert response.headers["preference-applied"] == "wait=1"
    service.http.post(response.json()["links"]["cancel"])


RESULT_ALONE = {"Prefer": "return=representation, wait=1", "Accept": "model/gltf-binary"}


def test_who_wants_the_result_alone_is_sent_on_until_it_is_there(service):
    first = service.post(body=OBJ + b"# alone\n", headers=RESULT_ALONE)
    assert (first.status_code, first.content) == (303, b"")
    assert first.headers["preference-applied"] == "return=representation, wait=1"
    place = first.headers["location"]
    again = service.http.get(place, headers=RESULT_ALONE)
    assert (again.status_code, again.headers["location"]) == (303, place)
    threading.Timer(0.2, lambda: (service.hand.begin(), service.hand.succeed())).start()
    result = service.http.get(place, headers=RESULT_ALONE)
    assert (result.status_code, result.content) == (200, RESULTS["occluder.glb"][0])
    # Without the wish it is as before.
    assert service.post(body=OBJ + b"# alone\n", headers=RESULT_ALONE).status_code == 200
    other = service.queued()
    problem(service.http.get(f"/v1/jobs/{other}/result"), 409, "conflict")
    service.http.post(f"/v1/jobs/{other}/cancel")


def test_who_wants_the_result_alone_hears_of_a_failure(service):
    first = service.post(body=OBJ + b"# broken\n", headers=RESULT_ALONE)
    assert first.status_code == 303
    service.hand.begin()
    service.hand.fail()
    failed = service.http.get(first.headers["location"], headers=RESULT_ALONE)
    assert problem(failed, 409, "conflict")["failure"]["kind"] == "unreadable-mesh"


@pytest.mark.parametrize(
    ("kind", "status", "slug"),
    [
        ("unreadable-mesh", 400, "unreadable-mesh"),
        ("invalid-options", 422, "invalid-options"),
        ("invalid-overrides", 400, "invalid-overrides"),
        ("disk-full", 507, "disk-full"),
        ("unavailable", 503, "not-ready"),
        ("out-of-memory", 500, "job-failed"),
    ],
)
def test_a_job_that_fails_in_time_is_a_problem(service, kind, status, slug):
    def work():
        until(lambda: service.services.jobs.counts().get("queued", 0) > 0)
        service.hand.begin()
        service.hand.fail(kind)

    worker = threading.Thread(target=work)
    worker.start()
    response = service.post(body=OBJ + f"# {kind}\n".encode(), headers=WAIT)
    worker.join()
    body = problem(response, status, slug)
    assert "there is no triangle" in body["detail"]
    assert body["failure"]["kind"] == kind
    job = service.http.get(body["job"]).json()
    assert (job["state"], job["failure"]["remedy"]) == ("failed", "send another mesh")


def test_nothing_is_taken_in_for_formats_that_cannot_be_given(service):
    before = service.services.jobs.counts()
    body = problem(service.post(headers={"Accept": "image/png"}), 406, "not-acceptable")
    assert "model/gltf-binary" in body["remedy"]
    assert service.services.jobs.counts() == before


def test_an_empty_body_is_no_mesh(service):
    problem(service.post(body=b""), 400, "unreadable-mesh")
