"""Keys, scopes and tenants: what each route demands, and that nobody sees what is another's."""

from __future__ import annotations

import logging
from contextlib import closing

import httpx
import pytest
from sqlalchemy import update

from service.access.key import Scope, new_secret
from service.storage.sqlite import SqliteDatabase
from service.storage.tables import ApiKeyRow
from tests.service.routes.serving import problem, served
from tests.waiting import until


@pytest.fixture(scope="module")
def keyed(tmp_path_factory):
    with served(tmp_path_factory.mktemp("keyed"), require_keys=True) as one:
        yield one


@pytest.fixture
def database(keyed):
    """The service's own, by another hand."""
    with closing(SqliteDatabase.open(keyed.services.settings.data / "occluder.db")) as one:
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
            yield (
                method.upper(),
                path.format(
                    job_id="x",
                    asset_id="x",
                    name="x",
                    key_id="x",
                    delivery_id="x",
                    slug="not-found",
                ),
            )


FOR_ADMINS = ("/v1/keys", "/v1/journal")
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
        if method in ("GET", "HEAD") and path not in FOR_ADMINS:
            assert response.status_code in (200, 404, 409), path
        else:
            problem(response, 403, "forbidden")


def as_admin(path, method):
    """Whether a route is for admins alone."""
    return path.startswith(FOR_ADMINS) or (method, path) in (
        ("DELETE", "/v1/assets/x"), ("PUT", "/v1/assets/x/thresholds"),
        ("PUT", "/v1/assets/x/name"), ("PUT", "/v1/thresholds"),
    )  # fmt: skip


def test_only_admins_manage_keys_set_thresholds_and_remove_assets(keyed, keys):
    for method, path in every_route(keyed):
        if as_admin(path, method):
            for scope in (Scope.READ, Scope.WRITE):
                response = keyed.http.request(method, path, headers=keys["ours", scope])
                told = problem(response, 403, "forbidden")
                assert (told["scope"], told["needed"]) == (scope, "admin")
                said = f"the API key has the scope '{scope}', and this needs 'admin'"
                assert told["detail"] == said
                assert told["remedy"] == "use a key with the scope 'admin'"
        response = keyed.http.request(method, path, headers=keys["ours", Scope.ADMIN])
        assert response.status_code not in (401, 403), path


def test_a_key_to_write_makes_assets_and_leaves_what_is_demanded(keyed, keys):
    writer, admin = keys["ours", Scope.WRITE], keys["ours", Scope.ADMIN]

    def put(headers, **body):
        return keyed.http.put("/v1/assets", json={"name": "gate", **body}, headers=headers)

    problem(put(writer, min_recall=0.7), 403, "forbidden")
    assert keyed.http.get("/v1/assets?name=gate", headers=admin).json()["items"] == []
    assert put(writer).status_code == 201
    assert put(admin, min_recall=0.7).json()["thresholds"]["min_recall"] == 0.7
    assert put(writer, min_recall=0.7).status_code == 200  # as it is
    told = problem(put(writer), 403, "forbidden")
    assert told["needed"] == "admin"
    [asset] = keyed.http.get("/v1/assets?name=gate", headers=admin).json()["items"]
    assert asset["thresholds"]["min_recall"] == 0.7


def test_a_key_of_before_keeps_what_it_could(keyed, database):
    key, secret = keyed.keys.create("early", "ci", Scope.WRITE)
    with database.writing() as session:
        session.execute(update(ApiKeyRow).where(ApiKeyRow.id == key.id).values(curates=True))
    headers = {"X-API-Key": secret}
    body = {"name": "gate", "min_recall": 0.7}
    asset = keyed.http.put("/v1/assets", json=body, headers=headers).json()
    thresholds = keyed.http.put(asset["links"]["thresholds"], json={}, headers=headers)
    assert thresholds.status_code == 200
    assert keyed.http.delete(asset["links"]["self"], headers=headers).status_code == 204
    problem(keyed.http.get("/v1/keys", headers=headers), 403, "forbidden")
    problem(keyed.http.post("/v1/keys", json={}, headers=headers), 403, "forbidden")


