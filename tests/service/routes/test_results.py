"""Results as a whole and file by file."""

from __future__ import annotations

import hashlib

import httpx
import pytest

from tests.service.routes.serving import OBJ, RESULTS, problem, served
from tests.service.storage.blobs.rot import flip

GLB = RESULTS["occluder.glb"][0]


@pytest.fixture(scope="module")
def job(service):
    return f"/v1/jobs/{service.done()}"


@pytest.mark.parametrize("name", RESULTS)
def test_every_file_comes_as_it_is(service, job, name):
    data, media_type = RESULTS[name]
    response = service.http.get(f"{job}/files/{name}")
    assert response.content == data
    assert response.headers["content-type"] == media_type
    assert response.headers["etag"] == f'"{hashlib.sha256(data).hexdigest()}"'
    assert "immutable" in response.headers["cache-control"]
    head = service.http.head(f"{job}/files/{name}")
    assert head.content == b""
    for header in ("content-length", "etag", "content-type", "content-disposition"):
        assert head.headers[header] == response.headers[header]


def test_the_list_of_files_leads_to_each(service, job):
    for file in service.http.get(f"{job}/files").json()["items"]:
        response = service.http.get(file["link"])
        assert len(response.content) == file["size"]
        assert response.headers["etag"].strip('"') == file["sha256"]


def test_pages_are_shown_and_meshes_saved(service, job):
    kinds = {
        name: service.http.get(f"{job}/files/{name}").headers["content-disposition"]
        for name in ("report.html", "pictures/silhouettes.png", "lod0.obj", "input/mesh.obj")
    }
    assert kinds["report.html"].startswith("inline")
    assert kinds["pictures/silhouettes.png"] == 'inline; filename="silhouettes.png"'
    assert kinds["lod0.obj"].startswith("attachment")
    assert kinds["input/mesh.obj"].startswith("attachment")


@pytest.mark.parametrize(
    ("header", "status", "content"),
    [
        ("bytes=4-7", 206, GLB[4:8]),
        ("bytes=-5", 206, GLB[-5:]),
        ("bytes=9000-", 206, GLB[9000:]),
        ("bytes=0-1,3-4", 200, GLB),
    ],
)
def test_a_part_is_sent_as_one(service, job, header, status, content):
    response = service.http.get(f"{job}/files/occluder.glb", headers={"Range": header})
    assert (response.status_code, response.content) == (status, content)
    assert response.headers["content-length"] == str(len(content))
    if status == 206:
        start = GLB.index(content)
        told = f"bytes {start}-{start + len(content) - 1}/{len(GLB)}"
        assert response.headers["content-range"] == told


def test_a_part_beyond_the_end_is_refused(service, job):
    response = service.http.get(f"{job}/files/lod0.glb", headers={"Range": "bytes=99-"})
    problem(response, 416, "range-not-satisfiable")
    assert response.headers["content-range"] == "bytes */5"


def test_a_file_that_is_there_is_not_sent_again(service, job):
    etag = service.http.get(f"{job}/files/lod0.obj").headers["etag"]
    response = service.http.get(f"{job}/files/lod0.obj", headers={"If-None-Match": etag})
    assert (response.status_code, response.content) == (304, b"")
    assert response.headers["etag"] == etag


def test_a_file_that_is_not_there_is_told(service, job):
    for name in ("lod9.glb", "../occluder.db", "%2e%2e/%2e%2e/occluder.db", "input"):
        assert service.http.get(f"{job}/files/{name}").status_code == 404
    problem(service.http.get("/v1/jobs/none/files/lod0.obj"), 404, "not-found")


def test_the_result_comes_in_the_format_that_is_asked_for(service, job):
    result = service.http.get(f"{job}/result", headers={"Accept": "application/json"}).json()
    assert result["job"]["links"]["self"] == job
    page = service.http.get(f"{job}/result", headers={"Accept": "text/html"})
    assert page.text == RESULTS["report.html"][0].decode()
    obj = service.http.get(f"{job}/result", headers={"Accept": "model/obj"})
    assert obj.content == OBJ
    assert "Accept" in obj.headers["vary"]
    assert "immutable" not in obj.headers["cache-control"]
    answer = service.http.get(f"{job}/result", headers={"Accept": "model/ply"})
    problem(answer, 406, "not-acceptable")


