"""The 3D view, as a real browser draws it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, expect

import simplifier
from service.dashboard.colours import BOTH, MISSED, NEITHER, STOPS, WRONG, Colour
from simplifier.accuracy.accuracy import view_masks
from simplifier.report.gallery import COLOURS
from simplifier.report.silhouettes import WHITE, silhouette
from tests.service.dashboard.chromium import Watch
from tests.service.dashboard.results import JobResult
from tests.service.dashboard.viewer_pages import (
    Pixels,
    frames,
    grey,
    kinds,
    pixels,
    settle,
    shown,
    yellow,
)
from tests.waiting import until


@pytest.fixture(autouse=True)
def small(page: Page) -> None:
    """Pictures are drawn by the processor: fewer pixels, less time."""
    page.set_viewport_size({"width": 720, "height": 700})


def test_colours_are_those_of_the_report() -> None:
    told = {"yellow": BOTH, "black": MISSED, "blue": WRONG}
    assert told == COLOURS
    assert NEITHER == WHITE


def test_original_and_occluder_are_drawn_over_each_other(page: Page, parts: str) -> None:
    page.goto(f"{parts}/viewer")
    picture = pixels(shown(page))
    assert grey(picture) > 0.05
    assert yellow(picture) > 0.02
    assert grey(picture) + yellow(picture) < 0.9


def test_side_by_side_shows_one_of_them_on_either_side(page: Page, parts: str) -> None:
    page.goto(f"{parts}/viewer?mode=side")
    picture = pixels(shown(page))[40:]
    left, right = np.array_split(picture, 2, axis=1)
    assert grey(left) > 0.05
    assert yellow(left) == 0.0
    assert yellow(right) > 0.05


def test_a_slider_wipes_from_the_original_to_the_occluder(page: Page, parts: str) -> None:
    page.goto(f"{parts}/viewer?mode=wipe")
    host = shown(page)
    left, right = np.array_split(pixels(host), 2, axis=1)
    assert grey(left) > 0.05
    assert yellow(left) == 0.0
    assert yellow(right) > 0.05
    for share, some in ((1.0, grey), (0.0, yellow)):
        before = frames(host)
        page.get_by_role("slider", name="Original to the left").fill(f"{share}")
        _drawn_again(page, host, before)
        assert some(pixels(host)) > 0.05
        assert (yellow(pixels(host)) > 0.0) == (share == 0.0)


def test_a_see_through_original_lets_more_of_the_occluder_be_seen(page: Page, parts: str) -> None:
    page.goto(f"{parts}/viewer")
    host = shown(page)
    before = yellow(pixels(host))
    page.get_by_role("button", name="transparent").click()
    page.wait_for_function("document.querySelector('[data-frames]').dataset.frames > 0")
    _drawn_again(page, host, frames(host) - 1)
    assert yellow(pixels(host)) > 1.2 * before


def test_a_heat_map_paints_the_original_by_what_is_lost(
    page: Page, parts: str, parts_folder: Path, castle: JobResult
) -> None:
    """All of it in the colour of nothing lost, then of all, then as it is."""
    mesh = simplifier.load(castle.input)
    whole = simplifier.Occluder(mesh.vertices, mesh.faces, error_bound=0.0)
    nothing = simplifier.Occluder(mesh.vertices[:0], mesh.faces[:0], error_bound=0.0)
    drawn = {}
    for name, one in (("whole", whole), ("nothing", nothing), ("castle", castle.occluder(0))):
        simplifier.save_loss_map(parts_folder / f"{name}.json", mesh, one, castle.report)
        page.goto(f"{parts}/viewer?mode=loss&loss={name}.json")
        host = shown(page)
        expect(page.get_by_text("Over the whole mesh: ")).to_be_visible()
        settle(host)
        drawn[name] = pixels(host)
    bright, dark = STOPS[-1], STOPS[0]
    assert _share_of(drawn["whole"], bright) > 0.1
    assert _share_of(drawn["nothing"], dark) == pytest.approx(
        _share_of(drawn["whole"], bright), 0.1
    )
    assert _share_of(drawn["whole"], dark) == _share_of(drawn["nothing"], bright) == 0.0
    told = json.loads((parts_folder / "castle.json").read_text())
    expect(page.get_by_text(f"Over the whole mesh: {100 * told['share']:.2f} %")).to_be_visible()
    assert 0.0 < _share_of(drawn["castle"], bright) < _share_of(drawn["whole"], bright)


def test_a_heat_map_that_cannot_be_had_says_why(page: Page, parts: str, watch: Watch) -> None:
    watch.expect("404")
    page.goto(f"{parts}/viewer?mode=loss&loss=none.json")
    shown(page)
    expect(page.get_by_text("The heat map cannot be shown: ")).to_be_visible()


def _share_of(picture: Pixels, colour: Colour) -> float:
    """Of pixels of a colour's hue, in light or in shade."""
    near = picture / np.maximum(picture.max(axis=-1, keepdims=True), 1) - np.array(colour) / max(
        colour
    )
    light = picture.max(axis=-1) / max(colour)
    return float(((np.abs(near).max(axis=-1) < 0.06) & (light > 0.8) & (light < 1.03)).mean())


