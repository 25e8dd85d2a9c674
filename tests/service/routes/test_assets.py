"""Assets, their runs, and what is demanded of them."""

from __future__ import annotations

import re
from hashlib import sha256

import pytest

from tests.service.routes.serving import OBJ, problem


def run(service, name, query="", **numbers):
    return service.done(f"/v1/occluders?filename=a.obj&asset={name}{query}", **numbers)


def put(service, **body):
    return service.http.put("/v1/assets", json=body)


def test_an_asset_is_made_once_and_keeps_its_thresholds(service):
    made = put(service, name="a/b c", min_recall=0.7)
    assert made.status_code == 201
    asset = made.json()
    assert made.headers["location"] == asset["links"]["self"]
    assert (asset["runs"], asset["holds"], asset["latest"]) == (0, None, None)
    again = put(service, name="a/b c", min_precision=0.9)
    assert again.status_code == 200
    assert again.json()["id"] == asset["id"]
    assert again.json()["thresholds"] == {
        "min_precision": 0.9, "min_recall": None, "max_overhang": None,
    }  # fmt: skip
    found = service.http.get("/v1/assets", params={"name": "a/b c"}).json()["items"]
    assert [one["id"] for one in found] == [asset["id"]]


def test_whether_thresholds_hold_follows_the_latest_run(service):
    asset = put(service, name="tower", min_recall=0.7).json()
    place = asset["links"]["self"]
    run(service, "tower", recall=0.6)
    assert service.http.get(place).json()["holds"] is False
    better = run(service, "tower", recall=0.8)
    seen = service.http.get(place).json()
    assert (seen["holds"], seen["runs"], seen["latest"]["id"]) == (True, 2, better)
    runs = service.http.get(asset["links"]["runs"]).json()
    assert [one["holds"] for one in runs["items"]] == [True, False]
    lower = service.http.put(asset["links"]["thresholds"], json={"min_recall": 0.5}).json()
    assert lower["thresholds"]["min_recall"] == 0.5
    runs = service.http.get(asset["links"]["runs"]).json()
    assert [one["holds"] for one in runs["items"]] == [True, True]


def test_overhang_is_a_threshold_and_a_run_without_the_figure_does_not_hold_it(service):
    asset = put(service, name="wide", max_overhang=0.005).json()
    assert asset["thresholds"]["max_overhang"] == 0.005
    run(service, "wide", overhang=0.0042)
    assert service.http.get(asset["links"]["self"]).json()["holds"] is True
    run(service, "wide", "&seed=1", overhang=0.0051)
    run(service, "wide", "&seed=2", overhang=None)
    runs = service.http.get(asset["links"]["runs"]).json()["items"]
    assert [one["holds"] for one in runs] == [False, False, True]
    told = runs[1]["summary"]
    assert (told["overhang"], told["verdict"], told["reason"]) == (
        0.0051,
        "weak",
        "it hides little",
    )
    assert told["try_next"] == "occluder simplify a.obj -o a.glb --budget 128"
    pair = {"a": runs[2]["job_id"], "b": runs[1]["job_id"]}
    change = service.http.get(asset["links"]["compare"], params=pair).json()["change"]
    assert round(change["overhang"], 6) == 0.0009


def test_runs_are_read_page_by_page(service):
    ids = [run(service, "paged") for _ in range(3)]
    asset = service.http.get("/v1/assets?name=paged").json()["items"][0]
    page = service.http.get(f"{asset['links']['runs']}?limit=2").json()
    rest = service.http.get(page["next"]).json()
    assert [one["job_id"] for one in (*page["items"], *rest["items"])] == ids[::-1]
    assert rest["next"] is None


def test_two_runs_are_compared_by_number_and_option(service):
    a = run(service, "compared", "&preset=draft", recall=0.6, seconds=1.0)
    b = run(service, "compared", "&preset=best", recall=0.8, seconds=3.0)
    c = run(service, "compared", "&preset=best&budget=9", recall=0.7, seconds=3.0)
    place = service.http.get("/v1/assets?name=compared").json()["items"][0]["links"]["compare"]
    seen = service.http.get(f"{place}?a={a}&b={b}").json()
    assert seen["change"]["recall"] == pytest.approx(0.2)
    assert seen["change"]["seconds"] == 2.0
    assert seen["options_changed"] == {"preset": ["draft", "best"]}
    latest = service.http.get(place).json()
    assert (latest["a"]["job_id"], latest["b"]["job_id"]) == (b, c)
    assert latest["options_changed"] == {"budget": [64, 9]}
    since = service.http.get(f"{place}?a={a}").json()
    assert (since["a"]["job_id"], since["b"]["job_id"]) == (a, c)


