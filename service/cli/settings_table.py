"""The settings as a table of Markdown, for the docs: ``python -m service.cli.settings_table``."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pydantic.fields import FieldInfo

from service.settings import Settings

_BYTES = (("GiB", 1 << 30), ("MiB", 1 << 20))


def settings_table() -> str:
    """A row a setting, in the order of :class:`~service.settings.Settings`."""
    return "\n".join(["| setting | default | meaning |", "|---|---|---|", *_rows()])


def _rows() -> Iterator[str]:
    for name, field in Settings.model_fields.items():
        meaning = (field.description or "").replace("|", "\\|")
        yield f"| `OCCLUDER_{name.upper()}` | {_default(field)} | {meaning} |"


def _default(field: FieldInfo) -> str:
    if field.default_factory is not None:
        return "one a processor"  # what depends on the machine
    return _shown(field.default)


def _shown(value: Any) -> str:
    if value is None or value in ("", ()):
        return "unset"
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, int):
        for unit, size in _BYTES:
            if value >= size and value % size == 0:
                return f"`{value}` ({value // size} {unit})"
    return f"`{value:g}`" if isinstance(value, float) else f"`{value}`"


if __name__ == "__main__":
    print(settings_table())
