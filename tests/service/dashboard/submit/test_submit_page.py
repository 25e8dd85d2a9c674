"""Meshes submitted in a real browser to a service that works."""

from __future__ import annotations

import io
import re
from base64 import b64decode
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Locator, Page, expect

from service.dashboard.colours import BOTH
from tests.service.dashboard.addresses import elsewhere, expect_kept
from tests.service.dashboard.chromium import DESKTOP, TABLET, Watch
from tests.service.dashboard.legibility import faint_texts, overflows
from tests.service.dashboard.meshes import broken_file, castle_file
from tests.service.dashboard.screenshots import keep_picture

PATIENCE = 60_000.0  # ms: the first job waits until the worker is ready
QUICK = {"Resolution": "16", "Levels of detail": "1"}
HOSTILE = "<img src=x onerror='window.hit = 1'>{{ 7 * 7 }} $(id) ‮é.obj"


@pytest.fixture(scope="module")
def mesh(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return castle_file(tmp_path_factory.mktemp("mesh"))


def fill(page: Page, **more: str) -> None:
    for label, text in {**QUICK, **more}.items():
        page.get_by_label(label, exact=True).fill(text)
    page.get_by_label("Preset").click()
    page.get_by_role("option", name="draft").click()


def jobs_of(page: Page) -> Locator:
    return page.get_by_role("region", name="Job")


def submit(page: Page, address: str, path: Path | list[Path], **more: str) -> Locator:
    """The panel of the job that comes of it."""
    page.goto(f"{address}/submit")
    page.get_by_label("Meshes").set_input_files(path)
    fill(page, **more)
    page.get_by_role("button", name="Submit").click()
    return jobs_of(page).first


def test_a_link_begins_with_the_same_asset(browser: Browser, page: Page, working: str) -> None:
    page.goto(f"{working}/submit")
    page.get_by_label("Asset").fill("props/gate & wall")
    expect_kept(page, asset="props/gate & wall")
    with elsewhere(browser, page) as other:
        expect(other.get_by_label("Asset")).to_have_value("props/gate & wall")


@pytest.mark.vital
def test_a_mesh_is_submitted_watched_and_run_again(
    page: Page, working: str, mesh: Path, tmp_path: Path
) -> None:
    job = submit(page, working, mesh, Asset="props/castle", Budget="12")
    expect(job.get_by_role("status")).to_have_text("succeeded", timeout=PATIENCE)
    expect(job.get_by_text("recall")).to_be_visible()
    expect(page.get_by_text("castle.obj", exact=True).first).to_be_visible()
    keep_picture(page, "dashboard_submit", tmp_path)
    job.get_by_role("link", name="Run again with other settings").click()
    expect(page.get_by_label("Budget", exact=True)).to_have_value("12")
    expect(page.get_by_label("Resolution", exact=True)).to_have_value("16")
    page.get_by_label("Budget", exact=True).fill("16")
    page.get_by_role("button", name="Run again").click()
    again = jobs_of(page).first
    expect(again.get_by_role("status")).to_have_text("succeeded", timeout=PATIENCE)
    again.get_by_role("link", name="See the asset").click()
    page.wait_for_url("**/assets/*")
    expect(page.get_by_role("heading", name="props/castle")).to_be_visible()


def test_settings_are_remembered_by_the_browser(page: Page, working: str, mesh: Path) -> None:
    submit(page, working, mesh, Budget="17")
    expect(jobs_of(page)).to_have_count(1)
    page.goto(f"{working}/submit")
    expect(page.get_by_label("Budget", exact=True)).to_have_value("17")
    page.get_by_role("button", name="Defaults").click()
    expect(page.get_by_label("Budget", exact=True)).to_have_value("64")


def test_a_job_is_cancelled_while_it_runs(page: Page, working: str, mesh: Path) -> None:
    page.goto(f"{working}/submit")
    page.get_by_label("Meshes").set_input_files(mesh)
    fill(page)
    page.get_by_text("More settings").click()
    page.get_by_label("Time limit").fill("600")
    page.get_by_role("button", name="Submit").click()
    job = jobs_of(page).first
    expect(job.get_by_text("refining")).to_be_visible(timeout=PATIENCE)
    expect(job.locator("polyline")).to_have_attribute("points", re.compile(r"[\d.]+,"))
    job.get_by_role("button", name="Cancel").click()
    expect(job.get_by_role("status")).to_have_text("cancelled")


def test_the_best_so_far_is_shown_while_a_job_refines(
    page: Page, working: str, mesh: Path, tmp_path: Path
) -> None:
    page.goto(f"{working}/submit")
    page.get_by_label("Meshes").set_input_files(mesh)
    page.get_by_label("Budget", exact=True).fill("48")
    page.get_by_role("checkbox", name="Ground").click()
    page.get_by_label("Preset").click()
    page.get_by_role("option", name="best").click()
    page.get_by_text("More settings").click()
    page.get_by_label("Time limit").fill("600")
    page.get_by_role("button", name="Submit").click()
    job = jobs_of(page).first
    picture = job.get_by_role("img", name=re.compile("best so far after .* s: hides .* %"))
    expect(picture).to_be_visible(timeout=PATIENCE)
    first = picture.get_attribute("src")
    assert yellow_of(picture) > 0.1
    expect(picture).not_to_have_attribute("src", first or "")
    assert yellow_of(picture) > 0.1
    assert picture.evaluate("one => [one.width, one.height]") == [160, 160]
    assert faint_texts(page) == []
    job.scroll_into_view_if_needed()
    keep_picture(job, "dashboard_best_so_far", tmp_path)
    page.set_viewport_size(TABLET)
    assert not overflows(page)
    page.set_viewport_size(DESKTOP)
    job.get_by_role("link", name="castle.obj").click()
    expect(page.get_by_role("img", name=re.compile("best so far after"))).to_be_visible()
    page.get_by_role("button", name="Cancel").click()
    expect(page.get_by_text("The job was cancelled")).to_be_visible()
    expect(page.get_by_role("img", name=re.compile("best so far after"))).to_have_count(0)


def yellow_of(picture: Locator) -> float:
    """The share of a picture's pixels that have the colour of what is hidden rightly."""
    data = b64decode((picture.get_attribute("src") or "").partition(",")[2])
    pixels = np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))
    return float((pixels == BOTH).all(axis=-1).mean())


