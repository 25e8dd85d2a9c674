"""Uploads, in pieces of any size: what is stored and what is refused."""

from __future__ import annotations

import asyncio
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from starlette.requests import ClientDisconnect, Request

from service.errors import (
    BadRequestError,
    InvalidOptionsError,
    InvalidOverridesError,
    ServiceError,
    TooLargeError,
    UnreadableMeshError,
    UnsupportedMediaTypeError,
    UploadTimeoutError,
)
from service.jobs.job import JobFile
from service.settings import Settings
from service.storage.blobs.file_blobs import FileBlobs
from service.uploads import body as body_module
from service.uploads.receiving import UploadedFile, Uploads, Wanted, receive
from tests.service.storage.blobs.blob_store_contract import blob_of

MESH = Wanted("mesh", (".glb", ".obj", ".ply", ".stl"))
OCCLUDER = Wanted("occluder", (".glb", ".obj"))
OVERRIDES = Wanted("overrides", (".toml",), needed=False, largest=10, fault=InvalidOverridesError)
BOUNDARY = "a-boundary"


@pytest.fixture
def store(tmp_path):
    return FileBlobs(tmp_path)


def request_of(pieces, query="", ends=True, **headers):
    """A request whose body comes in these pieces; one that does not end breaks off after them."""
    messages = [{"type": "http.request", "body": piece, "more_body": True} for piece in pieces]
    last = {"type": "http.request"} if ends else {"type": "http.disconnect"}
    coming = iter([*messages, last])

    async def receive_message():
        message = next(coming)
        if callable(message.get("body")):
            message["body"] = await message["body"]()
        return message

    raw = [(name.replace("_", "-").encode(), value.encode()) for name, value in headers.items()]
    scope = {"type": "http", "headers": raw, "query_string": query.encode()}
    return Request(scope, receive_message)


def received(store, request, wanted=(MESH,), **limits) -> Uploads:
    async def main():
        with store.keeping() as keeping:
            return await receive(request, keeping, wanted, Settings(**limits))

    return asyncio.run(main())


def part(name, content=b"", filename=None, **headers):
    label = "" if filename is None else f'; filename="{filename}"'
    lines = [f'Content-Disposition: form-data; name="{name}"{label}']
    lines += [f"{key.replace('_', '-')}: {value}" for key, value in headers.items()]
    return "\r\n".join([f"--{BOUNDARY}", *lines, "", ""]).encode() + content + b"\r\n"


END = f"--{BOUNDARY}--\r\n".encode()
GOOD = part("mesh", b"x", "a.obj")


def form(*parts, **headers):
    kind = f"multipart/form-data; boundary={BOUNDARY}"
    return request_of([b"".join(parts) + END], content_type=kind, **headers)


def test_a_body_is_stored_as_it_is(store):
    request = request_of([b"o cas", b"tle"], "filename=props%2Fcastle.OBJ")
    uploads = received(store, request)
    assert uploads == Uploads(
        {"mesh": UploadedFile("mesh", "castle.OBJ", ".obj", blob_of(b"o castle"))}, {}
    )
    assert uploads.files["mesh"].job_file == JobFile(
        "input/mesh.obj", blob_of(b"o castle"), "model/obj", is_input=True, label="castle.OBJ"
    )


@pytest.mark.parametrize(
    ("query", "media_type", "label", "suffix"),
    [
        ("", "model/gltf-binary", "mesh.glb", ".glb"),
        ("", "Application/SLA; charset=x", "mesh.stl", ".stl"),
        ("filename=a.ply", "model/gltf-binary", "a.ply", ".ply"),
        ("filename=castle.v2", "model/obj", "castle.v2", ".obj"),
        ("filename=..", "model/obj", "mesh.obj", ".obj"),
        ("filename=a.obj", "application/x-www-form-urlencoded", "a.obj", ".obj"),
    ],
)
def test_the_name_says_the_format_before_the_media_type(store, query, media_type, label, suffix):
    upload = received(store, request_of([b"x"], query, content_type=media_type)).files["mesh"]
    assert (upload.label, upload.suffix) == (label, suffix)


@pytest.mark.parametrize(
    ("query", "headers", "said"),
    [
        ("", {}, "told by the request"),
        ("filename=a.fbx", {}, "told by the name 'a.fbx'"),
        ("filename=a.off", {"content_type": "model/off"}, "'a.off' or the media type 'model/off'"),
        ("", {"content_type": "text/plain"}, "told by the media type 'text/plain'"),
    ],
)
def test_an_unknown_format_is_refused_with_those_that_are_known(store, query, headers, said):
    with pytest.raises(UnsupportedMediaTypeError, match=said) as caught:
        received(store, request_of([b"x"], query, **headers))
    assert ".glb (model/gltf-binary), .obj (model/obj), .ply" in caught.value.remedy
    assert caught.value.headers["Connection"] == "close"