def test_admins_make_rotate_and_revoke_keys(keyed, keys):
    admin = keys["ours", Scope.ADMIN]
    body = {"name": "night", "scope": "read", "expires": "2999-01-31T12:00:00+01:00"}
    made = keyed.http.post("/v1/keys", json=body, headers=admin)
    assert made.status_code == 201
    key = made.json()
    assert (key["name"], key["scope"], key["expires"]) == ("night", "read", "2999-01-31T11:00:00Z")
    assert key["secret"].startswith(key["begins"])

    def works(secret):
        return keyed.http.get("/v1/jobs", headers={"X-API-Key": secret}).status_code == 200

    assert works(key["secret"])
    place = f"/v1/keys/{key['id']}"
    turned = keyed.http.post(f"{place}/rotate", json={"overlap": 3600}, headers=admin)
    assert turned.status_code == 201
    new = turned.json()
    assert (new["replaces"], new["scope"]) == (key["id"], "read")
    assert works(key["secret"])
    assert works(new["secret"])
    problem(keyed.http.post(f"{place}/rotate", json={}, headers=admin), 409, "conflict")
    assert keyed.http.delete(place, headers=admin).status_code == 204
    until(lambda: not works(key["secret"]))
    assert works(new["secret"])

    listed = keyed.http.get("/v1/keys", headers=admin).json()["items"]
    ended, left = (next(one for one in listed if one["id"] == each["id"]) for each in (key, new))
    assert ended["revoked"]
    assert left["revoked"] is None
    assert left["last_used"]
    assert key["secret"] not in str(listed)
    for wrong in ({"expires": "2001-01-01T00:00:00Z"}, {"scope": "root"}, {"name": "a\nb"},
                  {"expires": 5}, {"tenant": "theirs"}):  # fmt: skip
        answer = keyed.http.post("/v1/keys", json=wrong, headers=admin)
        problem(answer, 422, "invalid-options")
    problem(
        keyed.http.post(f"{place}/rotate", json={"overlap": -1}, headers=admin),
        422, "invalid-options",
    )  # fmt: skip


def test_keys_and_journal_of_another_tenant_are_not_there(keyed, keys):
    made, secret = keyed.keys.create("ours", "of a test", Scope.READ)
    theirs = keys["theirs", Scope.ADMIN]
    place = f"/v1/keys/{made.id}"
    problem(keyed.http.delete(place, headers=theirs), 404, "not-found")
    problem(keyed.http.post(f"{place}/rotate", json={}, headers=theirs), 404, "not-found")
    assert keyed.keys.find(secret)
    assert made.id not in keyed.http.get("/v1/keys", headers=theirs).text
    assert made.id not in keyed.http.get("/v1/journal?limit=500", headers=theirs).text
    ours = keyed.http.get("/v1/journal?limit=500", headers=keys["ours", Scope.ADMIN]).text
    assert made.id in ours


def test_the_journal_says_who_set_thresholds_and_removed_assets(keyed):
    admin, secret = keyed.keys.create("studio", "desk", Scope.ADMIN)
    headers = {"X-API-Key": secret}

    def put(path, **body):
        return keyed.http.put(path, json=body, headers=headers).json()

    asset = put("/v1/assets", name="gate", min_recall=0.7)
    put("/v1/assets", name="gate", min_recall=0.7)  # which changes nothing
    put(asset["links"]["thresholds"], max_overhang=0.01)
    put("/v1/thresholds", folder="props", min_recall=0.5)
    put(f"{asset['links']['self']}/name", name="door")
    keyed.http.delete(asset["links"]["self"], headers=headers)
    page = keyed.http.get("/v1/journal?limit=4", headers=headers).json()
    gone, renamed, folder, changed = page["items"]
    assert (gone["action"], gone["subject"], gone["details"]) == (
        "asset-removed", asset["id"], {"name": "door"},
    )  # fmt: skip
    assert (renamed["action"], renamed["details"]) == (
        "asset-renamed", {"before": "gate", "after": "door"},
    )  # fmt: skip
    assert (folder["action"], folder["subject"]) == ("folder-thresholds-set", "props")
    assert folder["details"]["after"]["min_recall"] == 0.5
    assert (gone["actor"], gone["address"]) == (admin.id, "127.0.0.1")
    assert changed["action"] == "thresholds-set"
    assert changed["details"]["before"]["min_recall"] == 0.7
    assert changed["details"]["after"] == {
        "min_precision": None, "min_recall": None, "max_overhang": 0.01,
    }  # fmt: skip
    rest = keyed.http.get(page["next"], headers=headers).json()
    assert [one["action"] for one in rest["items"]] == ["thresholds-set", "key-made"]
    assert rest["next"] is None
    later = keyed.http.get("/v1/journal?since=2999-01-01T00:00:00Z", headers=headers)
    assert later.json()["items"] == []


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
    url = "https://ci.example.org:8443/hooks/of-team-7f3a?token=x"
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
        assert "of-team-7f3a" not in response.text, place


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
