"""What MkDocs calls on the way from ``docs/`` to the site."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, InclusionLevel

from website import commands, http_routes, json_keys, navigation, python_names, repository

ASSETS = Path(__file__).parent / "assets"


def made_pages() -> dict[str, str]:
    """The pages that are made for the site, by their places in it."""
    return commands.pages() | http_routes.pages() | json_keys.pages() | python_names.pages()


def on_config(config: Any) -> Any:
    written = [
        one.relative_to(repository.ROOT).as_posix()
        for one in sorted((repository.ROOT / repository.DOCS).rglob("*.md"))
    ]
    config.extra["made"] = made_pages()
    config.extra["brought"] = repository.brought_along(written)
    places = [*config.extra["made"], *(repository.site_path(one) for one in written)]
    config.nav = navigation.expanded(config.nav, places)
    return config


def on_files(files: Any, config: Any) -> Any:
    for place, text in config.extra.pop("made").items():
        files.append(File.generated(config, place, content=text))
    for place, found in config.extra.pop("brought").items():
        told: dict[str, Any] = (
            {"content": found} if isinstance(found, str) else {"abs_src_path": str(found)}
        )
        files.append(File.generated(config, place, inclusion=InclusionLevel.NOT_IN_NAV, **told))
    for one in sorted(ASSETS.iterdir()):
        files.append(File.generated(config, f"assets/{one.name}", abs_src_path=str(one)))
    return files


def on_nav(nav: Any, config: Any, files: Any) -> Any:
    navigation.relative(nav.items)
    return nav


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    source = repository.source_of(page.file.src_uri)
    return repository.rewritten(markdown, source) if source else markdown