def test_parts_go_where_they_belong(store):
    request = form(
        part("options", b'{"budget": 32}', Content_Type="application/json"),
        part("mesh", b"mesh\r\n--a-bound", filename="C:\\models\\castle.glb"),
        part("occluder", b"occluder", Content_Type="model/obj"),
        part("asset", "Schloß".encode(), filename="as_file.txt"),
    )
    uploads = received(store, request, (MESH, OCCLUDER))
    assert uploads.texts == {"options": '{"budget": 32}', "asset": "Schloß"}
    assert uploads.files == {
        "mesh": UploadedFile("mesh", "castle.glb", ".glb", blob_of(b"mesh\r\n--a-bound")),
        "occluder": UploadedFile("occluder", "occluder.obj", ".obj", blob_of(b"occluder")),
    }


def test_a_file_that_may_be_missing_is_stored_where_it_comes(store):
    wanted = (MESH, OVERRIDES)
    assert set(received(store, request_of([b"x"], "filename=a.obj"), wanted).files) == {"mesh"}
    assert set(received(store, form(GOOD), wanted).files) == {"mesh"}
    for label in ("keep.overrides.toml", "keep"):
        more = part("overrides", b"0123456789", label, Content_Type="application/toml")
        files = received(store, form(more, GOOD), wanted).files
        assert files["overrides"].job_file == JobFile(
            "input/overrides.toml", blob_of(b"0123456789"), "application/toml", True, label
        )


@pytest.mark.parametrize(
    ("content", "label", "kind", "said"),
    [
        (b"0123456789a", "a.toml", TooLargeError, "'overrides' may have 10 bytes"),
        (b"", "a.toml", InvalidOverridesError, "the overrides file is empty"),
        (b"x", "a.json", UnsupportedMediaTypeError, "told by the name 'a.json'"),
    ],
)
def test_it_has_limits_of_its_own(store, tmp_path, content, label, kind, said):
    more = part("overrides", content, label)
    with pytest.raises(kind, match=said) as caught:
        received(store, form(GOOD, more, part("asset", b"x" * 100)), (MESH, OVERRIDES))
    assert caught.value.remedy
    assert caught.value.headers["Connection"] == "close"
    assert list((tmp_path / "drafts").iterdir()) == []


# What looks like a boundary, or nearly.
TOKENS = [b"\r\n", b"\r", b"\n", b"--", f"\r\n--{BOUNDARY[:-1]}".encode(), b"--x", b"\0" * 50]


contents = st.lists(st.sampled_from(TOKENS), min_size=1, max_size=12).map(b"".join)


def test_however_the_body_is_cut_the_same_is_stored(store):
    kind = f"multipart/form-data; boundary={BOUNDARY}"

    @settings(max_examples=150, deadline=None)
    @given(contents, st.data())
    def check(content, data):
        whole = part("mesh", content, "a.obj") + part("options", b"{}") + END + b"epilogue"
        cuts = sorted(data.draw(st.sets(st.integers(0, len(whole)), max_size=8)))
        pieces = [whole[a:b] for a, b in pairwise([0, *cuts, len(whole)])]
        uploads = received(store, request_of(pieces, content_type=kind))
        assert uploads.files["mesh"].blob == blob_of(content)
        assert uploads.texts == {"options": "{}"}

    check()


FORM = "multipart/form-data; boundary=a-boundary"
REFUSED = {
    "no boundary": (BadRequestError, "no boundary", "multipart/form-data", GOOD + END),
    "too long a boundary": (BadRequestError, "malformed", f"{FORM}{'x' * 300}", GOOD + END),
    "another boundary": (BadRequestError, "malformed", FORM + "2", GOOD + END),
    "nothing": (BadRequestError, "ends before", FORM, b""),
    "no end": (BadRequestError, "ends before", FORM, GOOD),
    "an end in the file": (BadRequestError, "ends before", FORM, GOOD[:-2]),
    "an end in the headers": (BadRequestError, "ends before", FORM, GOOD[:40]),
    "no parts": (BadRequestError, "no part 'mesh'", FORM, END),
    "no mesh": (BadRequestError, "no part 'mesh'", FORM, part("options", b"{}") + END),
    "two meshes": (BadRequestError, "'mesh' comes twice", FORM, GOOD + GOOD + END),
    "two options": (BadRequestError, "twice", FORM, part("options") + part("options") + END),
    "no name": (BadRequestError, "no name", FORM, part("") + END),
    "a bad header": (BadRequestError, "malformed", FORM, b"--a-boundary\r\n(\r\n\r\n" + END),
    "a long header": (BadRequestError, "malformed", FORM, part("mesh", X="x" * 99_999) + END),
    "base64": (
        BadRequestError, "sent as base64", FORM,
        part("mesh", b"eA==", "a.obj", Content_Transfer_Encoding="base64") + END,
    ),
    "bad text": (BadRequestError, "UTF-8", FORM, part("options", b"\xff") + END),
    "much text": (TooLargeError, "65,536", FORM, part("options", b"x" * 65_537) + END),
    "an unknown part": (InvalidOptionsError, "no such part", FORM, part("virus", b"x") + END),
    "an unknown format": (
        UnsupportedMediaTypeError, "'a.exe'", FORM, part("mesh", b"x", "a.exe") + END,
    ),
    "an empty file": (UnreadableMeshError, "empty", FORM, part("mesh", b"", "a.obj") + END),
    "an empty body": (UnreadableMeshError, "empty", "model/obj", b""),
}  # fmt: skip


