"""Settings from the environment and the command line; what is wrong, a line a setting."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from typing import Any

from pydantic import ValidationError
from pydantic_settings import SettingsError as SourceError

from service.errors import SettingsError
from service.settings import Settings

_PREFIX = "OCCLUDER_"


def read_settings(chosen: Mapping[str, Any]) -> Settings:
    """``chosen`` on the command line goes before the environment; None leaves it to that.

    Raises :class:`~service.errors.SettingsError`, whose message has a line a setting.
    """
    try:
        return Settings(**{name: value for name, value in chosen.items() if value is not None})
    except ValidationError as error:
        raise SettingsError("\n".join(_lines(error))) from None
    except SourceError as error:
        raise SettingsError(f"{error}; see docs/service.md") from None


def unknown_settings() -> Iterator[str]:
    """A line for each variable that is no setting but nearly one: a slip of the keyboard."""
    names = [_variable(name) for name in Settings.model_fields]
    for variable in sorted(os.environ):
        if variable.startswith(_PREFIX) and variable not in names:
            for meant in get_close_matches(variable, names, n=1, cutoff=0.85):
                yield f"{variable} is no setting and does nothing; did you mean {meant}?"


def _lines(error: ValidationError) -> Iterator[str]:
    for fault in error.errors(include_url=False):
        name = str(fault["loc"][0]) if fault["loc"] else ""
        about = Settings.model_fields[name].description or ""
        message = fault["msg"].removeprefix("Value error, ")
        yield (
            f"{_variable(name)} cannot be {fault['input']!r}: "
            f"{message[:1].lower()}{message[1:]}; it is: {about.rstrip('.')}"
        )


def _variable(name: str) -> str:
    return f"{_PREFIX}{name.upper()}"
