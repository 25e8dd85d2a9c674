"""The whole service, from a mesh to its occluders, with real workers and over real connections."""

from __future__ import annotations

import json
import queue
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from http.server import BaseHTTPRequestHandler, HTTPServer

import httpx
import pytest
from prometheus_client.parser import text_string_to_metric_families

import simplifier
from service.app import create_app
from service.settings import Settings
from tests.service.routes.serving import listening, problem
from tests.service.webhooks.receivers import receiving
from tests.waiting import until

HOUSE = (
    b"v 0 0 0\nv 2 0 0\nv 2 0 2\nv 0 0 2\nv 0 2 0\nv 2 2 0\nv 2 2 2\nv 0 2 2\nv 1 3 1\n"
    b"f 1 2 3 4\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n"
    b"f 5 9 6\nf 6 9 7\nf 7 9 8\nf 8 9 5\n"
)
QUICK = {"preset": "draft", "budget": 12, "resolution": 24, "views": 16, "image": 64, "quads": 500}


@pytest.fixture(scope="module")
def http(tmp_path_factory):
    settings = Settings(
        data=tmp_path_factory.mktemp("service") / "data", workers=1, min_free=0,
        webhook_private=True,
    )  # fmt: skip
    with (
        listening(create_app(settings)) as address,
        httpx.Client(base_url=address, timeout=120.0) as http,
    ):
        yield http


def test_a_mesh_goes_in_and_occluders_come_out(http):
    response = http.post(
        "/v1/occluders", params={**QUICK, "filename": "house.obj", "asset": "house"},
        content=HOUSE, headers={"Prefer": "wait=60"},
    )  # fmt: skip
    assert response.status_code == 200, response.text
    result = response.json()
    job, levels = result["job"], result["levels"]
    assert job["state"] == "succeeded"
    assert job["summary"]["precision"] > 0.9
    assert len(levels) >= 2
    assert all(level["recall"] > 0.2 for level in levels)
    assert levels[0]["triangles"] == job["summary"]["triangles"] <= 12
    for level in levels:
        for suffix, link in level["files"].items():
            file = http.get(link)
            assert file.status_code == 200, suffix
            assert int(file.headers["content-length"]) == len(file.content) > 0
    glb = http.get(job["links"]["result"], headers={"Accept": "model/gltf-binary"})
    assert glb.content.startswith(b"glTF")
    page = http.get(job["links"]["result"], headers={"Accept": "text/html"})
    assert "house" in page.text
    assert "sandbox" in page.headers["content-security-policy"]
    asset = http.get("/v1/assets?name=house").json()["items"][0]
    assert asset["latest"]["id"] == job["id"]
    metrics = http.get("/metrics").text
    assert 'occluder_asset_precision{asset="house"' in metrics
    assert 'occluder_job_seconds_count{kind="occluder",stage="refine"} 1.0' in metrics


def test_pages_are_drawn_when_somebody_asks_for_them_and_kept(http):
    done = http.post(
        "/v1/occluders", params={**QUICK, "filename": "drawn.obj", "asset": "drawn"},
        content=HOUSE + b"# drawn\n", headers={"Prefer": "wait=60"},
    ).json()  # fmt: skip
    job, pages = done["job"], done["pages"]
    place = f"/v1/jobs/{job['id']}/files"
    assert pages == {
        "report": f"{place}/report.html", "silhouettes": f"{place}/pictures/silhouettes.png",
        "recall": f"{place}/pictures/recall.png", "precision": f"{place}/pictures/precision.png",
    }  # fmt: skip
    before = {file["name"] for file in done["files"]}
    assert not any(name.startswith("pictures/") or name == "report.html" for name in before)
    assert {"original.glb", "lod0.glb", "report.json"} <= before
    with ThreadPoolExecutor(4) as pool:  # who asks at once is answered by one drawing
        page, *pictures = pool.map(http.get, pages.values())
    assert page.status_code == 200, page.text
    assert page.headers["content-type"] == "text/html; charset=utf-8"
    assert "<title>Occluder of drawn.obj" in page.text
    for picture in pictures:
        assert picture.content.startswith(b"\x89PNG")
    listed = {file["name"]: file for file in http.get(place).json()["items"]}
    made = set(listed) - before
    assert {"report.html", "pictures/silhouettes.png"} < made
    assert sum(name.startswith("pictures/view_") for name in made) == 6
    assert listed["report.html"]["sha256"] == page.headers["etag"].strip('"')
    again = http.get(pages["report"], headers={"If-None-Match": page.headers["etag"]})
    assert again.status_code == 304
    assert http.get(job["links"]["result"], headers={"Accept": "text/html"}).text == page.text
    problem(http.get(f"{place}/pictures/view_99_of_nothing.png"), 404, "not-found")
    problem(http.get(f"{place}/pictures/other.png"), 404, "not-found")
    copy = http.post(
        "/v1/occluders", params={**QUICK, "filename": "copy.obj"}, content=HOUSE + b"# drawn\n",
        headers={"Accept": "text/html", "Prefer": "wait=60"},
    )  # fmt: skip
    assert copy.text == page.text  # of the stored result, with its pages


