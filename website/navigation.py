"""The navigation of ``mkdocs.yml``, with what its shorthands stand for."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any


def expanded(nav: Any, places: Iterable[str]) -> Any:
    """The navigation with ``folder/`` as the pages below it, and sections as links.

    ``places`` are all pages of the site, in the order that a folder lists them in.  MkDocs warns
    of links that it takes for lost pages, and has no word for a section; an absolute link it lets
    pass, and :func:`relative` mends it.
    """
    known = list(places)
    if isinstance(nav, list):
        return [expanded(one, known) for one in nav]
    if isinstance(nav, dict):
        return {title: expanded(one, known) for title, one in nav.items()}
    if nav.endswith("/"):
        return [one for one in known if one.startswith(nav)]
    page, mark, section = nav.partition("#")
    return f"/{page.removesuffix('.md')}.html#{section}" if mark else nav


def relative(items: Iterable[Any]) -> None:
    """Mend the links to sections in MkDocs' own navigation: they start where the site does."""
    for one in items:
        if one.is_link:
            one.url = one.url.removeprefix("/")
        elif one.is_section:
            relative(one.children)


def targets(nav: Any) -> Iterator[str]:
    """Every page, folder and section that a navigation names, as it is written."""
    if isinstance(nav, list):
        for one in nav:
            yield from targets(one)
    elif isinstance(nav, dict):
        for one in nav.values():
            yield from targets(one)
    else:
        yield nav
