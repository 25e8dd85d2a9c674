"""An option as its dataclass states it: kind, limits, unit and the sentence that users read.

    @dataclass(frozen=True)
    class SimplifyOptions(OptionSet):
        budget: int = option(64, "Most triangles of the occluder.", low=1, high=100_000)

``SimplifyOptions.fields()`` is the table that the command line, the HTTP schema, forms and
manifests are made of, and making an object checks every value by the same table.
"""

from __future__ import annotations

import dataclasses
import types
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, Self, TypeVar, Union, get_args, get_origin, get_type_hints

from simplifier.checks import (
    check_above_zero,
    check_flag,
    check_kind,
    check_length,
    check_lengths,
    check_one_of,
    check_positive,
    check_several,
    check_size,
    check_whole,
    check_within,
    settle_numbers,
)
from simplifier.errors import OptionError

OptionKind = Literal["whole", "number", "flag", "choice", "lengths", "wholes", "numbers", "size"]
OptionGroup = Literal[
    "Input and scene", "Quality", "Levels of detail", "Output", "Measurement", "Advanced"
]
"""Under which heads the help of a command lists options, in this order."""

_KEY = "option"
_WANTED = object()


@dataclass(frozen=True)
class OptionField:
    """One option.

    ``name``      its Python keyword; the command line writes ``-`` for ``_``.
    ``kind``      a whole number, a number, yes or no, one of ``choices``, a list of lengths, of
                  whole numbers or of numbers, or a size: columns and rows.
    ``default``   what counts where it is not given.
    ``help``      the sentence that users read; empty for what only programs choose.
    ``low``, ``high``  limits of a number, or of each of a list; None where there is none.
    ``low_excluded``  whether ``low`` itself is refused.
    ``nullable``  whether it may be None, which is then the default.
    ``absent``    what None stands for, in a word or two; empty where it stands for "not wanted".
    ``count``     of a list, how many values it has; None for 1 to 16 different ones.
    ``unit``      of a number: "voxels", "world units", "degrees", "seconds", "pixels", "GiB".
    ``words``     the name as messages have it: "min precision".
    ``of_result``  whether the result depends on it; a limit of memory, say, refuses a run or not.
    ``group``     the head under which the help lists it.
    """

    name: str
    kind: OptionKind
    default: Any
    help: str = ""
    low: float | None = None
    high: float | None = None
    low_excluded: bool = False
    choices: tuple[str, ...] = ()
    nullable: bool = False
    absent: str = ""
    count: int | None = None
    unit: str = ""
    words: str = ""
    of_result: bool = True
    group: OptionGroup = "Advanced"

    def __post_init__(self) -> None:
        if not self.words:
            object.__setattr__(self, "words", self.name.replace("_", " "))

    def check(self, value: Any) -> None:
        """Raise :class:`~simplifier.errors.OptionError`, ``where`` being the words, where wrong.

        Kind and limits are looked at, nothing that another option or the mesh has a say in.
        """
        if value is None and self.nullable:
            return
        match self.kind:
            case "whole":
                self._check_whole(value)
            case "number":
                self._check_number(value)
            case "flag":
                check_flag(self.words, value)
            case "choice":
                check_one_of(self.words, value, self.choices)
            case "lengths":
                check_lengths(self.words, value, self.count)
            case "wholes":
                check_several(self.words, value)
                for one in value:
                    self._check_whole(one)
            case "numbers":
                check_several(self.words, value)
                for one in value:
                    self._check_number(one)
            case "size":
                check_size(self.words, value)

    def _check_whole(self, value: Any) -> None:
        check_whole(self.words, value, int(self.low or 0), int(self.high or 0))

    def _check_number(self, value: Any) -> None:
        if self.high is None:
            (check_positive if self.low_excluded else check_length)(self.words, value)
        elif self.low_excluded:
            check_above_zero(self.words, value, self.high)
        else:
            check_within(self.words, value, self.low or 0.0, self.high)


def option(
    default: Any,
    help: str = "",
    *,
    low: float | None = None,
    high: float | None = None,
    above: float | None = None,
    kind: OptionKind | None = None,
    **more: Any,
) -> Any:
    """A dataclass field that is an option, with the rest as :class:`OptionField` says.

    ``above``  a lower limit that is itself refused, in place of ``low``.
    ``kind``   where the annotation does not tell it: of a float that has no limits.
    """
    said = {"help": help, "low": low if above is None else above, "high": high, "kind": kind,
            "low_excluded": above is not None, **more}  # fmt: skip
    return dataclasses.field(default=default, metadata={_KEY: said})


