"""All results of a job as one zip, over HTTP and piece by piece."""

from __future__ import annotations

import io
import os
import zipfile

import httpx
import pytest

from service.answers.zipped import send_zip
from service.jobs.job import Blob, Job, JobFile
from tests.service.routes.serving import RESULTS, problem, served
from tests.service.storage.blobs.rot import flip


@pytest.fixture(scope="module")
def service(tmp_path_factory):
    with served(tmp_path_factory.mktemp("zipped")) as running:
        yield running


def unpacked(data):
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        assert archive.testzip() is None
        return {name: archive.read(name) for name in archive.namelist()}


def test_every_result_is_there_and_nothing_that_was_sent(service):
    address = f"/v1/jobs/{service.done('/v1/occluders?filename=castle.obj')}/files.zip"
    answer = service.http.get(address)
    assert answer.headers["content-type"] == "application/zip"
    assert 'filename="castle_occluder.zip"' in answer.headers["content-disposition"]
    assert "content-length" not in answer.headers
    assert unpacked(answer.content) == {
        f"castle/{name}": data for name, (data, _) in RESULTS.items()
    }
    assert service.http.get(address).content == answer.content


@pytest.mark.parametrize(
    ("sent", "plain", "folder"),
    [
        ("schloß.obj", "schlo_", "schloß"),
        ("a:b*c?.obj", "a_b_c_", "a_b_c_"),
        ('"; x=y.obj', "_; x=y", "_; x=y"),
        (f"{'n' * 150}.obj", "n" * 100, "n" * 100),
    ],
)
def test_names_are_right_on_every_system(service, sent, plain, folder):
    job = service.done(str(httpx.URL("/v1/occluders", params={"filename": sent})))
    answer = service.http.get(f"/v1/jobs/{job}/files.zip")
    told = answer.headers["content-disposition"]
    assert f'filename="{plain}_occluder.zip"' in told
    assert {name.partition("/")[0] for name in unpacked(answer.content)} == {folder}


def test_what_has_not_succeeded_has_none(service):
    job = service.queued()
    problem(service.http.get(f"/v1/jobs/{job}/files.zip"), 409, "conflict")
    service.hand.begin()
    service.hand.fail()
    problem(service.http.get(f"/v1/jobs/{job}/files.zip"), 409, "conflict")
    problem(service.http.get("/v1/jobs/none/files.zip"), 404, "not-found")


@pytest.mark.parametrize("harm", [lambda path: flip(path), lambda path: path.unlink()])
def test_damage_breaks_the_zip_off(service, harm):
    job = service.done()
    files = {one.name: one for one in service.services.jobs.files(job)}
    harm(service.hand.blobs.path(files["report.json"].blob))
    with pytest.raises(httpx.RemoteProtocolError):
        service.http.get(f"/v1/jobs/{job}/files.zip")


class Counted(io.BytesIO):
    """A file; all of them count what is read."""

    bytes_ = 0

    def read(self, size=-1):
        assert 0 < size <= 1 << 20
        data = super().read(size)
        Counted.bytes_ += len(data)
        return data


class ManyFiles:
    """Blobs of a megabyte that do not pack."""

    def open(self, blob):
        return Counted(os.urandom(1 << 20))


@pytest.mark.anyio
async def test_it_is_read_as_it_is_sent(service):
    whole = service.services.jobs.job(None, service.done())
    assert isinstance(whole, Job)
    files = [JobFile(f"{n}", Blob("0" * 64, 1 << 20), "x/y") for n in range(50)]
    sent = 0
    async for chunk in send_zip(ManyFiles(), whole, files).body_iterator:
        sent += len(chunk)
        assert len(chunk) < 1 << 20
        assert Counted.bytes_ <= sent + (1 << 20)
    assert sent > 50 << 20
