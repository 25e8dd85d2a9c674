"""Whether what a page says can be read: contrast of text, and nothing cut, covered or beyond the
edge."""

from __future__ import annotations

from playwright.sync_api import Page

_FAINT = """() => {
    const parsed = (text) => {
        const [r, g, b, a = 1] = text.match(/[\\d.]+/g).map(Number);
        return { r, g, b, a };
    };
    const light = ({ r, g, b }) => [r, g, b]
        .map((one) => one / 255)
        .map((one) => (one <= 0.04045 ? one / 12.92 : ((one + 0.055) / 1.055) ** 2.4))
        .reduce((sum, one, at) => sum + one * [0.2126, 0.7152, 0.0722][at], 0);
    const behind = (element) => {
        for (let one = element; one; one = one.parentElement) {
            const colour = parsed(getComputedStyle(one).backgroundColor);
            if (colour.a > 0.99) return colour;
        }
        return parsed("rgb(255, 255, 255)");
    };
    const faint = [];
    const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    while (texts.nextNode()) {
        const element = texts.currentNode.parentElement;
        const words = texts.currentNode.textContent.trim();
        const style = getComputedStyle(element);
        if (!words || !element.checkVisibility({ opacityProperty: true })) continue;
        if (element.closest("script, style, svg, .disabled, .for-readers, .mesh-viewer-halves, i"))
            continue;
        const [a, b] = [light(parsed(style.color)), light(behind(element))];
        const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
        const large = parseFloat(style.fontSize) >= 18.66;
        if (contrast < (large ? 3 : 4.5))
            faint.push(`${words.slice(0, 40)}: ${contrast.toFixed(1)}`);
    }
    return faint;
}"""


_COVERED = """() => {
    const open = [...document.querySelectorAll(".q-dialog, .q-menu")].at(-1);
    const root = open ?? document.body;
    const seen = (element) =>
        element.checkVisibility({ opacityProperty: true, visibilityProperty: true }) &&
        !element.closest(".for-readers, .skip-link, [aria-hidden=true], script, style");
    // What is left of a box within all that cuts it off.
    const within = (box, element) => {
        let { left, top, right, bottom } = box;
        for (let one = element; one && one !== root; one = one.parentElement) {
            if (getComputedStyle(one).overflow === "visible") continue;
            const edge = one.getBoundingClientRect();
            [left, top] = [Math.max(left, edge.left), Math.max(top, edge.top)];
            [right, bottom] = [Math.min(right, edge.right), Math.min(bottom, edge.bottom)];
        }
        return { left, top, right, bottom };
    };
    const boxes = [];
    const add = (element, box, words, control) => {
        const shown = within(box, element);
        if (shown.right - shown.left > 2 && shown.bottom - shown.top > 2)
            boxes.push({ ...shown, element, words: words.slice(0, 40), control });
    };
    const texts = document.createTreeWalker(root, NodeFilter.SHOW_TEXT);
    const range = document.createRange();
    while (texts.nextNode()) {
        const element = texts.currentNode.parentElement;
        const words = texts.currentNode.textContent.trim();
        if (!words || !seen(element)) continue;
        range.selectNodeContents(texts.currentNode);
        for (const box of range.getClientRects()) add(element, box, words, false);
    }
    const controls = "button, select, textarea, input:not(.q-field *), .q-field__control";
    for (const one of root.querySelectorAll(controls))
        if (seen(one)) add(one, one.getBoundingClientRect(), one.tagName.toLowerCase(), true);
    boxes.sort((a, b) => a.top - b.top);
    const covered = new Set();
    boxes.forEach((one, at) => {
        for (const other of boxes.slice(at + 1)) {
            if (other.top > one.bottom - 3) break;
            const across = Math.min(one.right, other.right) - Math.max(one.left, other.left);
            const down = Math.min(one.bottom, other.bottom) - other.top;
            if (across < 3 || down < 3 || one.element === other.element) continue;
            if (one.control && (other.control || one.element.contains(other.element))) continue;
            if (other.control && other.element.contains(one.element)) continue;
            covered.add(`${one.words} / ${other.words}`);
        }
    });
    for (const one of root.querySelectorAll("*")) {
        const style = getComputedStyle(one);
        const own = [...one.childNodes].some((node) => node.nodeType === 3 && node.data.trim());
        const hides = ["hidden", "clip"].includes(style.overflowX);
        const cuts = hides && style.textOverflow !== "ellipsis";
        if (own && cuts && seen(one) && one.scrollWidth > one.clientWidth + 1)
            covered.add(`${one.textContent.trim().slice(0, 40)} / is cut`);
    }
    return [...covered];
}"""


def covered_texts(page: Page) -> list[str]:
    """Texts that lie over another or over a control, each with what it meets, and texts that are
    cut; where a dialog or menu is open, of those in it."""
    covered: list[str] = page.evaluate(_COVERED)
    return covered


def faint_texts(page: Page) -> list[str]:
    """Those with less contrast than 4.5 : 1, or 3 : 1 where they are large."""
    faint: list[str] = page.evaluate(_FAINT)
    return faint


def overflows(page: Page) -> bool:
    """Whether one has to scroll to the side."""
    return bool(
        page.evaluate("document.documentElement.scrollWidth > document.documentElement.clientWidth")
    )
