"""A checked view of the JSON of a glTF file: every access says where it failed."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import cast

from simplifier.errors import UnreadableMeshError
from simplifier.io.text import shown

_LARGEST = 2**53  # whole numbers beyond this are not exact in JSON


@dataclass(frozen=True)
class JsonObject:
    """``where`` is the file and the place inside it, for messages."""

    members: dict[str, object]
    where: str

    def fail(self, what: str, remedy: str = "") -> UnreadableMeshError:
        """The error to raise for this object."""
        return UnreadableMeshError(what, where=self.where, remedy=remedy)

    def has(self, key: str) -> bool:
        return self.members.get(key) is not None

    def integer(self, key: str, default: int | None = None) -> int:
        """A whole number from 0 on; ``default`` when absent, an error when that is None."""
        value = self.members.get(key, default)
        if isinstance(value, float) and value.is_integer():
            value = int(value)
        if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value <= _LARGEST:
            raise self.fail(f"'{key}' is not a whole number from 0 on")
        return value

    def integers(self, key: str) -> list[int]:
        """An array of whole numbers from 0 on; empty when absent."""
        values = self._array(key)
        view = JsonObject({str(i): value for i, value in enumerate(values)}, f"{self.where}.{key}")
        return [view.integer(str(i)) for i in range(len(values))]

    def numbers(self, key: str, length: int) -> list[float] | None:
        """An array of ``length`` finite numbers; None when absent."""
        numbers = self.numbers_or_nan(key, length)
        if numbers is not None and not all(map(math.isfinite, numbers)):
            raise self._not_numbers(key, length)
        return numbers

    def numbers_or_nan(self, key: str, length: int) -> list[float] | None:
        """An array of ``length`` values, NaN for those that are no number; None when absent."""
        values = self._array(key)
        if not self.has(key):
            return None
        if len(values) != length:
            raise self._not_numbers(key, length)
        if set(map(type, values)) == {float}:  # nearly always, and a scene has many matrices
            return cast(list[float], values)
        return [number_or_nan(value) for value in values]

    def texts(self, key: str) -> list[str]:
        """The texts of an array; empty when absent."""
        return [value for value in self._array(key) if isinstance(value, str)]

    def child(self, key: str) -> JsonObject:
        """An object inside this one; without members when absent."""
        value = self.members.get(key)
        return self._view({} if value is None else value, key)

    def count(self, key: str) -> int:
        """Length of an array; 0 when absent."""
        return len(self._array(key))

    def item(self, key: str, index: int) -> JsonObject:
        """One object of an array of objects."""
        values = self._array(key)
        if index >= len(values):
            raise self.fail(f"{key}[{index}] is used, but there are {len(values)}")
        return self._view(values[index], f"{key}[{index}]")

    def _not_numbers(self, key: str, length: int) -> UnreadableMeshError:
        return self.fail(f"'{key}' is not an array of {length} numbers")

    def _array(self, key: str) -> list[object]:
        value = self.members.get(key)
        if value is None:
            return []
        if not isinstance(value, list):
            raise self.fail(f"'{key}' is not an array")
        return value

    def _view(self, value: object, place: str) -> JsonObject:
        if not isinstance(value, dict):
            raise self.fail(f"'{place}' is not an object")
        return JsonObject(value, f"{self.where}: {place}")


def parse_json(data: bytes, where: str) -> JsonObject:
    """Raises :class:`UnreadableMeshError` for what is not a JSON object."""
    check_object(data, where)
    try:
        value = json.loads(data.decode("utf-8-sig"), object_pairs_hook=_members)
    except (ValueError, RecursionError) as error:
        raise UnreadableMeshError(
            f"its JSON is damaged ({str(error)[:80]})",
            where=where,
            remedy="copy or export it again",
        ) from None
    return JsonObject(value, where)


def check_object(start: bytes, where: str) -> None:
    """Raises :class:`UnreadableMeshError` for what does not begin as a JSON object does."""
    text = start.removeprefix(b"\xef\xbb\xbf").lstrip(b" \t\r\n")
    if text and not text.startswith(b"{"):
        raise UnreadableMeshError(
            f"its JSON is not an object: it begins with {shown(text[:8])}",
            where=where,
            remedy="check that this is a glTF file",
        )


def _members(pairs: list[tuple[str, object]]) -> dict[str, object]:
    """Which of two values is meant nobody knows, and glTF forbids it."""
    members = dict(pairs)
    if len(members) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"'{twice[:40]}' stands twice in one object")
    return members


def number_or_nan(value: object) -> float:
    """NaN for what is no number."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.nan