def test_a_broken_mesh_explains_itself(page: Page, working: str, tmp_path: Path) -> None:
    job = submit(page, working, broken_file(tmp_path))
    fault = job.get_by_role("alert")
    expect(fault).to_contain_text("The mesh cannot be read", timeout=PATIENCE)
    expect(fault).to_contain_text("broken.glb: the file is truncated: 16 of 65535 bytes are there.")
    expect(fault).to_contain_text("What to do: Copy or export it again.")


KEEP = '[[open]]\nname = "gate"\ncenter = [0, 2.4, 28]\nsize = [4.2, 4.8, 11]\n'


def test_overrides_go_along_with_their_mesh_and_are_kept(
    page: Page, working: str, mesh: Path, tmp_path: Path
) -> None:
    keep = tmp_path / "castle.overrides.toml"
    keep.write_text(KEEP)
    job = submit(page, working, [keep, mesh], Budget="13")
    expect(page.get_by_role("row", name="castle.overrides.toml")).to_contain_text("sent")
    expect(job.get_by_role("status")).to_have_text("succeeded", timeout=PATIENCE)
    job.get_by_role("link", name="See the job").click()
    with page.expect_download() as download:
        page.get_by_role("link", name="with overrides").click()
    assert download.value.path().read_text() == KEEP
    expect(page.get_by_role("link", name="input/overrides.toml")).to_be_visible()
    page.get_by_role("link", name="Run again with other settings").click()
    expect(page.get_by_role("link", name="its overrides")).to_be_visible()
    page.get_by_label("Budget", exact=True).fill("15")
    page.get_by_role("button", name="Run again").click()
    again = jobs_of(page).first
    expect(again.get_by_role("status")).to_have_text("succeeded", timeout=PATIENCE)
    again.get_by_role("link", name="See the job").click()
    expect(page.get_by_role("link", name="with overrides")).to_be_visible()


