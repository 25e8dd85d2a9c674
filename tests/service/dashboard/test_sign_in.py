"""Pages and the API behind one cookie."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass

import httpx
import pytest
from nicegui import __version__ as nicegui_version
from playwright.sync_api import Page, expect

from service.access.key import Scope
from service.access.session import COOKIE
from service.storage.key_store import SqlKeyStore
from service.storage.sqlite import SqliteDatabase
from tests.service.dashboard.chromium import Watch
from tests.service.dashboard.serving import IDLE, served
from tests.waiting import BUSY, until


@dataclass(frozen=True)
class Keyed:
    """A service that needs keys: its address, and an artist's key."""

    address: str
    keys: SqlKeyStore
    artist: str


@pytest.fixture(scope="module")
def keyed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Keyed]:
    folder = tmp_path_factory.mktemp("data")
    with closing(SqliteDatabase.open(folder / "occluder.db")) as database:
        keys = SqlKeyStore(database)
        _, secret = keys.create("studio", "artist", Scope.WRITE)
        with served(
            "tests.service.dashboard.application:make_app()",
            {"OCCLUDER_DATA": str(folder), "OCCLUDER_REQUIRE_KEYS": "true",
             "OCCLUDER_WORKERS": "1", "OCCLUDER_MIN_FREE": "0", **IDLE},
        ) as address:  # fmt: skip
            yield Keyed(address, keys, secret)


def sign_in(keyed: Keyed, secret: str, **fields: str) -> httpx.Response:
    return httpx.post(f"{keyed.address}/sign-in", data={"key": secret, **fields}, timeout=BUSY)


def test_a_page_asks_to_sign_in_and_comes_back_to_where_one_was(keyed: Keyed) -> None:
    answer = httpx.get(f"{keyed.address}/?find=a%26b", timeout=BUSY)
    assert answer.status_code == 303
    assert answer.headers["location"] == "/sign-in?next=%2F%3Ffind%3Da%2526b"
    signed = sign_in(keyed, keyed.artist, next="/?find=a%26b")
    assert (signed.status_code, signed.headers["location"]) == (303, "/?find=a%26b")


@pytest.mark.parametrize(
    "elsewhere",
    ["https://evil.example/", "//evil.example", "/\\evil.example", "/\t/evil.example", "jobs", ""],
)
def test_signing_in_leads_nowhere_else(keyed: Keyed, elsewhere: str) -> None:
    assert sign_in(keyed, keyed.artist, next=elsewhere).headers["location"] == "/"


def test_the_cookie_is_kept_from_scripts_and_other_sites_and_holds_no_key(keyed: Keyed) -> None:
    cookie = sign_in(keyed, keyed.artist).headers["set-cookie"]
    assert cookie.startswith(f"{COOKIE}=")
    assert keyed.artist not in cookie
    assert {"HttpOnly", "SameSite=strict", "Path=/"} <= {part.strip() for part in cookie.split(";")}


def test_a_wrong_key_is_told_plainly_and_gives_no_cookie(keyed: Keyed) -> None:
    answer = sign_in(keyed, "occ_<b>wrong</b>", next='/"><script>')
    assert answer.status_code == 401
    assert "This key is not known, was revoked or has expired." in answer.text
    assert "set-cookie" not in answer.headers
    assert "<script" not in answer.text
    assert "script-src" not in answer.headers["content-security-policy"]


def test_the_cookie_opens_the_api_for_pages_of_this_service_only(keyed: Keyed) -> None:
    token = sign_in(keyed, keyed.artist).cookies[COOKIE]
    with httpx.Client(base_url=keyed.address, cookies={COOKIE: token}, timeout=BUSY) as http:
        assert http.get("/v1/jobs").status_code == 200
        body = {"name": "castle"}
        evil = {"Origin": "http://evil.example"}
        assert http.put("/v1/assets", json=body, headers=evil).status_code == 403
        crossed = {"Sec-Fetch-Site": "cross-site"}
        assert http.put("/v1/assets", json=body, headers=crossed).status_code == 403
        own = {"Origin": keyed.address, "Sec-Fetch-Site": "same-origin"}
        assert http.put("/v1/assets", json=body, headers=own).status_code == 201


