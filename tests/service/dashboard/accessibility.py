"""What can be checked of a page for those who do not use a mouse, or see little."""

from __future__ import annotations

from playwright.sync_api import Page

_FAINT = """() => {
  const parse = (colour) => {
    const parts = colour.match(/[\\d.]+/g).map(Number);
    const scale = colour.startsWith("color(srgb") ? 255 : 1;
    return [parts[0] * scale, parts[1] * scale, parts[2] * scale, parts[3] ?? 1];
  };
  const over = (top, below) =>
    [0, 1, 2].map((i) => top[i] * top[3] + below[i] * (1 - top[3])).concat(1);
  const surface = (element) => {
    const layers = [];
    for (let one = element; one; one = one.parentElement) {
      layers.push(parse(getComputedStyle(one).backgroundColor));
    }
    return layers.reduceRight((below, top) => over(top, below), [255, 255, 255, 1]);
  };
  const light = (colour) => {
    const [r, g, b] = colour.slice(0, 3).map((part) => {
      const share = part / 255;
      return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
    });
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const faint = new Set();
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const text = walker.currentNode.textContent.trim();
    const element = walker.currentNode.parentElement;
    if (!text || !element.checkVisibility({ opacityProperty: true, visibilityProperty: true })) {
      continue;
    }
    const below = surface(element);
    const written = over(parse(getComputedStyle(element).color), below);
    const [high, low] = [light(written), light(below)].sort((a, b) => b - a);
    const ratio = (high + 0.05) / (low + 0.05);
    if (ratio < 4.5) faint.add(`${text.slice(0, 40)} (${ratio.toFixed(2)})`);
  }
  return [...faint];
}"""

_NAMELESS = """() => {
  const named = (one) =>
    one.getAttribute("aria-label") ||
    one.getAttribute("aria-labelledby") ||
    [...(one.labels ?? [])].some((label) => label.textContent.trim()) ||
    one.closest("label")?.textContent.trim() ||
    (!one.matches("input, select, textarea") && one.textContent.trim());
  const controls = "a[href], button, input:not([type=hidden]), select, textarea, summary, " +
    "[role=button], [role=combobox], [role=link], [role=grid], [role=treegrid], [role=dialog]";
  return [...document.querySelectorAll(controls)]
    .filter((one) => one.checkVisibility() && !one.closest("[aria-hidden=true]") && !named(one))
    .map((one) => one.outerHTML.slice(0, 120));
}"""


def faint_texts(page: Page) -> list[str]:
    """Visible texts whose contrast to what they stand on is below 4.5 : 1."""
    found: list[str] = page.evaluate(_FAINT)
    return found


def nameless_controls(page: Page) -> list[str]:
    """Controls that a screen reader has no name for."""
    found: list[str] = page.evaluate(_NAMELESS)
    return found


def tabbed_to(page: Page, most: int = 60) -> list[str]:
    """Names of what the tab key comes by, from the beginning of the page on."""
    page.evaluate("() => { document.activeElement?.blur(); window.focus(); }")
    names = []
    for _ in range(most):
        page.keyboard.press("Tab")
        name = page.evaluate("""() => {
          const one = document.activeElement;
          if (!one || one === document.body) return null;
          const label = one.getAttribute("aria-label") ?? one.closest("label")?.textContent;
          return (label ?? one.textContent ?? "").trim().slice(0, 60) || one.tagName;
        }""")
        if name is None:
            break
        names.append(name)
    return names