def test_overrides_without_their_mesh_are_told(page: Page, working: str, tmp_path: Path) -> None:
    for name in ("tower.obj", "tower.ply", "tower.overrides.toml", "keep.toml"):
        (tmp_path / name).write_text(KEEP)
    page.goto(f"{working}/submit")
    row = page.get_by_role("row", name="tower.overrides.toml")
    chooser, send = page.get_by_label("Meshes"), page.get_by_role("button", name="Submit")
    chooser.set_input_files([tmp_path / "tower.overrides.toml", tmp_path / "keep.toml"])
    lone = "Its mesh is missing. Choose tower.glb, or tower in another format, as well."
    expect(row.get_by_role("alert")).to_have_text(lone)
    expect(page.get_by_role("row", name="keep.toml").get_by_role("alert")).to_have_text(
        "Overrides are named after their mesh: castle.overrides.toml for castle.glb."
    )
    expect(send).to_be_disabled()
    page.get_by_role("button", name="Remove keep.toml").click()
    chooser.set_input_files([tmp_path / "tower.obj", tmp_path / "tower.ply"])
    expect(row).to_contain_text("goes with tower.obj, tower.ply")
    expect(send).to_be_enabled()
    chooser.set_input_files(tmp_path / "tower.overrides.toml")  # anew, in place of the first
    expect(row).to_have_count(1)
    page.get_by_role("button", name="Remove tower.obj").click()
    expect(row).to_contain_text("goes with tower.ply")
    page.get_by_role("button", name="Remove tower.ply").click()
    expect(row.get_by_role("alert")).to_have_text(lone)
    for size in (DESKTOP, TABLET):
        page.set_viewport_size(size)
        assert faint_texts(page) == []
        assert not overflows(page)


def test_broken_overrides_explain_themselves(
    page: Page, working: str, mesh: Path, tmp_path: Path
) -> None:
    keep = tmp_path / "castle.overrides.toml"
    keep.write_text(f"{KEEP}\n[[box]]\ncentre = [0, 0, 0]\n")
    fault = submit(page, working, [mesh, keep]).get_by_role("alert")
    expect(fault).to_contain_text("The overrides cannot be used", timeout=PATIENCE)
    expect(fault).to_contain_text("castle.overrides.toml:7: there is no key 'centre' in [[box]].")
    expect(fault).to_contain_text("What to do: Choose from name, center, size")


def test_a_fault_stands_beside_its_setting_as_one_types(
    page: Page, working: str, mesh: Path
) -> None:
    page.goto(f"{working}/submit")
    page.get_by_label("Meshes").set_input_files(mesh)
    page.get_by_label("Budget", exact=True).fill("0")
    expect(page.get_by_text("0 is out of range. Choose 1 to 100,000.")).to_be_visible()
    page.get_by_role("button", name="Submit").click()
    expect(page.get_by_label("Budget", exact=True)).to_be_focused()
    expect(jobs_of(page)).to_have_count(0)
    page.get_by_label("Budget", exact=True).fill("9")
    expect(page.get_by_text("0 is out of range")).to_have_count(0)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_warning_can_be_closed_and_goes_once_nothing_is_wrong(
    page: Page, working: str, mesh: Path, scheme: str
) -> None:
    page.emulate_media(color_scheme=scheme)  # type: ignore[arg-type]
    page.goto(f"{working}/submit")
    page.get_by_label("Meshes").set_input_files(mesh)
    budget, send = (
        page.get_by_label("Budget", exact=True),
        page.get_by_role("button", name="Submit"),
    )
    warning = page.locator(".q-notification").filter(has_text="Some settings are wrong.")
    budget.fill("abc")
    send.click()
    expect(warning).to_be_visible()
    page.wait_for_timeout(500.0)  # until nothing fades any more
    assert faint_texts(page) == []
    warning.get_by_role("button", name="Close").click()
    expect(warning).to_have_count(0)
    for _ in range(2):  # it stands there once
        send.click()
    expect(warning).to_have_count(1)
    budget.fill("12")
    expect(warning).to_have_count(0)
    budget.fill("abc")
    send.click()
    expect(warning).to_have_count(1)
    page.get_by_role("button", name="Defaults").click()
    expect(warning).to_have_count(0)


