"""The watch over pages sees what it is there for."""

from __future__ import annotations

import pytest
from playwright.sync_api import Browser, Page

from tests.service.dashboard.chromium import Watch
from tests.service.dashboard.legibility import covered_texts, faint_texts, overflows


def test_a_request_that_leaves_the_machine_is_a_fault(browser: Browser) -> None:
    watch, context = Watch(), browser.new_context()
    watch.over(context)
    context.route("http://elsewhere.invalid/**", lambda route: route.fulfill(body=""))
    context.new_page().set_content("<img src='http://elsewhere.invalid/dot.png'>")
    context.close()
    with pytest.raises(AssertionError, match="elsewhere"):
        watch.check()


@pytest.mark.parametrize("script", ["console.error('badly')", "throw new Error('badly')"])
def test_an_error_of_a_page_is_a_fault_unless_it_is_expected(browser: Browser, script: str) -> None:
    watch, context = Watch(), browser.new_context()
    watch.over(context)
    page = context.new_page()
    page.set_content("<p>here</p>")
    page.add_script_tag(content=f"setTimeout(() => {{ {script} }})")
    page.evaluate("new Promise(done => setTimeout(done, 10))")
    context.close()
    with pytest.raises(AssertionError, match="badly"):
        watch.check()
    watch.expect("badly")
    watch.check()


def test_webgl_draws(page: Page) -> None:
    page.set_content("<canvas id=c></canvas>")
    assert page.evaluate("document.getElementById('c').getContext('webgl2') !== null")


def test_faint_text_is_found(page: Page) -> None:
    page.set_content(
        "<body style='background: #fff'><p style='color: #999'>faint</p><p>plain</p>"
        "<div style='background: #123'><p style='color: #234'>fainter</p></div>"
    )
    assert [text.partition(":")[0] for text in faint_texts(page)] == ["faint", "fainter"]


def test_covered_text_is_found(page: Page) -> None:
    page.set_content(
        "<p>plain</p><div style='height: 10px; line-height: 20px'>below</div><p style='margin: 0'>"
        "above</p><p>alone</p><label>named <input></label><p style='margin: 8px 0 -12px'>hint</p>"
        "<button>Go</button><p style='width: 20px; overflow: hidden; white-space: nowrap'>long word"
        "</p>"
    )
    assert covered_texts(page) == [
        "below / above",
        "hint / button",
        "hint / Go",
        "long word / is cut",
    ]


def test_what_is_beyond_the_edge_is_found(page: Page) -> None:
    page.set_content("<p>plain</p>")
    assert not overflows(page)
    page.set_content("<div style='width: 9999px'>wide</div>")
    assert overflows(page)
