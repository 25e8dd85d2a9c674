"""The service keeps to ``openapi.yaml``: requests made from it, right and wrong, are all answered
as it says; no answer is a 500, and nothing undocumented comes.

Not checked: that whatever the schema allows is accepted.  It cannot say which options exclude each
other, nor that a file's name tells its format.
"""

from __future__ import annotations

import os
import threading

import pytest
import requests
import schemathesis
from hypothesis import HealthCheck, settings
from jsonschema import Draft202012Validator
from schemathesis.checks import load_all_checks
from schemathesis.specs.openapi.checks import negative_data_rejection, positive_data_acceptance

from service.access.key import Scope
from service.openapi import FILE
from service.routes.submit import RAW
from tests.service.routes.serving import served

load_all_checks()
schema = schemathesis.openapi.from_path(FILE)
EXAMPLES = int(os.environ.get("CONTRACT_EXAMPLES", "8"))
"""Of each operation, and of ways from answer to answer."""

KEYED = os.environ.get("CONTRACT_KEYED") == "1"
"""Whether the service asks for keys, and each request has one."""

schema.config.phases.coverage.enabled = EXAMPLES > 8  # a hundred cases of each, which take seconds

UPLOADS = {"/v1/occluders": "castle.obj", "/v1/scenes": "town.zip", "/v1/visibility": "town.zip"}
"""What takes a body that is a single file, and a name of one."""

LISTS = {
    one["name"]: Draft202012Validator(one["schema"])
    for path in UPLOADS
    for one in schema.raw_schema["paths"][path]["post"]["parameters"]
    if one["in"] == "query" and one["schema"].get("type") == "array"
}
"""Options that are lists, with commas between what is in them, and what these may be."""

HEADERS: dict[str, str] = {}
"""With each request that is made."""

BOUNDED = settings(
    deadline=None, derandomize=True, database=None, suppress_health_check=list(HealthCheck)
)


@schemathesis.serializer(*{kind for kinds in RAW.values() for kind in kinds})
def as_it_is(context, value):
    return value if isinstance(value, bytes) else str(value).encode("utf-8", "replace")


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    """A service whose jobs are done by a thread, each third of which fails."""
    folder = tmp_path_factory.mktemp("fuzzed")
    with served(folder, max_wait=0.2, queue_limit=100_000, require_keys=KEYED) as service:
        if KEYED:
            _, secret = service.keys.create("studio", "of the fuzz", Scope.ADMIN)
            HEADERS["Authorization"] = f"Bearer {secret}"
        stop = threading.Event()
        worker = threading.Thread(target=work, args=(service.hand, stop))
        worker.start()
        yield str(service.http.base_url)
        stop.set()
        worker.join()
        accepted = sum(service.services.jobs.counts().values())
    print(f"\n{accepted} jobs were accepted")


@pytest.fixture(scope="module")
def session(address):
    """One connection for all requests that keep to themselves: to open each anew took a third."""
    with requests.Session() as session:
        session.headers.update(HEADERS)
        yield session


def work(hand, stop):
    done = 0
    while not stop.wait(0.002):
        if hand.try_to_begin():
            done += 1
            hand.succeed() if done % 3 else hand.fail()


@schema.parametrize()
@settings(BOUNDED, max_examples=EXAMPLES)
def test_every_answer_is_as_documented(case, address, session):
    case.call_and_validate(base_url=address, session=session, excluded_checks=left_out(case))
    if case.operation.path in UPLOADS and case.method == "POST":
        make_acceptable(case)
        case.call_and_validate(base_url=address, session=session, excluded_checks=left_out(case))


def left_out(case):
    """Checks that say nothing of this request: in a query, a lone value is a list of one."""
    query = case.query or {}
    lone = any(is_list_of(LISTS[name], query[name]) for name in LISTS.keys() & query.keys())
    return [positive_data_acceptance, *([negative_data_rejection] if lone else [])]


def is_list_of(schema, value):
    """Whether what is no list becomes one in a query that the schema allows."""
    try:
        numbers = [float(one) for one in str(value).split(",")]
    except ValueError:
        return False
    return schema.is_valid(numbers)


def make_acceptable(case):
    """Nearly no request that is made at random is taken in: it needs bytes in a format that is told
    by a name, and options that go together.  So each upload comes once more with both, and one of
    its options."""
    options = sorted(set(case.query or {}) - {"asset", "webhook", "filename"})
    file = UPLOADS[case.operation.path]
    case.query = {name: case.query[name] for name in options[:1]} | {"filename": file}
    case.headers = {"Content-Type": "application/octet-stream"}
    case.media_type, case.body = "application/octet-stream", b"v 0 0 0\n"


def test_answers_lead_on_as_documented(address):
    class Machine(schema.as_state_machine()):
        def get_call_kwargs(self, case):
            return {"base_url": address, "headers": HEADERS}

        def validate_response(self, response, case, additional_checks=(), **kwargs):
            excluded = [positive_data_acceptance]
            case.validate_response(
                response, additional_checks=additional_checks, excluded_checks=excluded
            )

    Machine.run(settings=settings(BOUNDED, max_examples=EXAMPLES, stateful_step_count=8))