def test_runs_that_were_sent_other_files_say_which(service):
    mesh, decided = ("a.obj", b"v 0 0 0\n"), ("a.overrides.toml", b"[ignore]\n")
    for files in ({"mesh": mesh}, {"mesh": mesh, "overrides": decided}):
        service.http.post("/v1/occluders?asset=decided&budget=31", files=files)
        service.hand.begin()
        service.hand.succeed()
    place = service.http.get("/v1/assets?name=decided").json()["items"][0]["links"]["compare"]
    seen = service.http.get(place).json()
    assert seen["inputs_changed"] == {"overrides": [None, sha256(decided[1]).hexdigest()]}
    assert seen["options_changed"] == {}


def test_only_runs_of_the_asset_are_compared(service):
    run(service, "lonely")
    place = service.http.get("/v1/assets?name=lonely").json()["items"][0]["links"]["compare"]
    problem(service.http.get(place), 404, "not-found")
    other = run(service, "other")
    problem(service.http.get(f"{place}?a={other}"), 404, "not-found")


def test_assets_are_found_by_a_part_of_their_name_page_by_page(service):
    names = [f"zoo/Lion {number}" for number in range(3)]
    for name in names:
        put(service, name=name)
    page = service.http.get("/v1/assets?contains=lion&limit=2").json()
    rest = service.http.get(page["next"]).json()
    assert [one["name"] for one in (*page["items"], *rest["items"])] == names
    assert rest["next"] is None


def test_an_asset_with_the_longest_name_does_not_end_the_list(service):
    names = ["y" * 299 + letter for letter in "ab"]
    for name in names:
        put(service, name=name)
    page = service.http.get("/v1/assets", params={"contains": "y" * 200, "limit": 1}).json()
    assert service.http.get(page["next"]).json()["items"][0]["name"] == names[1]


def test_an_asset_goes_with_its_jobs_once_they_have_ended(service):
    job_id = service.queued("/v1/occluders?filename=a.obj&asset=doomed")
    place = service.http.get("/v1/assets?name=doomed").json()["items"][0]["links"]["self"]
    problem(service.http.delete(place), 409, "conflict")
    service.http.post(f"/v1/jobs/{job_id}/cancel")
    assert service.http.delete(place).status_code == 204
    problem(service.http.get(place), 404, "not-found")
    problem(service.http.get(f"/v1/jobs/{job_id}"), 404, "not-found")


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ({"name": ""}, "name"),
        ({"name": "x" * 301}, "name"),
        ({"name": "a", "min_recall": 1.5}, "min_recall"),
        ({"name": "a", "min_recall": "0.5"}, "min_recall"),
        ({"name": "a", "max_overhang": -0.1}, "max_overhang"),
        ({"name": "a", "colour": 1}, "colour"),
        ({}, "name"),
    ],
)
def test_an_asset_that_cannot_be_names_the_field(service, body, field):
    told = problem(service.http.put("/v1/assets", json=body), 422, "invalid-options")
    assert told["errors"][0]["field"] == field


def test_a_body_that_is_no_json_is_told(service):
    header = {"Content-Type": "application/json"}
    problem(service.http.put("/v1/assets", content=b"{", headers=header), 400, "bad-request")
    lone = b'{"name": "\\ud800"}'
    problem(service.http.put("/v1/assets", content=lone, headers=header), 422, "invalid-options")
    problem(service.http.get("/v1/assets?cursor=x"), 422, "invalid-options")


@pytest.mark.parametrize(
    ("method", "route"),
    [
        ("PUT", "/v1/assets"), ("PUT", "/v1/thresholds"), ("PUT", "/v1/assets/x/thresholds"),
        ("PUT", "/v1/assets/x/name"), ("POST", "/v1/assets/x/tradeoff"),
        ("POST", "/v1/jobs/x/rerun"), ("POST", "/v1/keys"), ("POST", "/v1/keys/x/rotate"),
    ],
)  # fmt: skip
@pytest.mark.parametrize(
    ("header", "said"),
    [
        ({"Content-Type": "application/x-www-form-urlencoded"}, "x-www-form-urlencoded"),
        ({}, "has no Content-Type"),
    ],
)
def test_a_body_that_is_not_told_to_be_json_hears_of_the_header(
    service, method, route, header, said
):
    told = service.http.request(method, route, content=b'{"name": "a"}', headers=header)
    body = problem(told, 415, "unsupported-media-type")
    assert said in body["detail"]
    assert body["remedy"].endswith("-H 'Content-Type: application/json'")
    named = "/".join("{" if part == "x" else part for part in route.split("/"))
    paths = service.http.get("/openapi.json").json()["paths"]
    documented = {re.sub(r"{[^/]*", "{", path): way for path, way in paths.items()}
    assert "415" in documented[named][method.lower()]["responses"]