def test_a_file_of_no_format_is_refused_before_it_is_sent(
    page: Page, working: str, mesh: Path, tmp_path: Path
) -> None:
    readme = tmp_path / "readme.txt"
    readme.write_text("of no use")
    bunny = tmp_path / "bunny_69k.obj"
    bunny.write_bytes(mesh.read_bytes())
    page.goto(f"{working}/submit")
    send = page.get_by_role("button", name="Submit")
    page.get_by_label("Meshes").set_input_files(readme)
    expect(page.get_by_role("row", name="readme.txt").get_by_role("alert")).to_have_text(
        "This file is not sent. It is not in one of the formats above."
    )
    expect(send).to_be_disabled()
    page.get_by_label("Meshes").set_input_files(bunny)
    expect(send).to_be_enabled()
    # Beside long words, and on a phone, the name stays on one line.
    for width in (1280, 390):
        page.set_viewport_size({"width": width, "height": 800})
        cell = page.get_by_role("cell", name="bunny_69k.obj", exact=True)
        assert lines_of(cell) == 1
        assert not overflows(page)
    fill(page)
    send.click()
    expect(jobs_of(page)).to_have_count(1)
    expect(page.get_by_role("row", name="readme.txt").get_by_role("alert")).to_be_visible()


def lines_of(words: Locator) -> int:
    """How many lines the text of an element takes."""
    count: int = words.evaluate("""(one) => {
      const range = document.createRange();
      range.selectNodeContents(one);
      return new Set([...range.getClientRects()].map((box) => Math.round(box.top))).size;
    }""")
    return count


def test_what_is_taken_where_nothing_is_typed_can_be_read(page: Page, working: str) -> None:
    page.goto(f"{working}/submit")
    page.get_by_text("More settings").click()
    told = page.get_by_text("If left empty: 0.999; 0.995 with an overhang above 0.01.")
    expect(told).to_be_visible()
    precision = page.get_by_label("Min precision")
    assert precision.get_attribute("placeholder") is None
    expect(page.locator(".bar").get_by_text("Colours:")).to_be_visible()


def test_the_page_goes_to_the_setting_that_is_wrong(page: Page, working: str, mesh: Path) -> None:
    page.goto(f"{working}/submit")
    page.get_by_label("Meshes").set_input_files(mesh)
    page.set_viewport_size({"width": 820, "height": 600})
    budget, seed = page.get_by_label("Budget", exact=True), page.get_by_label("Seed")
    page.get_by_text("More settings").click()
    budget.fill("abc")
    page.get_by_role("button", name="Submit").click()
    expect(budget).to_be_focused()
    expect(budget).to_be_in_viewport(ratio=1.0)
    budget.fill("12")
    seed.fill("abc")
    page.get_by_text("More settings").click()
    expect(seed).to_be_hidden()
    page.get_by_role("button", name="Submit").click()
    expect(seed).to_be_focused()  # unfolded again
    expect(seed).to_be_in_viewport(ratio=1.0)


def test_a_refused_upload_says_why_and_can_be_sent_again(
    page: Page, working: str, watch: Watch, tmp_path: Path
) -> None:
    watch.expect("413")
    large = tmp_path / "large.obj"
    large.write_bytes(b"#" * 1_100_000)
    page.goto(f"{working}/submit")
    page.get_by_label("Meshes").set_input_files(large)
    page.get_by_role("button", name="Submit").click()
    expect(
        page.get_by_role("alert").filter(has_text="An upload may have 1,000,000")
    ).to_be_visible()
    expect(page.get_by_role("button", name="Submit")).to_be_enabled()
    page.get_by_role("button", name="Remove large.obj").click()
    expect(page.get_by_role("button", name="Submit")).to_be_disabled()


