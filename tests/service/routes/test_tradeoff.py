"""The sweep of an asset: a job of its own kind that is no run."""

from __future__ import annotations

from tests.service.routes.serving import problem


def asset_of(service, job_id):
    return service.http.get(f"/v1/jobs/{job_id}").json()["asset"]["id"]


def test_a_sweep_takes_the_mesh_of_the_latest_run_and_is_none(service):
    job_id = service.done("/v1/occluders?filename=a.obj&asset=swept")
    asset = asset_of(service, job_id)
    response = service.http.post(f"/v1/assets/{asset}/tradeoff", json={"budgets": [8, 16.0]})
    job = response.json()
    assert response.status_code == 202
    assert response.headers["location"] == f"/v1/jobs/{job['id']}"
    assert (job["kind"], job["options"]["budgets"]) == ("tradeoff", [8, 16])
    sent = [file for file in service.services.jobs.files(job_id) if file.is_input]
    assert list(service.services.jobs.files(job["id"])) == sent
    service.hand.begin()
    service.hand.succeed(recall=0.1)
    seen = service.http.get(f"/v1/assets/{asset}").json()
    assert (seen["runs"], seen["latest"]["id"]) == (1, job_id)
    runs = service.http.get(f"/v1/assets/{asset}/runs").json()["items"]
    assert [run["job_id"] for run in runs] == [job_id]
    compared = service.http.get(f"/v1/assets/{asset}/compare?a={job['id']}&b={job_id}")
    problem(compared, 404, "not-found")
    swept = service.http.get(f"/v1/jobs?asset={asset}&kind=tradeoff").json()["items"]
    assert [one["id"] for one in swept] == [job["id"]]
    again = service.http.post(f"/v1/assets/{asset}/tradeoff", json={"budgets": [8, 16]}).json()
    assert again["state"] == "queued"  # times are measured anew
    service.http.post(f"/v1/jobs/{again['id']}/cancel")


def test_wrong_lists_are_told_field_by_field(service):
    asset = asset_of(service, service.done("/v1/occluders?filename=a.obj&asset=wrong"))
    wrong = {"budgets": [], "times": [0.0], "resolutions": [8, 8], "directions": "8", "odd": 1}
    told = problem(
        service.http.post(f"/v1/assets/{asset}/tradeoff", json=wrong), 422, "invalid-options"
    )
    assert {one["field"] for one in told["errors"]} == set(wrong)
    problem(service.http.post(f"/v1/assets/{asset}/tradeoff", json=[]), 422, "invalid-options")


def test_an_asset_without_a_mesh_is_not_swept(service):
    made = service.http.put("/v1/assets", json={"name": "without runs"}).json()
    told = problem(service.http.post(f"/v1/assets/{made['id']}/tradeoff", json={}), 409, "conflict")
    assert "no run with a mesh" in told["detail"]
    problem(service.http.post("/v1/assets/none/tradeoff", json={}), 404, "not-found")