@pytest.mark.parametrize(("kind", "said", "media_type", "content"), REFUSED.values(), ids=REFUSED)
def test_what_is_refused_says_why_and_leaves_no_draft(
    store, tmp_path, kind, said, media_type, content
):
    with pytest.raises(ServiceError, match=said) as caught:
        received(store, request_of([content], content_type=media_type))
    assert type(caught.value) is kind
    assert caught.value.remedy
    assert list((tmp_path / "drafts").iterdir()) == []


def test_there_are_at_most_sixteen_parts(store, monkeypatch):
    many = [part("mesh" if i == 0 else f"text{i}", b"x", "a.obj") for i in range(17)]
    monkeypatch.setattr("service.uploads.receiving.TEXTS", [f"text{i}" for i in range(1, 17)])
    received(store, form(*many[:16]))
    with pytest.raises(BadRequestError, match="more than 16 parts"):
        received(store, form(*many))


def test_two_files_need_parts(store):
    with pytest.raises(UnsupportedMediaTypeError, match="'mesh' and 'occluder' are needed"):
        received(store, request_of([b"x"], "filename=a.obj"), (MESH, OCCLUDER))


async def never():
    pytest.fail("the body was read")


@pytest.mark.parametrize(
    ("headers", "kind"),
    [
        ({"content_length": "1001"}, TooLargeError),
        ({"content_encoding": "gzip"}, UnsupportedMediaTypeError),
        ({"content_type": "application/pdf"}, UnsupportedMediaTypeError),
    ],
    ids=repr,
)
def test_what_the_headers_tell_is_refused_before_the_body_is_read(store, headers, kind):
    with pytest.raises(kind) as caught:
        received(store, request_of([never], **headers), max_upload=1000)
    assert caught.value.headers["Connection"] == "close"


def test_an_untold_length_is_counted(store, tmp_path):
    pieces = [b"x" * 400] * 2 + [b"y" * 200]
    received(store, request_of(pieces, "filename=a.obj"), max_upload=1000)
    with pytest.raises(TooLargeError, match=r"1,000 bytes"):
        received(store, request_of([*pieces, b"z", never], "filename=a.obj"), max_upload=1000)
    assert list((tmp_path / "drafts").iterdir()) == []


def test_a_body_that_was_read_to_its_end_leaves_the_connection_open(store):
    with pytest.raises(BadRequestError, match="no part 'mesh'") as caught:
        received(store, form(part("options", b"{}")))
    assert "Connection" not in caught.value.headers


def test_a_client_that_leaves_leaves_nothing_behind(store, tmp_path):
    with pytest.raises(ClientDisconnect):
        received(store, request_of([b"x" * 3_000_000], "filename=a.obj", ends=False))
    assert list((tmp_path / "drafts").iterdir()) == []
    assert list(store.digests()) == []


def test_silence_ends_an_upload(store):
    async def silence():
        await asyncio.Event().wait()

    with pytest.raises(UploadTimeoutError, match=r"nothing came for 0.05 seconds, after 1 bytes"):
        received(store, request_of([b"x", silence], "filename=a.obj"), upload_idle_seconds=0.05)


def test_a_trickle_ends_after_the_grace(store, monkeypatch):
    async def late():
        await asyncio.sleep(0.02)
        return b"x"

    monkeypatch.setattr(body_module, "_GRACE", 0.05)
    trickle = [late] * 10
    with pytest.raises(UploadTimeoutError, match="less than 1,024 a second"):
        received(store, request_of(trickle, "filename=a.obj"), min_upload_rate=1024)
    received(store, request_of(trickle, "filename=a.obj"), min_upload_rate=0)