def test_hostile_names_are_but_text(page: Page, working: str, tmp_path: Path) -> None:
    path = castle_file(tmp_path, HOSTILE.replace("/", ":"))
    job = submit(page, working, path, Asset=HOSTILE.replace("\u202e", ""))
    expect(job.get_by_role("link", name="{{ 7 * 7 }}")).to_be_visible()
    expect(job.get_by_role("status")).to_have_text("succeeded", timeout=PATIENCE)
    for place in ("/jobs", job.get_by_role("link").first.get_attribute("href")):
        page.goto(f"{working}{place}")
        expect(page.get_by_text("{{ 7 * 7 }}").first).to_be_visible()
    assert page.evaluate("window.hit === undefined")


def test_a_name_that_cannot_be_seen_is_refused_in_words(
    page: Page, working: str, watch: Watch, mesh: Path
) -> None:
    watch.expect("422")
    page.goto(f"{working}/submit")
    page.get_by_label("Meshes").set_input_files(mesh)
    page.get_by_label("Asset").fill("castle\u202e")
    page.get_by_role("button", name="Submit").click()
    expect(
        page.get_by_role("alert").filter(has_text="U+202E, which cannot be seen")
    ).to_be_visible()


def test_the_keyboard_is_enough(page: Page, working: str, mesh: Path) -> None:
    page.goto(f"{working}/submit")
    expect(page.get_by_label("Budget", exact=True)).to_be_visible()
    tab_to(page, page.get_by_label("Meshes"))
    with page.expect_file_chooser() as chooser:
        page.keyboard.press("Space")
    chooser.value.set_files(mesh)
    expect(page.get_by_role("button", name="Submit")).to_be_enabled()
    tab_to(page, page.get_by_label("Resolution", exact=True))
    page.keyboard.type("16")
    tab_to(page, page.get_by_role("button", name="Submit"))
    page.keyboard.press("Enter")
    job = jobs_of(page).first
    expect(job).to_be_visible()
    tab_to(page, job.get_by_role("button", name="Cancel"))
    page.keyboard.press("Enter")
    expect(job.get_by_role("status")).to_have_text("cancelled", timeout=PATIENCE)


def tab_to(page: Page, wanted: Locator) -> None:
    for _ in range(40):
        page.keyboard.press("Tab")
        if wanted.evaluate("one => one === document.activeElement"):
            return
    raise AssertionError(f"the keyboard does not reach {wanted}")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_can_be_read_on_a_tablet(
    browser: Browser, working: str, scheme: str, tmp_path: Path
) -> None:
    context = browser.new_context(viewport=TABLET, color_scheme=scheme)  # type: ignore[arg-type]
    page = context.new_page()
    page.goto(f"{working}/submit")
    page.get_by_text("More settings").click()
    expect(page.get_by_label("Seed")).to_be_visible()
    assert faint_texts(page) == []
    assert not overflows(page)
    page.mouse.move(0, 0)
    page.wait_for_timeout(500.0)  # until all of it is unfolded
    keep_picture(page, f"dashboard_submit_{scheme}", tmp_path)
    context.close()


def folder_of(place: Path, mesh: Path) -> Path:
    """A folder with two meshes in folders of their own, overrides, and what is left out."""
    folder = place / "props"
    for name in ("gate", "tower"):
        (folder / name).mkdir(parents=True)
        (folder / name / "lod.obj").write_bytes(mesh.read_bytes())
    (folder / "gate" / "lod.overrides.toml").write_text(
        "[[open]]\nname = 'door'\ncenter = [0, 0, 0]\nsize = [0.1, 0.1, 0.1]\n"
    )
    (folder / "notes.txt").write_text("of no use")
    (folder / ".git").mkdir()
    (folder / ".git" / "old.obj").write_text("v 0 0 0")
    (folder / "empty.obj").write_text("")
    return folder