def test_what_a_lean_job_has_not_stored_is_there_all_the_same(http, tmp_path):
    body = HOUSE + b"# lean\n"
    done = http.post(
        "/v1/occluders", params={**QUICK, "filename": "lean.obj", "keep": "lean"}, content=body,
        headers={"Prefer": "wait=60"},
    ).json()  # fmt: skip
    job = done["job"]
    stored = {"input/mesh.obj", "occluder.glb", "levels.npz", "report.json"}
    assert {file["name"] for file in done["files"]} == stored
    (tmp_path / "lean.obj").write_bytes(body)
    made = simplifier.simplify(simplifier.load(tmp_path / "lean.obj"), **QUICK, lods=3)
    for suffix in (".obj", ".glb", ".occ"):
        made.save(tmp_path / f"house{suffix}")
    assert len(done["levels"]) == len(made.chain.levels) >= 2
    for level in done["levels"]:
        file = http.get(level["files"]["obj"])
        assert file.content == (tmp_path / f"house_lod{level['level']}.obj").read_bytes()
    by_type = {"model/gltf-binary": "house.glb", "application/x-occluder": "house.occ"}
    for media_type, name in by_type.items():
        file = http.get(job["links"]["result"], headers={"Accept": media_type})
        assert file.content == (tmp_path / name).read_bytes()
    place = f"/v1/jobs/{job['id']}/files"
    page = http.get(f"{place}/report.html")
    assert "<title>Occluder of lean.obj" in page.text
    assert http.head(f"{place}/original.glb").headers["content-type"] == "model/gltf-binary"
    listed = http.get(place).json()
    there = {file["name"] for file in listed["items"]}
    assert there > stored | {"lod0.obj", "lod1.obj", "occluder.occ", "original.glb", "report.html"}
    later = {file["name"] for file in listed["on_demand"]}
    assert {"lod0.tres", "lod1.ply"} <= later
    assert not later & there
    problem(http.get(f"{place}/lod7.obj"), 404, "not-found")
    problem(http.get(f"{place}/lod0.fbx"), 404, "not-found")


def test_a_result_is_read_as_a_page_at_once(http):
    answer = http.post(
        "/v1/occluders", params={**QUICK, "filename": "page.obj"}, content=HOUSE + b"# page\n",
        headers={"Accept": "text/html", "Prefer": "wait=60"},
    )  # fmt: skip
    assert answer.status_code == 200
    assert "<title>Occluder of page.obj" in answer.text
    assert answer.text.count("data:image/png") >= 8
    head = http.head(f"{answer.headers['location']}/files/pictures/recall.png")
    assert (head.status_code, head.headers["content-type"]) == (200, "image/png")


def test_pages_of_another_are_not_drawn(http):
    problem(http.get("/v1/jobs/none/files/report.html"), 404, "not-found")