@pytest.mark.parametrize("place", ["worst", "first"])
def test_silhouettes_are_those_of_the_report(
    page: Page, parts: str, castle: JobResult, place: str
) -> None:
    view = castle.report["worst_view"] if place == "worst" else castle.report["by_view"][0]
    page.goto(f"{parts}/viewer?mode=silhouette")
    host = shown(page)
    page.get_by_label("direction").fill(" ".join(map(repr, view["direction"])))
    page.get_by_test_id("counted").filter(has_text=" ").wait_for()
    told = page.get_by_test_id("counted").inner_text()
    page.get_by_role("button", name="look").click()
    expect(page.get_by_test_id("counted")).not_to_have_text(told)

    lines = np.array([view["direction"]])
    original, hidden = view_masks(simplifier.load(castle.input), castle.occluder(0), lines, 512)
    both, missed, wrong = original & hidden, original & ~hidden, hidden & ~original
    expected = [int(one.sum()) for one in (both, missed, wrong)]

    def as_expected() -> bool:
        """Sooner or later: frames on the way there are counted too."""
        counted = list(map(int, page.get_by_test_id("counted").inner_text().split()))
        return bool(np.abs(np.subtract(counted[:3], expected)).max() < 0.002 * counted[3])

    until(as_expected)

    settle(host)
    drawn = pixels(host)
    side = drawn.shape[0] - 2  # without the border
    left = (drawn.shape[1] - side) // 2
    square = drawn[1 : side + 1, left : left + side]
    original, hidden = view_masks(simplifier.load(castle.input), castle.occluder(0), lines, side)
    picture = silhouette(original[0], hidden[0]).astype(np.int64)
    assert (kinds(square) == kinds(picture)).mean() > 0.98
    assert (kinds(square[:, ::-1]) == kinds(picture)).mean() < 0.98  # it is not mirrored


def test_a_mesh_far_from_the_origin_looks_the_same(
    page: Page, parts: str, parts_folder: Path, castle: JobResult
) -> None:
    page.goto(f"{parts}/viewer")
    near = pixels(shown(page))
    away = np.array([5_176_000.0, 250.0, -1_841_000.0])
    mesh, occluder = simplifier.load(castle.input), castle.occluder(0)
    moved = simplifier.TriangleMesh.from_soup(mesh.vertices + away, mesh.faces)
    simplifier.save_for_viewing(moved, parts_folder / "far.glb")
    occluder = replace(occluder, vertices=occluder.vertices + away)
    simplifier.save(occluder, parts_folder / "far0.glb")
    page.goto(f"{parts}/viewer?original=far.glb&finest=far0.glb")
    far = pixels(shown(page))
    assert (np.abs(far - near).max(axis=-1) > 8).mean() < 0.002


def test_nothing_is_drawn_while_nothing_changes(page: Page, parts: str) -> None:
    page.goto(f"{parts}/viewer")
    host = shown(page)
    before = frames(host)
    host.evaluate("() => new Promise((done) => setTimeout(done, 300))")
    assert frames(host) == before


