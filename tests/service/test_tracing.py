"""One trace from a request over its job to its webhook, as a collector receives it."""

from __future__ import annotations

import gzip
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import httpx
import pytest
from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest

from service.tracing import SpanKind, span, traceparent
from tests.faults.serving import LIGHT_WORK, path_of_processes
from tests.service.real import BOX, QUICK, running
from tests.service.webhooks.receivers import receiving
from tests.waiting import until

OURS = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01"


@pytest.fixture
def declared(tmp_path):
    return path_of_processes(tmp_path / "declared")


@pytest.fixture
def collector():
    """What was received, as spans, and the address that they are sent to."""
    spans = []

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self):
            body = self.rfile.read(int(self.headers["content-length"]))
            if self.headers.get("content-encoding") == "gzip":
                body = gzip.decompress(body)
            told = ExportTraceServiceRequest.FromString(body)
            for resource in told.resource_spans:
                for scope in resource.scope_spans:
                    spans.extend(scope.spans)
            self.send_response(200)
            self.end_headers()

        def log_message(self, *_):
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.02,))
        thread.start()
        yield spans, f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


def test_a_request_its_job_and_its_webhook_are_one_trace(collector, declared, tmp_path):
    spans, address = collector
    with (
        receiving() as receiver,
        running(
            declared, tmp_path / "data", OCCLUDER_WEBHOOK_PRIVATE="true",
            OCCLUDER_DASHBOARD="false", FAULTS_WORK=str(LIGHT_WORK),
            OTEL_EXPORTER_OTLP_ENDPOINT=address, OTEL_BSP_SCHEDULE_DELAY="100",
        ) as server,
    ):  # fmt: skip
        done = httpx.post(
            f"{server.address}/v1/occluders", content=BOX, timeout=120.0,
            params={**QUICK, "filename": "box.obj", "webhook": receiver.url},
            headers={"Prefer": "wait=60", "traceparent": OURS},
        )  # fmt: skip
        assert done.json()["job"]["trace"].startswith(OURS[:36])
        httpx.get(f"{server.address}/healthz")
        until(lambda: receiver.heard)
        until(
            lambda: {"webhook", "job occluder", "POST /v1/occluders"} <= {one.name for one in spans}
        )
    trace = bytes.fromhex(OURS.split("-")[1])
    named = {one.name: one for one in spans if one.trace_id == trace}
    request = named["POST /v1/occluders"]
    assert request.parent_span_id.hex() == OURS.split("-")[2]
    assert named["job occluder"].parent_span_id == request.span_id
    assert named["webhook"].parent_span_id == request.span_id
    told = {one.key: one.value for one in named["job occluder"].attributes}
    assert told["occluder.state"].string_value == "succeeded"
    sent = receiver.heard[0].headers["traceparent"].split("-")
    assert sent[1:3] == [trace.hex(), named["webhook"].span_id.hex()]
    assert not [one for one in spans if "healthz" in one.name]


def test_nothing_is_traced_where_nobody_asks_for_it():
    with span("a", SpanKind.SERVER, OURS) as part:
        part.set_attribute("b", 1)
        part.update_name("c")
        assert traceparent() is None