def test_a_body_that_is_far_too_long_is_not_read(service):
    header = {"Content-Type": "application/json"}
    told = service.http.put("/v1/assets", content=b" " * (1 << 20), headers=header)
    problem(told, 413, "too-large")
    parts = (b" " * 50_000 for _ in range(4))
    problem(service.http.put("/v1/assets", content=parts, headers=header), 413, "too-large")


@pytest.mark.parametrize("route", ["/v1/assets", "/v1/jobs/x/rerun", "/v1/assets/x/tradeoff"])
def test_no_body_is_read_to_its_end_before_anybody_looks_who_sends_it(service, route):
    method = "PUT" if route == "/v1/assets" else "POST"
    header = {"Content-Type": "application/json"}
    told = service.http.request(method, route, content=b" " * 70_000, headers=header)
    problem(told, 413, "too-large")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("a\0b", "U+0000"), ("a\nb", "U+000A"), ("a\u2028b", "U+2028"), ("a\x1b[2J", "U+001B"),
        ("castle\u202egnp.obj", "U+202E"), ("\u2066a", "U+2066"), ("a\u200b", "U+200B"),
        (" ", "space"), (" a", "space"), ("a\u00a0", "space"), ("\u200d", "seen"),
    ],
)  # fmt: skip
def test_names_that_hide_something_are_refused_whichever_way_they_come(service, name, words):
    for told in (
        service.http.put("/v1/assets", json={"name": name}),
        service.http.get("/v1/assets", params={"name": name}),
        service.http.post(
            "/v1/occluders", params={"filename": "a.obj", "asset": name}, content=OBJ
        ),
    ):
        (fault,) = problem(told, 422, "invalid-options")["errors"]
        assert words in fault["detail"]


def test_names_that_look_the_same_are_the_same(service):
    composed, apart = "T\u00fcr", "Tu\u0308r"
    made = put(service, name=apart)
    assert (made.status_code, made.json()["name"]) == (201, composed)
    assert put(service, name=composed).status_code == 200
    run(service, apart)
    for search in ({"name": apart}, {"name": composed}, {"contains": "u\u0308r"}):
        (found,) = service.http.get("/v1/assets", params=search).json()["items"]
        assert (found["name"], found["runs"]) == (composed, 1)


def test_names_of_scripts_that_need_joiners_are_kept(service):
    for name in (
        "\u0646\u0645\u06cc\u200c\u062e\u0648\u0627\u0647\u0645",
        "\U0001f469\u200d\U0001f680",
    ):
        assert put(service, name=name).json()["name"] == name


def test_what_is_demanded_of_a_folder_counts_for_all_assets_in_it(service):
    asset = put(service, name="folded/props/gate").json()
    run(service, "folded/props/gate", recall=0.6)
    folder = {"folder": "/folded/", "min_recall": 0.7, "min_precision": 0.5}
    answer = service.http.put("/v1/thresholds", json=folder)
    told = {"min_precision": 0.5, "min_recall": 0.7, "max_overhang": None}
    assert answer.json() == {"folder": "folded", **told}
    seen = service.http.get(asset["links"]["self"]).json()
    assert (seen["demanded"], seen["thresholds"]["min_recall"], seen["holds"]) == (
        told,
        None,
        False,
    )
    assert answer.json() in service.http.get("/v1/thresholds").json()["items"]
    service.http.put(asset["links"]["thresholds"], json={"min_recall": 0.6})
    runs = service.http.get(asset["links"]["runs"]).json()["items"]
    assert [one["holds"] for one in runs] == [True]
    service.http.put("/v1/thresholds", json={"folder": "folded"})
    assert not any(
        one["folder"] == "folded" for one in service.http.get("/v1/thresholds").json()["items"]
    )


@pytest.mark.parametrize(
    "body", [{"folder": "a\nb"}, {"folder": "x" * 301}, {"folder": "a", "min_recall": 2}, {}]
)
def test_a_folder_that_cannot_be_is_refused(service, body):
    problem(service.http.put("/v1/thresholds", json=body), 422, "invalid-options")


def test_an_asset_is_renamed_and_keeps_its_runs(service):
    run(service, "renamed/before")
    [asset] = service.http.get("/v1/assets?name=renamed/before").json()["items"]
    place = f"{asset['links']['self']}/name"
    renamed = service.http.put(place, json={"name": "renamed/after"}).json()
    assert (renamed["id"], renamed["name"], renamed["runs"]) == (asset["id"], "renamed/after", 1)
    assert service.http.get("/v1/assets?name=renamed/before").json()["items"] == []
    put(service, name="renamed/other")
    problem(service.http.put(place, json={"name": "renamed/other"}), 409, "conflict")
    problem(service.http.put(place, json={"name": " "}), 422, "invalid-options")
