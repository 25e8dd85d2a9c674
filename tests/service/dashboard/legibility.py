"""Whether what a page says can be read: contrast of text, and nothing beyond the edge."""

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


def faint_texts(page: Page) -> list[str]:
    """Those with less contrast than 4.5 : 1, or 3 : 1 where they are large."""
    faint: list[str] = page.evaluate(_FAINT)
    return faint


def overflows(page: Page) -> bool:
    """Whether one has to scroll to the side."""
    return bool(
        page.evaluate("document.documentElement.scrollWidth > document.documentElement.clientWidth")
    )