def shared(options: type[OptionSet], name: str, default: Any = _WANTED, **changes: Any) -> Any:
    """The field of another class, for one that has the same option: its limits, unit and sentence.

    ``default``  another one; where the other's is None, what None stands for.
    ``changes``  to the rest, as for :func:`option`.
    """
    (one,) = (one for one in dataclasses.fields(options) if one.name == name)
    wanted = one.default if default is _WANTED else default
    return dataclasses.field(
        default=wanted, metadata={_KEY: {**one.metadata[_KEY], **changes, "shared": True}}
    )


@dataclass(frozen=True)
class OptionSet:
    """Base of the dataclasses of options: each value is checked when the object is made."""

    def __post_init__(self) -> None:
        settle_numbers(self)
        for one in _all_fields(type(self)):
            one.check(getattr(self, one.name))

    @classmethod
    def fields(cls) -> tuple[OptionField, ...]:
        """The options that users choose, in the order of the help."""
        return tuple(one for one in _all_fields(cls) if one.help)

    @classmethod
    def of(cls, chosen: Mapping[str, Any]) -> Self:
        """From names and values as JSON has them; lists become tuples.

        Raises :class:`OptionError` as the class does, and for a name that it does not know.
        """
        check_kind("options", chosen, Mapping, "an object of names and values")
        names = [one.name for one in cls.fields()]
        for name in chosen:
            if name not in names:
                raise OptionError(
                    "there is no such option",
                    where=str(name),
                    remedy=f"choose from {', '.join(names)}",
                )
        values = {
            name: tuple(value) if isinstance(value, list) else value
            for name, value in chosen.items()
        }
        return cls(**values)

    def chosen(self) -> dict[str, Any]:
        """All that the result depends on, by name."""
        return {
            one.name: getattr(self, one.name) for one in _all_fields(type(self)) if one.of_result
        }


def _all_fields(options: Any) -> tuple[OptionField, ...]:
    return _fields_of(options)


SomeOptions = TypeVar("SomeOptions", bound=OptionSet)


def changed(
    kind: type[SomeOptions], options: SomeOptions | None, changes: Mapping[str, Any]
) -> SomeOptions:
    """The options with some changed, or the defaults with them.

    Raises :class:`OptionError` for what is no ``kind``, and as ``kind`` does.
    """
    if options is None:
        return kind.of(changes)
    check_kind("options", options, kind, f"simplifier.{kind.__name__}")
    return kind.of({**vars(options), **changes}) if changes else options


def passed_on(kind: type[SomeOptions], chosen: OptionSet, **decided: Any) -> SomeOptions:
    """The options of a stage: those that it shares with the ``chosen`` by name, and the decided.

    What is None was not chosen, so the stage's default counts.
    """
    values: dict[str, Any] = {}
    for one in dataclasses.fields(kind):
        if one.metadata.get(_KEY, {}).get("shared") and getattr(chosen, one.name, None) is not None:
            values[one.name] = getattr(chosen, one.name)
    return kind(**{**values, **decided})


@cache
def _fields_of(options: Any) -> tuple[OptionField, ...]:
    hints = get_type_hints(options)
    return tuple(
        _field(one.name, hints[one.name], one.default, one.metadata[_KEY])
        for one in dataclasses.fields(options)
        if _KEY in one.metadata
    )


def _field(name: str, hint: Any, default: Any, said: Mapping[str, Any]) -> OptionField:
    """An option, of the kind that its annotation tells."""
    nullable = get_origin(hint) in (Union, types.UnionType) and type(None) in get_args(hint)
    if nullable:
        (hint,) = (one for one in get_args(hint) if one is not type(None))
    choices = get_args(hint) if get_origin(hint) is Literal else ()
    told = {key: value for key, value in said.items() if key not in ("kind", "shared")}
    kind = said["kind"] or ("choice" if choices else _KINDS[hint])
    return OptionField(name, kind, default, choices=choices, nullable=nullable, **told)


_KINDS: Mapping[Any, OptionKind] = {
    int: "whole",
    float: "number",
    bool: "flag",
    tuple[int, ...]: "wholes",
    tuple[float, ...]: "numbers",
    tuple[int, int]: "size",
}