def test_there_is_no_result_before_the_job_has_succeeded(service):
    job_id = service.queued()
    told = problem(service.http.get(f"/v1/jobs/{job_id}/result"), 409, "conflict")
    assert told["job"] == f"/v1/jobs/{job_id}"
    service.hand.begin()
    service.hand.fail("out-of-time")
    told = problem(service.http.get(f"/v1/jobs/{job_id}/result"), 409, "conflict")
    assert told["failure"]["kind"] == "out-of-time"


@pytest.mark.parametrize("lost", ["report.json", "occluder.glb"])
def test_a_result_that_has_lost_a_file_is_made_again(tmp_path, lost):
    with served(tmp_path) as fresh:
        first = fresh.post().json()["id"]
        fresh.hand.begin()
        fresh.hand.succeed()
        assert fresh.post().json()["job"]["reused"] == first
        files = {one.name: one for one in fresh.services.jobs.files(first)}
        fresh.hand.blobs.path(files[lost].blob).unlink()
        again = fresh.post()
        assert (again.status_code, again.json()["state"]) == (202, "queued")
        fresh.hand.begin()
        fresh.hand.succeed()
        stored = fresh.post()
        assert stored.status_code == 200
        glb = fresh.post(headers={"Accept": "model/gltf-binary"})
        assert glb.content == GLB


@pytest.mark.parametrize("ranged", [False, True])
@pytest.mark.parametrize("name", ["occluder.glb", "input/mesh.obj"])
def test_a_damaged_file_breaks_the_connection_and_is_then_gone(tmp_path, caplog, name, ranged):
    with served(tmp_path) as fresh:
        large = b"# " + b"x" * 300_000 + b"\n" + OBJ
        job_id = fresh.post(body=large).json()["id"]
        fresh.hand.begin()
        fresh.hand.succeed()
        files = {one.name: one for one in fresh.services.jobs.files(job_id)}
        flip(fresh.hand.blobs.path(files[name].blob))
        address = f"/v1/jobs/{job_id}/files/{name}"
        part = {"Range": "bytes=-5"} if ranged else {}
        with pytest.raises(httpx.RemoteProtocolError):
            fresh.http.get(address, headers=part)
        assert "broken off" in caplog.text
        assert "Traceback" not in caplog.text
        problem(fresh.http.get(address), 404, "not-found")
        text = fresh.http.get("/metrics").text
        assert "occluder_broken_reads_total 1.0" in text
        assert "occluder_corrupt_blobs 1.0" in text
        # Whoever sends it again has it done again, or done at all.
        again = fresh.post(body=large)
        if name.startswith("input"):
            assert again.status_code == 200
        else:
            fresh.hand.begin()
            fresh.hand.succeed()
        assert fresh.http.get(address).status_code == 200
        assert "occluder_corrupt_blobs 0.0" in fresh.http.get("/metrics").text


@pytest.mark.parametrize("name", RESULTS)
def test_a_damaged_result_is_not_given_again(tmp_path, name):
    """Though nobody has read it yet since it rotted."""
    sent = OBJ + b"# no file of the result\n"
    with served(tmp_path) as fresh:
        first = fresh.post(body=sent).json()["id"]
        fresh.hand.begin()
        fresh.hand.succeed()
        files = {one.name: one for one in fresh.services.jobs.files(first)}
        flip(fresh.hand.blobs.path(files[name].blob))
        again = fresh.post(body=sent)
        assert (again.status_code, again.json()["state"]) == (202, "queued")
        fresh.hand.begin()
        fresh.hand.succeed()
        assert fresh.post(body=sent).status_code == 200


def test_a_damaged_report_is_not_told(tmp_path):
    with served(tmp_path) as fresh:
        first = fresh.post().json()["id"]
        fresh.hand.begin()
        fresh.hand.succeed()
        files = {one.name: one for one in fresh.services.jobs.files(first)}
        flip(fresh.hand.blobs.path(files["report.json"].blob), 5)
        told = problem(fresh.http.get(f"/v1/jobs/{first}/result"), 404, "not-found")
        assert "report.json" in told["detail"]
        assert fresh.post().status_code == 202


def test_a_blob_that_is_gone_is_told(service):
    job_id = service.done()
    service.hand.blobs.path(service.services.jobs.files(job_id)[-1].blob).unlink()
    name = service.services.jobs.files(job_id)[-1].name
    problem(service.http.get(f"/v1/jobs/{job_id}/files/{name}"), 404, "not-found")
