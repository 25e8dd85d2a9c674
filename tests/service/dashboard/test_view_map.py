"""The map of views, by mouse and by keyboard."""

from __future__ import annotations

import re
from typing import Any

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.service.dashboard.results import JobResult


def _map(page: Page, parts: str) -> Locator:
    page.goto(f"{parts}/view-map")
    found = page.get_by_role("listbox")
    expect(found).to_be_visible()
    return found


def test_there_is_a_dot_for_each_view_and_a_click_chooses_it(
    page: Page, parts: str, castle: JobResult
) -> None:
    found = _map(page, parts)
    assert found.get_by_role("option").count() == len(castle.report["by_view"])
    dot = found.get_by_role("option", name="View 17,")
    dot.locator("circle").first.dispatch_event("click")
    expect(page.get_by_test_id("chosen")).to_have_text("17")
    expect(found.locator("[aria-selected=true]")).to_have_attribute("aria-label", _says("View 17,"))


def test_home_and_enter_choose_the_worst_view(page: Page, parts: str, castle: JobResult) -> None:
    found = _map(page, parts)
    found.focus()
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("Home")
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("chosen")).to_have_text(str(castle.report["worst_view"]["index"]))


@pytest.mark.parametrize(
    ("key", "axis", "sign"),
    [
        ("ArrowRight", "cx", 1),
        ("ArrowLeft", "cx", -1),
        ("ArrowUp", "cy", -1),
        ("ArrowDown", "cy", 1),
    ],
)
def test_arrow_keys_go_that_way(page: Page, parts: str, key: str, axis: str, sign: int) -> None:
    found = _map(page, parts)
    middle = _nearest_to_the_middle(found)
    found.locator(f"[id$=view-{middle}] circle").first.dispatch_event("click")
    expect(page.get_by_test_id("chosen")).to_have_text(str(middle))
    found.focus()
    page.keyboard.press(key)
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("chosen")).not_to_have_text(str(middle))
    reached = page.get_by_test_id("chosen").inner_text()
    moved = _coordinate(found, reached, axis) - _coordinate(found, str(middle), axis)
    assert 0.0 < sign * moved < 0.5


def test_another_measure_has_another_worst_view(page: Page, parts: str) -> None:
    found = _map(page, parts)
    worst = found.locator("g", has=page.locator(".view-map-worst"))
    before = worst.get_attribute("aria-label")
    page.get_by_role("button", name="precision").click()
    expect(found).to_have_attribute("aria-label", _says("Views by precision"))
    assert worst.get_attribute("aria-label") != before


def _coordinate(found: Locator, index: str, axis: str) -> float:
    dot = found.locator(f"[id$=view-{index}] circle").first
    return float(dot.get_attribute(axis) or "nan")


def _nearest_to_the_middle(found: Locator) -> int:
    dots: list[dict[str, Any]] = found.evaluate(
        """(map) => [...map.querySelectorAll("[role=option]")].map((one) => ({
            index: Number(one.id.split("-").pop()),
            away: Math.hypot(one.querySelector("circle").cx.baseVal.value,
                             one.querySelector("circle").cy.baseVal.value)}))"""
    )
    return int(min(dots, key=lambda dot: dot["away"])["index"])


def _says(beginning: str) -> re.Pattern[str]:
    return re.compile(re.escape(beginning) + ".*")