def test_a_cookie_that_was_signed_out_opens_nothing_though_somebody_kept_it(keyed: Keyed) -> None:
    token = sign_in(keyed, keyed.artist).cookies[COOKIE]
    kept = {"Cookie": f"{COOKIE}={token}"}
    for status in (200, 401):
        assert (
            httpx.get(f"{keyed.address}/v1/jobs", headers=kept, timeout=BUSY).status_code == status
        )
        assert (
            httpx.post(f"{keyed.address}/sign-out", headers=kept, timeout=BUSY).status_code == 303
        )


def test_what_the_api_knows_stays_its_own(keyed: Keyed) -> None:
    with httpx.Client(base_url=keyed.address, timeout=BUSY) as http:
        assert http.get("/v1/nothing").headers["content-type"] == "application/problem+json"
        assert http.delete("/v1/jobs").status_code == 405
        assert http.get("/redoc").status_code == 404
        assert http.get("/healthz").status_code == 200


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [
        ("GET", "/_nicegui/{version}/static/none.js", 404),
        ("GET", "/_nicegui/{version}/components/none", 404),
        ("POST", "/_nicegui/{version}/static/none.js", 405),
        ("GET", "/_nicegui_ws/none", 404),
        ("GET", "/_nicegui_ws/socket.io/?EIO=1", 400),
        ("GET", "/compare", 422),
        ("GET", "/docs/swagger/none.js", 404),
        ("POST", "/docs", 405),
        ("PUT", "/sign-in", 405),
        ("POST", "/sign-in", 422),
    ],
)
def test_what_frameworks_refuse_is_a_problem_too(
    keyed: Keyed, method: str, path: str, status: int
) -> None:
    headers = {"X-API-Key": keyed.artist}
    address = f"{keyed.address}{path.format(version=nicegui_version)}"
    answer = httpx.request(method, address, headers=headers, timeout=BUSY)
    assert answer.headers["content-type"] == "application/problem+json"
    assert (answer.status_code, answer.json()["status"]) == (status, status)
    assert status != 405 or answer.headers["allow"]


def test_a_form_that_goes_on_and_on_is_not_read_by_the_sign_in(keyed: Keyed) -> None:
    form = {f"field{number}": "x" * 1000 for number in range(100)}
    answer = httpx.post(f"{keyed.address}/sign-in", data=form, timeout=BUSY)
    assert answer.status_code == 413


def test_the_socket_needs_the_session_too(keyed: Keyed) -> None:
    path = "/_nicegui_ws/socket.io/?EIO=4&transport=polling"
    assert httpx.get(f"{keyed.address}{path}", timeout=BUSY).status_code == 401


@pytest.mark.vital
def test_one_signs_in_works_and_signs_out(keyed: Keyed, page: Page, watch: Watch) -> None:
    watch.expect("401")
    page.goto(f"{keyed.address}/")
    page.get_by_label("API key").fill("occ_nobody")
    page.get_by_role("button", name="Sign in").click()
    told = "This key is not known, was revoked or has expired."
    expect(page.get_by_role("alert")).to_have_text(told)
    page.get_by_label("API key").fill(keyed.artist)
    page.keyboard.press("Enter")
    expect(page.get_by_role("heading", name="Overview")).to_be_visible()
    expect(page.get_by_text("studio, write")).to_be_visible()
    assert page.evaluate("fetch('/v1/jobs').then(answer => answer.status)") == 200
    page.get_by_role("button", name="Sign out").click()
    expect(page.get_by_role("heading", name="Sign in")).to_be_visible()
    page.goto(f"{keyed.address}/")
    expect(page).to_have_url(f"{keyed.address}/sign-in?next=%2F")


def test_the_colours_that_one_chose_are_remembered(keyed: Keyed, page: Page) -> None:
    page.goto(f"{keyed.address}/sign-in")
    page.get_by_label("API key").fill(keyed.artist)
    page.keyboard.press("Enter")
    page.get_by_label("Colours").click()
    page.get_by_role("option", name="Dark").click()
    expect(page.locator("body.body--dark")).to_be_visible()
    page.wait_for_function("document.cookie.includes('dark')")
    page.reload()
    expect(page.locator("body.body--dark")).to_be_visible()


def test_a_revoked_key_ends_its_sessions(keyed: Keyed) -> None:
    key, secret = keyed.keys.create("studio", "leaver", Scope.READ)
    token = sign_in(keyed, secret).cookies[COOKIE]
    with httpx.Client(base_url=keyed.address, cookies={COOKIE: token}, timeout=BUSY) as http:
        assert http.get("/").status_code == 200
        keyed.keys.revoke(key.id)
        until(lambda: http.get("/v1/jobs").status_code != 200)
        assert http.get("/").status_code == 303
