"""Every page under axe-core, as wide as a desk, a tablet and a phone, in light and in dark."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page, expect

from service.jobs.asset import Thresholds
from service.jobs.job import Failure
from tests.service.dashboard.chromium import Watch
from tests.service.dashboard.legibility import covered_texts, faint_texts, overflows
from tests.service.dashboard.results import JobResult
from tests.service.dashboard.screenshots import keep_picture
from tests.service.dashboard.serving import IDLE, served
from tests.service.dashboard.stock import stocked
from tests.waiting import BUSY

WIDTHS = {1440: 900, 820: 1180, 390: 844}
GRAVE = ("serious", "critical")
LONG = "props/medieval/castle_with_a_rather_long_name-lod0_final"


@dataclass(frozen=True)
class Place:
    """A page, what has come when it is all there, and what is opened on it, by a button's name."""

    name: str
    address: str
    there: str
    opened: str | None = None


@dataclass(frozen=True)
class House:
    """A service with some of everything."""

    address: str
    ids: dict[str, str]


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory, castle: JobResult) -> Iterator[House]:
    folder = tmp_path_factory.mktemp("data")
    with stocked(folder) as stock:
        first, second = (stock.run(castle, asset=LONG) for _ in range(2))
        stock.run(
            castle, asset="props/gate", recall=0.06, verdict="unusable",
            reason="it hides 6 % of what the mesh hides", try_next="occluder simplify gate.glb",
        )  # fmt: skip
        failed = stock.failure(
            castle, Failure("unreadable-mesh", "there is no triangle", "send another mesh")
        )
        ids = {
            "asset": stock.demand(LONG, Thresholds(min_recall=0.5)),
            "gate": stock.demand("props/gate", Thresholds(min_recall=0.9)),
            "first": first.id,
            "second": second.id,
            "failed": failed.id,
        }
    environment = {
        "OCCLUDER_DATA": str(folder), "OCCLUDER_WORKERS": "1", "OCCLUDER_MIN_FREE": "0",
        **IDLE,
    }  # fmt: skip
    with served("tests.service.dashboard.application:make_app()", environment) as address:
        yield House(address, ids)


PLACES = (
    Place("overview", "/", ".asset-list .asset-name"),
    Place("thresholds", "/", ".asset-list .asset-name", "Set thresholds of all assets"),
    Place("asset", "/assets/{asset}", ".mesh-viewer[data-state=ready]"),
    Place("unusable", "/assets/{gate}", ".mesh-viewer[data-state=ready]", "Heat map"),
    Place("download", "/assets/{asset}", ".mesh-viewer[data-state=ready]", "Download"),
    Place("compare", "/compare?a={first}&b={second}", ".mesh-viewer[data-state=ready]"),
    Place("jobs", "/jobs", "[role=note]"),
    Place("failed", "/jobs/{failed}", "text=What to do"),
    Place("job", "/jobs/{first}", ".mesh-viewer[data-state=ready]"),
    Place("submit", "/submit", ".drop-zone"),
    Place("options", "/submit", ".drop-zone", 'Expand "More settings"'),
    Place("sets", "/submit/visibility", ".drop-zone"),
    Place("again", "/submit?from={first}", "text=Run again"),
    Place("nothing", "/jobs/none", "text=Not found"),
    Place("tradeoff", "/tradeoff/{asset}", "text=Run the quick sweep"),
    Place("sign-in", "/sign-in", "input"),
)


def violations(page: Page, axe: Axe) -> list[dict[str, Any]]:
    """What axe-core finds; where a dialog is open, of the dialog, as nothing else can be used."""
    found: list[dict[str, Any]]
    if page.locator(".q-dialog").count() == 0:
        found = axe.run(page).response["violations"]
        return found
    # It takes Quasar's backdrop, whose z-index is negative, for what buttons stand on.
    options = {"rules": {"color-contrast": {"enabled": False}}}
    found = axe.run(page, context=".q-dialog", options=options).response["violations"]
    faint = [text for text in faint_texts(page) if text.partition(":")[0] in ("Save", "Cancel")]
    assert not faint
    return found


@pytest.mark.pages
@pytest.mark.parametrize("place", PLACES, ids=lambda place: place.name)
def test_nothing_serious_is_found(
    page: Page, house: House, watch: Watch, place: Place, tmp_path: Path
) -> None:
    if place.name == "nothing":
        watch.expect("status of 404")  # which the browser says of the page itself
    axe = Axe()
    page.set_viewport_size({"width": 1440, "height": 900})
    page.goto(house.address + place.address.format(**house.ids))
    expect(page.locator(place.there).first).to_be_visible(timeout=1000.0 * BUSY)
    if place.opened:
        page.get_by_role("button", name=place.opened, exact=True).first.click()
    found = []
    for width, height in WIDTHS.items():
        page.set_viewport_size({"width": width, "height": height})
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme)  # type: ignore[arg-type]
            page.wait_for_timeout(500.0)  # until nothing fades any more
            for one in violations(page, axe):
                if one["impact"] in GRAVE:
                    nodes = [node["html"][:200] for node in one["nodes"][:3]]
                    found.append(
                        f"{width} {scheme}: {one['id']}, {one['help']} {json.dumps(nodes)}"
                    )
            if scheme == "light":
                found += [f"{width}: {one}" for one in covered_texts(page)]
            if overflows(page):
                found.append(f"{width}: one has to scroll to the side")
            if scheme == ("dark" if width == 820 else "light"):
                keep_picture(page, f"axe_{place.name}_{width}", tmp_path)
    assert not found, "\n".join(found)