def test_keys_turn_and_zoom_and_0_brings_the_first_picture_back(page: Page, parts: str) -> None:
    page.goto(f"{parts}/viewer")
    host = shown(page)
    first = pixels(host)
    host.focus()
    for key in ("ArrowLeft", "ArrowUp", "+"):
        before, count = pixels(host), frames(host)
        page.keyboard.press(key)
        _drawn_again(page, host, count)
        assert (pixels(host) != before).any(axis=-1).mean() > 0.02, key
    count = frames(host)
    page.keyboard.press("0")
    _drawn_again(page, host, count)
    corner = 6  # of the frame, smoothed by whatever page lies behind it
    changed = (pixels(host) != first).any(axis=-1)
    for rows in (slice(corner), slice(-corner, None)):
        changed[rows, :corner] = changed[rows, -corner:] = False
    assert not changed.any()


def test_dragging_turns(page: Page, parts: str) -> None:
    page.goto(f"{parts}/viewer")
    host = shown(page)
    before, count, box = pixels(host), frames(host), host.bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 200, box["y"] + 200)
    page.mouse.down()
    page.mouse.move(box["x"] + 300, box["y"] + 200, steps=3)
    page.mouse.up()
    _drawn_again(page, host, count)
    assert (pixels(host) != before).any(axis=-1).mean() > 0.05


def test_another_level_is_another_occluder(page: Page, parts: str, castle: JobResult) -> None:
    page.goto(f"{parts}/viewer")
    shown(page)
    expect(page.get_by_test_id("ready")).to_have_text(str(len(castle.occluder(0).faces)))
    page.get_by_role("button", name="coarser").click()
    expect(page.get_by_test_id("ready")).to_have_text(str(len(castle.occluder(1).faces)))


def test_wires_let_the_background_through(page: Page, parts: str) -> None:
    page.goto(f"{parts}/viewer?mode=side")
    host = shown(page)
    before, count = yellow(pixels(host)), frames(host)
    page.get_by_role("button", name="wireframe").click()
    _drawn_again(page, host, count)
    assert 0.0 < yellow(pixels(host)) < before / 2.0


def test_viewers_of_a_group_turn_together(page: Page, parts: str) -> None:
    page.goto(f"{parts}/pair")
    page.locator(".mesh-viewer[data-state=ready]").nth(1).wait_for(timeout=20_000)
    first, second = (page.get_by_role("application", name=name) for name in "01")
    settle(first)
    settle(second)
    before, count = pixels(second), frames(second)
    first.focus()
    page.keyboard.press("ArrowRight")
    _drawn_again(page, second, count)
    assert (kinds(pixels(second)) != kinds(before)).mean() > 0.02


def test_the_dark_theme_has_a_dark_background(page: Page, parts: str) -> None:
    page.goto(f"{parts}/viewer?dark=true")
    corner = pixels(shown(page))[-20, 20]
    assert corner.max() < 60


def test_a_missing_file_is_told_in_words(page: Page, parts: str, watch: Watch) -> None:
    watch.expect("404")
    page.goto(f"{parts}/viewer?original=gone.glb")
    expect(page.get_by_role("alert")).to_contain_text("The original cannot be shown")


def test_a_browser_without_webgl_is_told_in_words(page: Page, parts: str, watch: Watch) -> None:
    watch.expect("THREE.WebGLRenderer")
    page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    page.goto(f"{parts}/viewer")
    expect(page.get_by_role("alert")).to_contain_text("WebGL is switched off")


def test_a_lost_context_is_told_in_words_and_comes_back(page: Page, parts: str) -> None:
    page.goto(f"{parts}/viewer")
    host = shown(page)
    before = pixels(host)
    lose = host.locator("canvas").evaluate_handle(
        "(canvas) => canvas.getContext('webgl2').getExtension('WEBGL_lose_context')"
    )
    lose.evaluate("(one) => one.loseContext()")
    expect(page.get_by_role("alert")).to_contain_text("dropped the 3D view")
    count = frames(host)
    lose.evaluate("(one) => one.restoreContext()")
    expect(page.get_by_role("alert")).to_have_count(0)
    _drawn_again(page, host, count)
    assert (pixels(host) == before).all(axis=-1).mean() > 0.99


def _drawn_again(page: Page, host: object, count: int) -> None:
    """Wait until a viewer has drawn more often than that, and stands still."""
    handle = host.element_handle()  # type: ignore[attr-defined]
    page.wait_for_function(
        "([host, count]) => Number(host.dataset.frames) > count", arg=[handle, count]
    )
    settle(host)  # type: ignore[arg-type]