def test_a_folder_is_sent_and_what_is_left_out_is_told(
    page: Page, working: str, mesh: Path, tmp_path: Path
) -> None:
    page.goto(f"{working}/submit")
    fill(page, Asset="kit")
    page.get_by_label("A folder").set_input_files(folder_of(tmp_path, mesh))
    waiting = page.get_by_role("table", name="Files to be sent")
    expect(waiting.get_by_text("props/gate/lod.obj", exact=True)).to_be_visible()
    expect(waiting.get_by_text("goes with props/gate/lod.obj")).to_be_visible()
    page.get_by_text("files are left out").click()
    out = page.locator(".left-out")
    for path, reason in (
        ("props/notes.txt", "not one of the formats"), ("props/.git/old.obj", "hidden"),
        ("props/empty.obj", "empty"),
    ):  # fmt: skip
        expect(out.get_by_text(f"{path}: {reason}")).to_be_visible()
    assert faint_texts(page) == []
    page.get_by_role("button", name="Submit").click()
    expect(jobs_of(page)).to_have_count(2, timeout=PATIENCE)
    for at in range(2):
        status = jobs_of(page).nth(at).get_by_role("status")
        expect(status).to_have_text("succeeded", timeout=PATIENCE)
    page.goto(working)
    for name in ("kit/props/gate/lod", "kit/props/tower/lod"):
        expect(page.get_by_text(name).first).to_be_visible()


DROP = """(zone, names) => {
  const entry = (path, children) => ({
    fullPath: path, isDirectory: Boolean(children),
    createReader: () => {
      const batches = children?.map((one) => [one]) ?? [];
      return { readEntries: (done) => done(batches.shift() ?? []) };
    },
    file: (done) => done(new File(["v 0 0 0"], path.split("/").pop())),
  });
  const deep = entry("/drop/deep", names.map((one) => entry(`/drop/deep/${one}`)));
  const root = entry("/drop", [entry("/drop/top.obj"), deep]);
  const event = new Event("drop", { bubbles: true, cancelable: true });
  const file = new File([], "drop");
  event.dataTransfer = { items: [{ webkitGetAsEntry: () => root }], files: [file] };
  zone.dispatchEvent(event);
}"""


def test_a_dropped_folder_is_read_to_its_end(page: Page, working: str) -> None:
    """Folders tell their entries some at a time."""
    page.goto(f"{working}/submit")
    names = [f"{at:03}.obj" for at in range(150)] + ["a.png"]
    page.locator(".drop-zone").evaluate(DROP, names)
    rows = page.get_by_role("table", name="Files to be sent").get_by_role("row")
    expect(rows).to_have_count(151)
    expect(page.get_by_text("1 file is left out")).to_be_visible()
    expect(page.get_by_text("151 files")).to_be_visible()


def test_drafts_outlive_a_reload_and_settings_are_saved_by_name(page: Page, working: str) -> None:
    page.goto(f"{working}/submit")
    budget = page.get_by_label("Budget", exact=True)
    budget.fill("33")
    page.get_by_role("checkbox", name="Ground").click()
    page.wait_for_function("Object.values(localStorage).some((one) => one.includes('33'))")
    page.reload()
    expect(budget).to_have_value("33")
    expect(page.get_by_role("checkbox", name="Ground")).to_be_checked()
    page.get_by_role("button", name="Save as").click()
    page.get_by_label("Name", exact=True).fill("walls")
    page.get_by_role("button", name="Save", exact=True).click()
    page.get_by_role("button", name="Defaults").click()
    expect(budget).to_have_value("64")
    page.reload()
    expect(budget).to_have_value("64")
    page.get_by_label("Saved settings").click()
    page.get_by_role("option", name="walls").click()
    expect(budget).to_have_value("33")
    page.get_by_role("button", name="Delete").click()
    expect(page.get_by_role("button", name="Delete")).to_be_disabled()
    page.reload()
    expect(budget).to_have_value("33")
    expect(page.get_by_role("button", name="Delete")).to_be_disabled()
