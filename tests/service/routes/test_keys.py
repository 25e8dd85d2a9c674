"""Keys, scopes and tenants: what each route demands, and that nobody sees what is another's."""

from __future__ import annotations

import logging

import httpx
import pytest

from service.access.key import Scope, new_secret
from tests.service.routes.serving import problem, served
from tests.waiting import until


@pytest.fixture(scope="module")
def keyed(tmp_path_factory):
    with served(tmp_path_factory.mktemp("keyed"), require_keys=True) as one:
        yield one


@pytest.fixture(scope="module")
def keys(keyed):
    def header(tenant, scope):
        _, secret = keyed.keys.create(tenant, "of a test", scope)
        return {"Authorization": f"Bearer {secret}"}

    return {
        (tenant, scope): header(tenant, scope) for tenant in ("ours", "theirs") for scope in Scope
    }


def every_route(keyed):
    for path, operations in keyed.http.get("/openapi.json").json()["paths"].items():
        for method in operations:
            yield method.upper(), path.format(job_id="x", asset_id="x", name="x", slug="not-found")


OPEN = ("/healthz", "/readyz", "/problems/not-found")


def test_without_a_key_only_health_is_told(keyed):
    for method, path in every_route(keyed):
        response = keyed.http.request(method, path)
        if path in OPEN:
            assert response.status_code == 200, path
        else:
            assert response.status_code == 401, path
            assert response.headers["www-authenticate"] == "Bearer"


def test_a_key_to_read_changes_nothing(keyed, keys):
    for method, path in every_route(keyed):
        response = keyed.http.request(method, path, headers=keys["ours", Scope.READ])
        if method in ("GET", "HEAD"):
            assert response.status_code in (200, 404, 409), path
        else:
            problem(response, 403, "forbidden")


def test_a_wrong_key_is_no_key(keyed):
    response = keyed.http.get("/v1/jobs", headers={"X-API-Key": "occ_wrong"})
    problem(response, 401, "unauthenticated")


def test_bad_keys_of_one_behind_a_proxy_lock_out_nobody_else(tmp_path):
    """All of them come from one address, as far as the service can see."""
    with served(tmp_path, require_keys=True) as service:
        answers = [
            service.http.get("/v1/jobs", headers={"X-API-Key": new_secret()}) for _ in range(25)
        ]
        assert [one.status_code for one in answers] == [401] * 20 + [429] * 5
        _, secret = service.keys.create("ours", "new", Scope.READ)
        assert service.http.get("/v1/jobs", headers={"X-API-Key": secret}).status_code == 200


def test_the_log_says_whose_key_it_was(keyed, keys, caplog):
    secret = keys["ours", Scope.READ]["Authorization"].removeprefix("Bearer ")
    key_id = keyed.keys.find(secret).id
    with caplog.at_level(logging.INFO, "service.requests"):
        keyed.http.get("/v1/jobs", headers=keys["ours", Scope.READ])
        problem(keyed.post(headers=keys["ours", Scope.READ]), 403, "forbidden")
    until(lambda: len(caplog.messages) == 2)
    assert all(f" key={key_id} " in line for line in caplog.messages)
    assert secret not in caplog.text


def test_a_key_to_read_sees_of_a_webhook_only_the_host(keyed, keys):
    url = "https://ci.example.org:8443/hooks/7f3a?token=x"
    writer, reader = keys["ours", Scope.WRITE], keys["ours", Scope.READ]
    path = str(httpx.URL("/v1/occluders", params={"filename": "a.obj", "asset": "told"}))
    job_id = keyed.queued(str(httpx.URL(path).copy_add_param("webhook", url)), headers=writer)
    keyed.hand.begin()
    keyed.hand.succeed()
    asset = keyed.http.get("/v1/assets?name=told", headers=writer).json()["items"][0]
    assert asset["latest"]["webhook"] == url
    job, found = f"/v1/jobs/{job_id}", f"/v1/assets/{asset['id']}"
    assert keyed.http.get(job, headers=writer).json()["webhook"] == url
    assert keyed.http.get(job, headers=reader).json()["webhook"] == "https://ci.example.org:8443"
    for place in (
        job, "/v1/jobs?limit=500", f"{job}/result", f"{job}/events", found, "/v1/assets",
        f"{found}/runs",
    ):  # fmt: skip
        response = keyed.http.get(place, headers=reader)
        assert response.status_code == 200, place
        assert "7f3a" not in response.text, place


def test_what_is_of_one_tenant_is_not_there_for_another(keyed, keys):
    ours, theirs = keys["ours", Scope.WRITE], keys["theirs", Scope.ADMIN]
    job_id = keyed.queued("/v1/occluders?filename=a.obj&asset=secret", headers=ours)
    keyed.hand.begin()
    keyed.hand.succeed()
    asset = keyed.http.get("/v1/assets", headers=ours).json()["items"][0]["id"]
    for place in (
        f"/v1/jobs/{job_id}", f"/v1/jobs/{job_id}/files", f"/v1/jobs/{job_id}/files/lod0.obj",
        f"/v1/jobs/{job_id}/events", f"/v1/jobs/{job_id}/result", f"/v1/assets/{asset}",
        f"/v1/jobs/{job_id}/picture",
        f"/v1/assets/{asset}/runs", f"/v1/assets/{asset}/compare",
    ):  # fmt: skip
        problem(keyed.http.get(place, headers=theirs), 404, "not-found")
    for verb, place in (
        ("POST", f"/v1/jobs/{job_id}/cancel"), ("POST", f"/v1/jobs/{job_id}/retry"),
        ("DELETE", f"/v1/assets/{asset}"),
    ):  # fmt: skip
        problem(keyed.http.request(verb, place, headers=theirs), 404, "not-found")
    for place in ("/v1/jobs", "/v1/assets", f"/v1/jobs?asset={asset}"):
        assert keyed.http.get(place, headers=theirs).json()["items"] == []
    assert "secret" in keyed.http.get("/metrics", headers=ours).text
    assert "secret" not in keyed.http.get("/metrics", headers=theirs).text


def test_the_same_mesh_of_another_tenant_is_worked_at_anew(keyed, keys):
    path = "/v1/occluders?filename=a.obj"
    keyed.post(path, headers=keys["ours", Scope.WRITE])
    keyed.hand.begin()
    keyed.hand.succeed()
    assert keyed.post(path, headers=keys["ours", Scope.WRITE]).status_code == 200
    assert keyed.post(path, headers=keys["theirs", Scope.WRITE]).status_code == 202