def test_a_receiver_is_told_when_the_job_has_ended(http):
    told = queue.Queue()

    class Receiver(BaseHTTPRequestHandler):
        def do_POST(self):
            told.put((self.headers, self.rfile.read(int(self.headers["Content-Length"]))))
            self.send_response(204)
            self.end_headers()

        def log_message(self, *_):
            pass

    with HTTPServer(("127.0.0.1", 0), Receiver) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        response = http.post(
            "/v1/occluders",
            params={**QUICK, "seed": 1, "filename": "a.obj",
                    "webhook": f"http://127.0.0.1:{server.server_port}/hook"},
            content=HOUSE,
        )  # fmt: skip
        headers, body = told.get(timeout=60)
        server.shutdown()
    word = json.loads(body)
    assert (headers["Occluder-Event"], word["event"]) == ("job.ended", "job.ended")
    assert word["id"] == headers["Occluder-Delivery"]
    assert word["job"] == http.get(response.headers["location"]).json()


def test_a_webhook_is_logged_and_sent_again_by_hand_under_its_id(http):
    with receiving((500, {})) as receiver:
        job = http.post(
            "/v1/occluders",
            params={**QUICK, "seed": 2, "filename": "a.obj", "webhook": receiver.url},
            content=HOUSE,
        ).json()

        def of_job():
            return next(iter(http.get(f"/v1/deliveries?job={job['id']}").json()["items"]), None)

        tried = until(lambda: (one := of_job()) and one["attempts"] and one)
        assert (tried["state"], tried["attempts"][0]["status"]) == ("waiting", 500)
        assert http.post(tried["redeliver"]).status_code == 202
        heard = until(lambda: (one := of_job())["state"] == "delivered" and one)
        assert [one["status"] for one in heard["attempts"]] == [500, 204]
        assert http.post(tried["redeliver"]).status_code == 202
        until(lambda: len(receiver.heard) == 3)
        until(lambda: len(of_job()["attempts"]) == 3)
    assert {json.loads(one.body)["id"] for one in receiver.heard} == {tried["id"]}
    assert {one.headers["occluder-delivery"] for one in receiver.heard} == {tried["id"]}


def test_a_file_that_is_no_mesh_is_refused_with_what_the_reader_found(http):
    response = http.post(
        "/v1/occluders?filename=noise.glb", content=b"noise" * 100, headers={"Prefer": "wait=60"}
    )
    body = problem(response, 400, "unreadable-mesh")
    assert "noise.glb" in body["detail"]
    failures = 'occluder_job_failures_total{failure="unreadable-mesh"} 1.0'
    # Counted by a thread of the engine, which may come after the answer.
    assert until(lambda: failures in http.get("/metrics").text)


def test_workers_disk_and_webhooks_are_told_to_prometheus(http):
    until(lambda: http.get("/readyz").status_code == 200)
    told = {
        (sample.name, *sample.labels.values()): sample.value
        for family in text_string_to_metric_families(http.get("/metrics").text)
        for sample in family.samples
    }
    workers = [told[f"occluder_workers_{one}",] for one in ("configured", "live", "busy")]
    assert workers == [1.0, 1.0, 0.0]
    assert told["occluder_disk_free_bytes",] > told["occluder_disk_reserve_bytes",] == 0.0
    assert told["occluder_webhook_attempts_total", "heard"] >= 2
    assert told["occluder_webhook_attempts_total", "failed"] >= 1
    assert told["occluder_http_responses_total", "GET", "/readyz", "200"] >= 1


def test_the_service_is_ready_and_shows_its_docs(http):
    until(lambda: http.get("/readyz").status_code == 200)
    assert http.get("/readyz").json()["checks"] == [
        "database",
        "blobs",
        "disk",
        "engine",
        "kernels",
    ]
    page = http.get("/docs")
    for path in ("/docs/start.js", "/docs/swagger/swagger-ui-bundle.js", "/openapi.json"):
        assert http.get(path).status_code == 200
    assert "http://" not in page.text
    assert "https://" not in page.text
    assert "script-src 'self'" in page.headers["content-security-policy"]


def test_a_page_of_another_site_may_not_submit(http):
    response = http.post("/v1/occluders", headers={"Origin": "http://evil.example"})
    problem(response, 403, "forbidden")


def test_the_server_never_imports_what_only_workers_need():
    heavy = "numpy", "numba", "scipy", "trimesh", "cv2", "matplotlib"
    found = f"[name for name in {heavy} if name in sys.modules]"
    code = f"import service.app, service.dashboard.mount, sys; print({found})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
